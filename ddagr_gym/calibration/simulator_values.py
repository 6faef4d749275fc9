"""What a calibration found, in numbers with units, as robots, soils, effects and draws of a simulator."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

from ddagr_gym.calibration.accelerometer_results import ImuMounting
from ddagr_gym.calibration.calibration_data import CalibrationData
from ddagr_gym.calibration.joint_fit import FittedModel
from ddagr_gym.calibration.parts import SCALES, RobotModel, factors_of_banks, is_stated, part_of
from ddagr_gym.calibration.result import CalibratedParameter, Calibration
from ddagr_gym.envs.calibrated_draws import CalibratedDraws, GroundDraws
from ddagr_gym.identification.fitted_values import robot_with_values, soil_with_values
from ddagr_gym.identification.parameters import LIMITS, ModelParameter
from ddagr_gym.parameters import Drivetrain, Robot, Soil
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.command_gain import CommandGain
from ddagr_gym.physics.effects.encoder_scale import EncoderScale
from ddagr_gym.physics.effects.gyro_scale import GyroScale
from ddagr_gym.physics.effects.imu_lever_arm import ImuLeverArm
from ddagr_gym.physics.effects.imu_misalignment import ImuMisalignment
from ddagr_gym.physics.effects.imu_tilt import ImuTilt

SOIL_PARAMETERS = ("soil_strength", "soil_stiffness", "shear_modulus", "exit_angle_ratio")
"""Parameters that a ground has of its own; the first two are factors on two entries of a soil each."""

SOIL = "soil"
"""Stands for a part of the robot with the parameters of a soil."""

SOIL_HELPS = "turns on the spot and hard accelerations on this ground"
"""Drive that determines what a soil keeps."""

_UNITS = {
    "mass": "kg",
    "yaw_inertia": "kg m^2",
    "half_wheelbase": "m",
    "half_track": "m",
    "motor_rate": "1/s",
    "maximum_wheel_speed": "rad/s",
    "half_width": "m",
    "outer_radius": "m",
    **dict.fromkeys(SCALES, "-"),
    "soil_strength": "-",
    "soil_stiffness": "-",
    "shear_modulus": "m",
    "exit_angle_ratio": "-",
    **{item.name: item.metadata["unit"] for item in fields(Drivetrain)},
}


@dataclass(frozen=True)
class Quantity:
    """A parameter as a reader knows it.

    Attributes:
        name: identifier; of a soil with its ground behind a slash.
        base: identifier without the ground.
        ground: "" for the robot.
        part: of the robot, or :data:`SOIL`.
        unit: of its value.
        stated: value of the data sheet; None where it says nothing.
        nominal: value at no change: that, or a likely one.
        scale: what a factor acts on, which is less than the value for a radius; 0 for a difference.
        helps: drive that determines it.
    """

    name: str
    base: str
    ground: str
    part: str
    unit: str
    stated: float | None
    nominal: float
    scale: float
    helps: str

    def value(self, change: float) -> float:
        """Value after a change of the fitted parameter, which is a logarithm of a factor or a difference."""
        if self.scale == 0.0:
            return self.nominal + change
        return self.nominal + self.scale * math.expm1(change)

    def deviation(self, change: float, deviation: float) -> float:
        """Deviation of the value for one of the change."""
        return deviation if self.scale == 0.0 else self.scale * math.exp(change) * deviation


def quantity(data: CalibrationData, model: RobotModel, parameter: ModelParameter) -> Quantity:
    """What a fitted parameter is.

    Args:
        data: drives with the data sheet.
        model: with all parts.
        parameter: of it.
    """
    base, ground = _split(data, parameter.name)
    nominal, scale = _soil_scale(data.soils[ground], base) if ground else _robot_scale(model.robot, base)
    part = None if ground else part_of(base)
    says_nothing = base in LIMITS and not is_stated(data.robot, base)
    return Quantity(
        f"{base}/{ground}" if ground else base, base, ground, SOIL if part is None else part.name, _UNITS[base],
        None if says_nothing else nominal, nominal, scale, SOIL_HELPS if part is None else part.helps,
    )  # fmt: skip


def _split(data: CalibrationData, name: str) -> tuple[str, str]:
    """Name without the ground, and the ground; "" for what belongs to the robot."""
    for base in SOIL_PARAMETERS:
        for ground in data.drives_on:
            if name == f"{base}_{ground}":
                return base, ground
    return name, ""


def _robot_scale(robot: Robot, name: str) -> tuple[float, float]:
    """Value of a robot's parameter and what a factor on it acts on; 0 where the fit adds to it."""
    wheel = robot.wheels[0]
    special = {
        "outer_radius": (robot.outer_radius, wheel.major_radius),
        "half_width": (wheel.half_width, wheel.half_width),
        **dict.fromkeys(SCALES, (1.0, 1.0)),
    }
    if name in special:
        return special[name]
    if hasattr(robot.drivetrain, name):
        value = float(getattr(robot.drivetrain, name))
        return value, value if name in LIMITS else 0.0
    value = float(getattr(robot, name))
    return value, value


def _soil_scale(soil: Soil, name: str) -> tuple[float, float]:
    if name in ("soil_strength", "soil_stiffness"):
        return 1.0, 1.0
    if name == "exit_angle_ratio":
        return soil.exit_angle_ratio, 0.0
    return soil.shear_modulus, soil.shear_modulus


def fitted_soil(data: CalibrationData, ground: str, values: Mapping[str, float]) -> Soil:
    """Nominal soil of a ground at values of the fit."""
    own = {base: values.get(f"{base}_{ground}", 0.0) for base in SOIL_PARAMETERS}
    return soil_with_values(data.soils[ground], own)


def fitted_factors(values: Mapping[str, float]) -> tuple[Effect, ...]:
    """What has no place in a robot or a soil, at values of the fit."""
    factors = {name: math.exp(values.get(name, 0.0)) for name in SCALES}
    found: list[Effect] = [] if factors["gyro_scale"] == 1.0 else [GyroScale(factors["gyro_scale"])]
    for kind in (EncoderScale, CommandGain):
        right, left = (factors[name] for name in factors_of_banks(kind.name))
        found += [] if right == left == 1.0 else [kind(right, left)]
    return tuple(found)


def calibrated_robot(data: CalibrationData, model: FittedModel, calibration: Calibration) -> Robot:
    """Robot with fitted values; deviations are what another drive may find.

    Args:
        data: drives with the data sheet.
        model: joint fit.
        calibration: for the deviations.
    """
    found = [i for i in calibration.parameters if i.calibrated and not i.ground and i.name not in SCALES]
    known = {p.name: quantity(data, model.model, p) for p in model.parameters if p.prior > 0.0 and p.scope is None}
    sizes = {item.name: known[item.name].deviation(item.change, item.deviation_elsewhere) for item in found}
    sources = ", ".join(drive.source for drive in calibration.drives)
    return replace(
        robot_with_values(model.model.robot, model.values),
        standard_deviations={**data.robot.standard_deviations, **sizes},
        source=f"calibrated with {sources}; before: {data.robot.source}",
    )


def calibrated_effects(calibration: Calibration) -> tuple[Effect, ...]:
    """What was calibrated and has no place in a robot or a soil: sensors, and gains of commands."""
    changes = {item.name: item.change for item in calibration.parameters if item.calibrated}
    return (*fitted_factors(changes), *mounting_effects(calibration.imu))


def mounting_effects(found: ImuMounting | None) -> tuple[Effect, ...]:
    """What was kept of a mounting as missing physics of a simulator, in the order in which it acts on the readings."""
    if found is None:
        return ()
    sizes = {item.name: item.value for item in found.sizes if item.kept}
    effects: list[Effect] = []
    if "imu_x" in sizes:
        effects.append(ImuLeverArm(sizes["imu_x"], sizes["imu_y"]))
    if "imu_yaw" in sizes:
        effects.append(ImuMisalignment(sizes["imu_yaw"]))
    if "imu_roll" in sizes or "imu_pitch" in sizes:
        effects.append(ImuTilt(sizes.get("imu_roll", 0.0), sizes.get("imu_pitch", 0.0)))
    return tuple(effects)


def calibrated_draws(calibration: Calibration, robot: Robot, soils: Mapping[str, Soil]) -> CalibratedDraws:
    """Robots, soils and slopes as they differ between drives, for episodes to draw from.

    Args:
        calibration: with the scatter.
        robot: calibrated.
        soils: calibrated, by ground.
    """
    found = [item for item in calibration.parameters if item.calibrated and item.name not in SCALES]
    slopes = {item.ground: (item.gradient, item.deviations) for item in calibration.slopes}
    grounds = tuple(
        GroundDraws(
            ground,
            soil,
            {i.name.partition("/")[0]: _on_another_day(i) for i in found if i.ground == ground},
            *slopes.get(ground, ()),
        )
        for ground, soil in soils.items()
    )
    return CalibratedDraws(robot, {i.name: i.deviation_elsewhere for i in found if not i.ground}, grounds)


def _on_another_day(item: CalibratedParameter) -> float:
    """Deviation of a soil's change in a further drive on its ground."""
    return math.hypot(item.deviation or 0.0, item.scatter.same_ground or 0.0)
