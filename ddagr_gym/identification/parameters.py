"""Uncertain parameters of the nominal model: what a fit may move, how far, in which recordings, and where in a row.

A parameter is *shared* by all recordings, or has a *scope*: the recordings in which it acts. A fit over many drives
takes the shared ones as they are and, for the others, one of a kind per group (:func:`per_group`): a motor rate for
the robot, a strength for each ground, a bias for each drive. Both may move the same entries; the shared value is then
the mean of the grounds, and the prior of each own one is how much grounds differ (a hierarchical prior).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.parameters import UNCERTAIN, Drivetrain, Robot, Soil
from ddagr_gym.physics import layout

Array = NDArray[np.float64]


CURRENT = "current_"
"""Begins the names of the unknown constants between motor torque and measured current."""

OF_SENSORS = ("gyro_bias", CURRENT)
"""Begin the names of parameters that belong to sensors, not to robot or ground."""


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
        scope: numbers of the recordings in which it acts; None for all of them.
        shift: the value is a delay of the commands [s] instead of a row entry.
        heading: the value turns the recording's starts [rad] instead of changing a row entry.
        centred: its finite differences go to both sides.
    """

    name: str
    unit: str
    entries: tuple[int, ...]
    factor: bool
    prior: float
    step: float
    low: float
    high: float
    scope: frozenset[int] | None = None
    shift: bool = False
    heading: bool = False
    centred: bool = False

    @property
    def recording(self) -> int | None:
        """The one recording in which it acts; None for a parameter of all or several."""
        return next(iter(self.scope)) if self.scope is not None and len(self.scope) == 1 else None

    def acts_in(self, recording: NDArray[np.int64]) -> NDArray[np.bool_]:
        """(W,) whether it acts in windows of these recordings (W,)."""
        if self.scope is None:
            return np.ones(len(recording), dtype=bool)
        # np.isin takes ten times as long for the few recordings of a scope, and every prediction asks
        acts = np.zeros(len(recording), dtype=bool)
        for number in self.scope:
            acts |= recording == number
        return acts

    def apply(self, rows: Array, value: float, recording: NDArray[np.int64]) -> None:
        """Change the rows (W, SIZE) of the windows in which it acts, in place."""
        if not self.entries or value == 0.0:
            return
        index = np.ix_(self.acts_in(recording), np.array(self.entries))
        rows[index] = rows[index] * math.exp(value) if self.factor else rows[index] + value


def per_group(parameter: ModelParameter, groups: Mapping[str, Collection[int]]) -> tuple[ModelParameter, ...]:
    """One of a parameter for each group of recordings, such as a soil strength for each ground.

    Args:
        parameter: shared; its bounds, step and prior hold for each of them.
        groups: numbers of the recordings by label, which ends the name (``soil_strength_sand``).

    Raises:
        InputError: a group without recordings, or a recording in two groups.
    """
    listed = [number for numbers in groups.values() for number in numbers]
    twice = sorted({number for number in listed if listed.count(number) > 1})
    empty = [label for label, numbers in groups.items() if not numbers]
    if twice or empty:
        wrong = f"recording {twice[0]} is in two groups" if twice else f"the group {empty[0]!r} has no recording"
        raise InputError(f"{parameter.name}: {wrong}: give each recording to one group at most, and each group one.")
    return tuple(
        replace(parameter, name=f"{parameter.name}_{label}", scope=frozenset(numbers))
        for label, numbers in groups.items()
    )


def disjoint_scopes(parameters: Sequence[ModelParameter], chosen: Sequence[int]) -> list[list[int]]:
    """Indices of parameters in lists within which no two act in the same recording; a shared one is alone.

    Args:
        parameters: of a model.
        chosen: indices among them.
    """
    together: list[list[int]] = []
    taken: list[frozenset[int] | None] = []
    for k in chosen:
        scope = parameters[k].scope
        fits = (n for n, other in enumerate(taken) if scope is not None and other is not None and not scope & other)
        place = next(fits, len(together))
        if place == len(together):
            together.append([])
            taken.append(scope)
        elif scope is not None:
            taken[place] = scope.union(taken[place] or ())
        together[place].append(k)
    return together


SOIL_BOUNDS = {item.name: item.metadata for item in fields(Soil)}
"""By field of a soil, the "low" and the "high" that it may have."""

_LOG_LIMIT = 1.6
"""Largest logarithm of a factor (ours): five times more or less is another soil, or another robot."""


def _log(name: str, entries: Sequence[int], prior: float, limit: float = _LOG_LIMIT) -> ModelParameter:
    return ModelParameter(name, "-", tuple(entries), True, prior, 0.02, -limit, limit)


def soil_entries(index: int, wheels: Sequence[int] = range(4)) -> tuple[int, ...]:
    """Row entries of one soil parameter under some wheels."""
    return tuple(layout.BASE_SOIL + 9 * wheel + index for wheel in wheels)


FIELD_STIFFNESS_DEVIATION = 0.4
"""Spread of the soil's stiffness within a field, as the deviation of its logarithm (ours)."""

KIND_STIFFNESS_DEVIATION = 1.2
"""The same over soils of one kind: 1.19 for the pressure at 3 cm over the nine published sands."""


def soil_parameters(
    soil: Soil | None = None, stiffness_deviation: float = FIELD_STIFFNESS_DEVIATION
) -> tuple[ModelParameter, ...]:
    """Soil: strength varies by some ten percent (0.26 over published sands), stiffness and shear modulus by more.

    Args:
        soil: nominal one, of which a fit makes no soil that cannot be; bounds that suit any preset's by default.
        stiffness_deviation: prior of the logarithm of the stiffness.
    """
    strength = soil_entries(layout.SOIL_COHESION) + soil_entries(layout.SOIL_FRICTION_TANGENT)
    stiffness = soil_entries(layout.SOIL_COHESIVE_MODULUS) + soil_entries(layout.SOIL_FRICTIONAL_MODULUS)
    low, high = (-0.85, 0.1) if soil is None else (-soil.exit_angle_ratio, 1.0 - soil.exit_angle_ratio)
    strongest = _LOG_LIMIT if soil is None else min(_LOG_LIMIT, _to_steepest(soil))
    return (
        replace(_log("soil_strength", strength, 0.3), high=strongest),
        _log("soil_stiffness", stiffness, stiffness_deviation, max(_LOG_LIMIT, 3.0 * stiffness_deviation)),
        _log("shear_modulus", soil_entries(layout.SOIL_SHEAR_MODULUS), 0.5),
        ModelParameter("exit_angle_ratio", "-", soil_entries(layout.SOIL_EXIT_RATIO), False, 0.2, 0.02, low, high),
    )


def _to_steepest(soil: Soil) -> float:
    """Logarithm of the factor of a soil's strength at which its friction is the most that a soil may have."""
    most, own = SOIL_BOUNDS["friction_angle"]["high"], math.tan(soil.friction_angle)
    # a hair less, since a tangent and its inverse round
    return math.log(math.tan(most) / own) - 1e-9 if own > 0.0 else math.inf


_SLOPE = 5
"""Place of the ground's gradient behind mass, yaw inertia and centre of mass."""


def slope_parameters(deviations: Sequence[float]) -> tuple[ModelParameter, ...]:
    """Gradient of the ground along the world's axes, with its standard deviations [-] (theory: wheel model, eq. (23)).

    Args:
        deviations: along x and y.
    """
    return tuple(
        ModelParameter(f"slope_{axis}", "-", (layout.BASE_BODY + _SLOPE + k,), False, deviation, 1e-3, -0.6, 0.6)
        for k, (axis, deviation) in enumerate(zip("xy", deviations, strict=True))
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
    """What the robot states as uncertain, as logarithms of factors with its relative standard deviations.

    Parts of its drivetrain that may be nothing (a delay, a compliance) are changes in their units, within its bounds.
    """
    of_wheel = {"half_width": robot.wheels[0].half_width, "outer_radius": robot.wheels[0].major_radius}
    nominal = {name: of_wheel[name] if name in of_wheel else getattr(robot, name) for name in UNCERTAIN}
    body = tuple(
        _log(name, _ROBOT_ENTRIES[name], deviation / nominal[name], max(_LOG_LIMIT, 4.0 * deviation / nominal[name]))
        for name, deviation in robot.standard_deviations.items()
        if name in nominal and deviation > 0.0
    )
    return body + _drivetrain_parameters(robot)


_DRIVETRAIN_ENTRIES = {
    "command_delay": layout.COMMAND_DELAY,
    "command_deadband": layout.COMMAND_DEADBAND,
    "turning_limit": layout.TURNING_LIMIT,
    "mean_ramp": layout.MEAN_RAMP,
    "turning_ramp": layout.TURNING_RAMP,
    "command_ramp": layout.COMMAND_RAMP,
    "command_filter": layout.COMMAND_FILTER,
    **{name: layout.BASE_DRIVETRAIN + k for k, name in enumerate(layout.DRIVETRAIN_PARAMETERS)},
}
LIMITS = frozenset((
    "turning_limit", "mean_ramp", "turning_ramp", "command_ramp", "integral_limit", "acceleration_limit",
    "no_load_speed", "power_limit",
))  # fmt: skip
"""Fields of a drivetrain that no data sheet may state: a very large number stands for that."""


def drivetrain_of(robot: Robot, values: Mapping[str, float]) -> Drivetrain:
    """A robot's drivetrain with parameters of a fit at values, by name; those that are missing stay.

    Args:
        robot: nominal.
        values: logarithms of factors of limits, changes of the others.
    """
    own = robot.drivetrain
    found = {name: float(values[name]) for name in _DRIVETRAIN_ENTRIES if name in values}
    changed = {
        name: getattr(own, name) * math.exp(value) if name in LIMITS else getattr(own, name) + value
        for name, value in found.items()
    }
    return replace(own, **changed)


@cache
def added_numbers() -> frozenset[str]:
    """Names of pure numbers of robot and ground to which a fit adds its value, in place of a factor's logarithm."""
    ground = (*soil_parameters(), *slope_parameters((0.0, 0.0)))
    drivetrain = (item for item in fields(Drivetrain) if item.name in _DRIVETRAIN_ENTRIES and item.name not in LIMITS)
    return frozenset(
        [item.name for item in ground if item.unit == "-" and not item.factor]
        + [item.name for item in drivetrain if item.metadata["unit"] == "-"]
    )


_DRIVETRAIN_STEP = 0.02  # of the standard deviation, for finite differences (ours)

DELAY_STEP = 0.05
"""Step to both sides of the finite difference to a delay [s] (ours: a sample at 20 Hz). Commands are interpolated
between samples, where the derivative jumps: with a small step a fit ends at the nearest sample."""


def _drivetrain_parameters(robot: Robot) -> tuple[ModelParameter, ...]:
    """The same of its drivetrain: limits as factors, what may be nothing as a sum."""
    made = []
    for name, deviation in robot.standard_deviations.items():
        if name not in _DRIVETRAIN_ENTRIES or deviation <= 0.0:
            continue
        value, entry = getattr(robot.drivetrain, name), (_DRIVETRAIN_ENTRIES[name],)
        if name in LIMITS:
            # a limit that is not there must get beyond where it acts
            made.append(_log(name, entry, deviation / value, max(_LOG_LIMIT, 3.0 * deviation / value)))
            continue
        field = next(item for item in fields(Drivetrain) if item.name == name)
        low, high = field.metadata["low"] - value, field.metadata["high"] - value
        centred = name == "command_delay"
        step = DELAY_STEP if centred else _DRIVETRAIN_STEP * deviation
        unit = field.metadata["unit"]
        made.append(ModelParameter(name, unit, entry, False, deviation, step, low, high, centred=centred))
    return tuple(made)


def sensor_parameters(recordings: int, gyro_bias: float, accelerometer_bias: float) -> tuple[ModelParameter, ...]:
    """Biases of each recording, with their standard deviations [rad/s], [m/s^2]."""
    kinds = [
        ModelParameter("gyro_bias", "rad/s", (layout.GYRO_BIAS,), False, gyro_bias, 1e-4, -1.0, 1.0),
        *(
            ModelParameter(
                f"accelerometer_bias_{axis}", "m/s^2", (layout.ACCELEROMETER_BIAS + k,), False,
                accelerometer_bias, 1e-3, -5.0, 5.0,
            )
            for k, axis in enumerate("xy")
        ),
    ]  # fmt: skip
    return tuple(made for n in range(recordings) for kind in kinds for made in per_group(kind, {str(n + 1): (n,)}))


def heading_parameters(recordings: Sequence[int], deviation: float) -> tuple[ModelParameter, ...]:
    """Headings at which recordings without poses begin, with their standard deviation [rad]."""
    heading = ModelParameter("heading", "rad", (), False, deviation, 0.02, -1e3, 1e3, heading=True)
    return per_group(heading, {str(number + 1): (number,) for number in recordings})


def command_shift(period: float) -> ModelParameter:
    """Delay of the commands within the two samples by which loggers differ in what a row's command means."""
    return ModelParameter("command_shift", "s", (), False, period, 0.1 * period, 0.0, 2.0 * period, shift=True)


WHEEL_SPEED_LATENESS = 0.1
"""Standard deviation of the lateness of wheel speeds [s]: encoder messages come at a few hertz and are stamped on
arrival."""


def wheel_speed_shift(limit: float) -> ModelParameter:
    """Lateness of imposed wheel speeds behind the inertial sensors, as a delay (negative where they come late).

    Args:
        limit: largest size [s]; the windows must keep as much drive before and after them.
    """
    return ModelParameter("wheel_speed_shift", "s", (), False, WHEEL_SPEED_LATENESS, 0.005, -limit, limit, shift=True)
