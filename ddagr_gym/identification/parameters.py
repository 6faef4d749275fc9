"""Uncertain parameters of the nominal model: what a refit may move, how far, and where it stands in a row."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.physics import layout

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ModelParameter:
    """A scalar that changes simulator rows; 0 is the nominal value.

    Attributes:
        name: identifier.
        unit: of the value; "-" for logarithms of factors.
        entries: row entries that it changes.
        factor: True multiplies them by exp(value), False adds the value.
        prior: standard deviation about 0.
        step: for finite differences.
        low: bound.
        high: bound.
        recording: only windows of this recording, or None for all.
        shift: the value is a delay of the commands [s] instead of a row entry.
        heading: the value turns the recording's starts [rad] instead of changing a row entry.
    """

    name: str
    unit: str
    entries: tuple[int, ...]
    factor: bool
    prior: float
    step: float
    low: float
    high: float
    recording: int | None = None
    shift: bool = False
    heading: bool = False

    def apply(self, rows: Array, value: float, recording: NDArray[np.int64]) -> None:
        """Change the rows (W, SIZE) of the windows it concerns, in place."""
        if not self.entries or value == 0.0:
            return
        chosen = np.ones(len(rows), dtype=bool) if self.recording is None else recording == self.recording
        index = np.ix_(chosen, np.array(self.entries))
        rows[index] = rows[index] * math.exp(value) if self.factor else rows[index] + value


def _log(name: str, entries: Sequence[int], prior: float, limit: float = 1.6) -> ModelParameter:
    return ModelParameter(name, "-", tuple(entries), True, prior, 0.02, -limit, limit)


def _soil(index: int) -> list[int]:
    return [layout.BASE_SOIL + 9 * wheel + index for wheel in range(4)]


FIELD_STIFFNESS_DEVIATION = 0.4
"""Spread of the soil's stiffness within a field, as the deviation of its logarithm (ours)."""

KIND_STIFFNESS_DEVIATION = 1.2
"""The same over soils of one kind: 1.19 for the pressure at 3 cm over the nine sands of ``published_soils``."""


def soil_parameters(
    soil: Soil | None = None, stiffness_deviation: float = FIELD_STIFFNESS_DEVIATION
) -> tuple[ModelParameter, ...]:
    """Soil: strength varies by some ten percent (0.26 over published sands), stiffness and shear modulus by more.

    Args:
        soil: nominal one, which bounds the exit angle ratio; bounds that suit any preset's by default.
        stiffness_deviation: prior of the logarithm of the stiffness.
    """
    strength = _soil(layout.SOIL_COHESION) + _soil(layout.SOIL_FRICTION_TANGENT)
    stiffness = _soil(layout.SOIL_COHESIVE_MODULUS) + _soil(layout.SOIL_FRICTIONAL_MODULUS)
    low, high = (-0.85, 0.1) if soil is None else (-soil.exit_angle_ratio, 1.0 - soil.exit_angle_ratio)
    return (
        _log("soil_strength", strength, 0.3),
        _log("soil_stiffness", stiffness, stiffness_deviation, max(1.6, 3.0 * stiffness_deviation)),
        _log("shear_modulus", _soil(layout.SOIL_SHEAR_MODULUS), 0.5),
        ModelParameter("exit_angle_ratio", "-", tuple(_soil(layout.SOIL_EXIT_RATIO)), False, 0.2, 0.02, low, high),
    )


_ROBOT_ENTRIES = {
    "mass": (layout.BASE_BODY,),
    "yaw_inertia": (layout.BASE_BODY + 1,),
    "half_wheelbase": (layout.HALF_WHEELBASE,),
    "half_track": (layout.HALF_TRACK,),
    "motor_rate": (layout.BASE_MOTOR_RATE,),
    "maximum_wheel_speed": (layout.MAXIMUM_WHEEL_SPEED,),
    "half_width": tuple(layout.BASE_WHEEL + 4 + i for i in range(4)),
    "outer_radius": tuple(layout.BASE_WHEEL + 8 + i for i in range(4)),
}


def robot_parameters(robot: Robot) -> tuple[ModelParameter, ...]:
    """What the robot states as uncertain, as logarithms of factors with its relative standard deviations."""
    nominal = {
        "mass": robot.mass,
        "yaw_inertia": robot.yaw_inertia,
        "half_wheelbase": robot.half_wheelbase,
        "half_track": robot.half_track,
        "motor_rate": robot.motor_rate,
        "maximum_wheel_speed": robot.maximum_wheel_speed,
        "half_width": robot.wheels[0].half_width,
        "outer_radius": robot.wheels[0].major_radius,
    }
    return tuple(
        _log(name, _ROBOT_ENTRIES[name], deviation / nominal[name], max(1.6, 4.0 * deviation / nominal[name]))
        for name, deviation in robot.standard_deviations.items()
        if name in nominal and deviation > 0.0
    )


def sensor_parameters(recordings: int, gyro_bias: float, accelerometer_bias: float) -> tuple[ModelParameter, ...]:
    """Biases of each recording, with their standard deviations [rad/s], [m/s^2]."""
    made: list[ModelParameter] = []
    for number in range(recordings):
        made.append(
            ModelParameter(
                f"gyro_bias_{number + 1}", "rad/s", (layout.GYRO_BIAS,), False, gyro_bias, 1e-4, -1.0, 1.0, number
            )
        )
        made += [
            ModelParameter(
                f"accelerometer_bias_{axis}_{number + 1}", "m/s^2", (layout.ACCELEROMETER_BIAS + k,), False,
                accelerometer_bias, 1e-3, -5.0, 5.0, number,
            )
            for k, axis in enumerate("xy")
        ]  # fmt: skip
    return tuple(made)


def heading_parameters(recordings: Sequence[int], deviation: float) -> tuple[ModelParameter, ...]:
    """Headings at which recordings without poses begin, with their standard deviation [rad]."""
    return tuple(
        ModelParameter(f"heading_{number + 1}", "rad", (), False, deviation, 0.02, -1e3, 1e3, number, heading=True)
        for number in recordings
    )


def command_shift(period: float) -> ModelParameter:
    """Delay of the commands within the two samples by which loggers differ in what a row's command means."""
    return ModelParameter("command_shift", "s", (), False, period, 0.1 * period, 0.0, 2.0 * period, shift=True)


def wheel_speed_shift(limit: float, prior: float = 0.1) -> ModelParameter:
    """Lateness of imposed wheel speeds behind the inertial sensors, as a delay (negative where they come late).

    Args:
        limit: largest size [s]; the windows must keep as much drive before and after them.
        prior: standard deviation [s]; encoder messages come at a few hertz and are stamped on arrival.
    """
    return ModelParameter("wheel_speed_shift", "s", (), False, prior, 0.005, -limit, limit, shift=True)
