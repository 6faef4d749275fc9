"""Robot and soil with the values of a fit: the one place where nuisance parameters become numbers of both."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from ddagr_gym.identification.parameters import drivetrain_of
from ddagr_gym.parameters import Robot, Soil

_ROBOT = ("mass", "yaw_inertia", "half_wheelbase", "half_track", "motor_rate", "maximum_wheel_speed")
"""Fields of a robot whose nuisance is the logarithm of a factor."""


def with_values(robot: Robot, soil: Soil, values: Mapping[str, float]) -> tuple[Robot, Soil]:
    """Robot and soil with nuisance parameters at values, as :mod:`ddagr_gym.identification.nuisances` defines them.

    Args:
        robot: nominal.
        soil: nominal.
        values: by name; those that are missing are at their nominal value. Biases and clocks belong to a recording and
            are left out.
    """
    return _robot(robot, values), _soil(soil, values)


def _robot(robot: Robot, values: Mapping[str, float]) -> Robot:
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
    drivetrain = drivetrain_of(robot, values)
    return replace(robot, wheels=wheels, drivetrain=drivetrain, side_slip_lead=lead, **factors)


def _soil(soil: Soil, values: Mapping[str, float]) -> Soil:
    def factor(*names: str) -> float:
        return math.exp(sum(values.get(name, 0.0) for name in names))

    def shifted(nominal: float, name: str, low: float) -> float:
        return min(max(nominal + values.get(name, 0.0), low), 1.0)

    strong = factor("soil_strength", "friction")
    return replace(
        soil,
        cohesion=soil.cohesion * factor("soil_strength"),
        friction_angle=math.atan(math.tan(soil.friction_angle) * strong),
        sinkage_exponent=soil.sinkage_exponent * factor("sinkage_exponent"),
        cohesive_modulus=soil.cohesive_modulus * factor("soil_stiffness"),
        frictional_modulus=soil.frictional_modulus * factor("soil_stiffness"),
        shear_modulus=soil.shear_modulus * factor("shear_modulus"),
        peak_stress_coefficient_0=shifted(soil.peak_stress_coefficient_0, "stress_peak", 0.0),
        peak_stress_coefficient_1=shifted(soil.peak_stress_coefficient_1, "stress_peak_slip", -1.0),
        exit_angle_ratio=shifted(soil.exit_angle_ratio, "exit_angle_ratio", 0.0),
    )
