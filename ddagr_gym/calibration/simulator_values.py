"""Fitted values as numbers of a robot and of soils: the one place where a logarithm becomes a number with a unit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from ddagr_gym.calibration.calibration_data import CalibrationData
from ddagr_gym.calibration.parts import part_of
from ddagr_gym.calibration.result import CalibratedParameter, Calibration
from ddagr_gym.diagnosis.null_bank.fitted_nominal import with_values
from ddagr_gym.identification.parameters import ModelParameter
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.command_delay import CommandDelay
from ddagr_gym.physics.effects.gyro_scale import GyroScale

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
    "command_delay": "s",
    "gyro_scale": "-",
    "soil_strength": "-",
    "soil_stiffness": "-",
    "shear_modulus": "m",
    "exit_angle_ratio": "-",
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
        nominal: value of the data sheet.
        scale: what a factor acts on, which is less than the value for a radius; 0 for a difference.
        helps: drive that determines it.
    """

    name: str
    base: str
    ground: str
    part: str
    unit: str
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


def quantity(data: CalibrationData, parameter: ModelParameter) -> Quantity:
    """What a fitted parameter is."""
    base, ground = _split(data, parameter.name)
    nominal, scale = _soil_scale(data.soils[ground], base) if ground else _robot_scale(data.robot, base)
    part = None if ground else part_of(base)
    name = f"{base}/{ground}" if ground else base
    return Quantity(
        name, base, ground, SOIL if part is None else part.name, _UNITS[base], nominal, scale,
        SOIL_HELPS if part is None else part.helps,
    )  # fmt: skip


def _split(data: CalibrationData, name: str) -> tuple[str, str]:
    """Name without the ground, and the ground; "" for what belongs to the robot."""
    for base in SOIL_PARAMETERS:
        for ground in data.drives_on:
            if name == f"{base}_{ground}":
                return base, ground
    return name, ""


def _robot_scale(robot: Robot, name: str) -> tuple[float, float]:
    wheel = robot.wheels[0]
    if name == "outer_radius":
        return robot.outer_radius, wheel.major_radius
    if name == "half_width":
        return wheel.half_width, wheel.half_width
    if name == "gyro_scale":
        return 1.0, 1.0
    if name == "command_delay":
        return 0.0, 0.0
    value = float(getattr(robot, name))
    return value, value


def _soil_scale(soil: Soil, name: str) -> tuple[float, float]:
    if name in ("soil_strength", "soil_stiffness"):
        return 1.0, 1.0
    if name == "exit_angle_ratio":
        return soil.exit_angle_ratio, 0.0
    return soil.shear_modulus, soil.shear_modulus


def calibrated_robot(data: CalibrationData, values: Mapping[str, float], calibration: Calibration) -> Robot:
    """Robot of the data sheet with fitted values; deviations are what another drive may find.

    Args:
        data: drives.
        values: of the fitted parameters.
        calibration: for the deviations.
    """
    robot, _ = with_values(data.robot, next(iter(data.soils.values())), values)
    found = [item for item in calibration.parameters if item.calibrated and item.name in robot.standard_deviations]
    sizes = {item.name: _of_another_drive(item) for item in found}
    sources = ", ".join(drive.source for drive in calibration.drives)
    source = f"calibrated with {sources}; before: {robot.source}"
    return replace(robot, standard_deviations={**robot.standard_deviations, **sizes}, source=source)


def _of_another_drive(item: CalibratedParameter) -> float:
    """Deviation of a value in a further drive: what is uncertain of the mean, and what differs between drives."""
    change = math.hypot(item.deviation or 0.0, item.scatter.other_grounds or 0.0)
    scale = item.value - item.data_sheet + _scale(item)
    return change if item.unit == "s" else abs(scale) * change


def _scale(item: CalibratedParameter) -> float:
    """What a factor acts on before the calibration."""
    if item.change == 0.0:
        return item.data_sheet
    return (item.value - item.data_sheet) / math.expm1(item.change)


def calibrated_soil(data: CalibrationData, ground: str, values: Mapping[str, float]) -> Soil:
    """Nominal soil of a ground with fitted values."""
    own = {base: values.get(f"{base}_{ground}", 0.0) for base in SOIL_PARAMETERS}
    _, soil = with_values(data.robot, data.soils[ground], own)
    return soil


def calibrated_effects(calibration: Calibration) -> tuple[Effect, ...]:
    """What was calibrated and has no place in a robot or a soil: sensors."""
    named = {item.name: item for item in calibration.parameters if item.calibrated}
    found: list[Effect] = []
    if "gyro_scale" in named:
        found.append(GyroScale(named["gyro_scale"].value))
    if "command_delay" in named:
        found.append(CommandDelay(named["command_delay"].value))
    return tuple(found)
