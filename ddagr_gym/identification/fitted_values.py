"""Robot and soil with the values of a fit: the one place where nuisance parameters become numbers of both."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from ddagr_gym.identification.parameters import SOIL_BOUNDS, drivetrain_of
from ddagr_gym.parameters import Robot, Soil

_ROBOT = ("mass", "yaw_inertia", "half_wheelbase", "half_track", "motor_rate", "maximum_wheel_speed")
"""Fields of a robot whose nuisance is the logarithm of a factor."""


def with_values(robot: Robot, soil: Soil, values: Mapping[str, float], *, held: bool = False) -> tuple[Robot, Soil]:
    """Robot and soil with nuisance parameters at values, as :mod:`ddagr_gym.identification.nuisances` defines them.

    Args:
        robot: nominal.
        soil: nominal.
        values: by name; those that are missing are at their nominal value. Biases and clocks belong to a recording and
            are left out.
        held: take a soil that leaves its bounds at them, as for draws around a fit.

    Raises:
        InputError: the values are no robot, or no soil.
    """
    return robot_with_values(robot, values), soil_with_values(soil, values, held=held)


def robot_with_values(robot: Robot, values: Mapping[str, float]) -> Robot:
    """The same of a robot alone."""
    factors = {name: getattr(robot, name) * math.exp(values.get(name, 0.0)) for name in _ROBOT}
    wheels = tuple(
        replace(
            wheel,
            half_width=wheel.half_width * math.exp(values.get("half_width", 0.0)),
            major_radius=wheel.major_radius * math.exp(values.get("outer_radius", 0.0)),
        )
        for wheel in robot.wheels
    )
    lead = robot.side_slip_lead + values.get("side_slip_lead", 0.0)
    tilt = min(max(robot.sinkage_tilt + values.get("sinkage_tilt", 0.0), 0.0), 1.0)
    drivetrain = drivetrain_of(robot, values)
    return replace(robot, wheels=wheels, drivetrain=drivetrain, side_slip_lead=lead, sinkage_tilt=tilt, **factors)


def soil_with_values(soil: Soil, values: Mapping[str, float], *, held: bool = False) -> Soil:
    """The same of a soil alone."""

    def factor(*names: str) -> float:
        return math.exp(sum(values.get(name, 0.0) for name in names))

    def shifted(field: str, name: str) -> float:
        return _held_in_bounds(field, float(getattr(soil, field)) + values.get(name, 0.0))

    strong = factor("soil_strength", "friction")
    changed = {
        "cohesion": soil.cohesion * factor("soil_strength"),
        "friction_angle": math.atan(math.tan(soil.friction_angle) * strong),
        "sinkage_exponent": soil.sinkage_exponent * factor("sinkage_exponent"),
        "cohesive_modulus": soil.cohesive_modulus * factor("soil_stiffness"),
        "frictional_modulus": soil.frictional_modulus * factor("soil_stiffness"),
        "shear_modulus": soil.shear_modulus * factor("shear_modulus"),
        "peak_stress_coefficient_0": shifted("peak_stress_coefficient_0", "stress_peak"),
        "peak_stress_coefficient_1": shifted("peak_stress_coefficient_1", "stress_peak_slip"),
        "exit_angle_ratio": shifted("exit_angle_ratio", "exit_angle_ratio"),
    }
    if held:
        changed = {field: _held_in_bounds(field, value) for field, value in changed.items()}
    return replace(soil, **changed)


def _held_in_bounds(field: str, value: float) -> float:
    """A number of a soil, or the nearest bound where it leaves what a soil may be."""
    return float(min(max(value, SOIL_BOUNDS[field]["low"]), SOIL_BOUNDS[field]["high"]))
