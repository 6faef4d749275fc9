"""What a drive costs (theory: control, metric 5): headland, slip energy, restless wheels, stalls. Pure functions."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.frames import body_to_world
from ddagr_gym.parameters import Robot

Array = NDArray[np.float64]

STALL_FRACTION = 0.1
"""Speed over expected speed below which something counts as stalled [-] (ours)."""

STALL_DURATION = 0.5
"""Shortest stall that is counted [s] (ours)."""

WHEEL_FORCES = ("force_x", "force_y", "yaw_moment", "axle_torque")
"""What the soil does to a wheel; truth columns are ``true_<name>_1`` to ``4``."""


def finite_series(**values: ArrayLike) -> tuple[Array, ...]:
    """Finite float arrays (T,) of one length, or an InputError that names the first at fault."""
    arrays = {name: np.asarray(value, dtype=float) for name, value in values.items()}
    length = next(iter(arrays.values())).shape
    for name, array in arrays.items():
        if array.ndim != 1 or array.shape != length or not array.size:
            raise InputError(f"{name} has shape {array.shape}: give one-dimensional series of one length.")
        if not np.isfinite(array).all():
            index = int(np.argmin(np.isfinite(array)))
            raise InputError(f"{name}[{index}] is {array[index]}: metrics need the true motion at every sample.")
    return tuple(arrays.values())


def headland_depth(x: ArrayLike, y: ArrayLike, yaw: ArrayLike, robot: Robot) -> float:
    """Farthest that a corner of a tyre's outline reached beyond the headland boundary [m], at least 0."""
    x, y, yaw = finite_series(x=x, y=y, yaw=yaw)
    corners = [
        (hub_x + along * wheel.outer_radius, hub_y + across * wheel.half_width)
        for hub_x, hub_y, wheel in zip(robot.wheel_x, robot.wheel_y, robot.wheels, strict=True)
        for along in (1, -1)
        for across in (1, -1)
    ]
    return max(0.0, float(body_to_world(corners, x, y, yaw)[..., 0].max()))


def wheel_quantities(columns: Mapping[str, ArrayLike], robot: Robot) -> dict[str, Array] | None:
    """What :func:`slip_energy` needs, each (T, 4), from the truth columns of a simulated drive.

    Hub velocities follow from the body's (theory: wheel model, eq. (1)), wheel speeds are their banks'.

    Args:
        columns: ``true_v_x``, ``true_v_y``, ``true_yaw_rate``, ``true_omega_right``, ``true_omega_left`` and the
            :data:`WHEEL_FORCES` of the four wheels.
        robot: for its wheel positions.

    Returns:
        The quantities by name, or None where the columns hold no wheel forces.
    """
    wheels = range(1, 5)
    if any(f"true_{name}_{wheel}" not in columns for name in WHEEL_FORCES for wheel in wheels):
        return None
    forces = {name: np.column_stack([columns[f"true_{name}_{wheel}"] for wheel in wheels]) for name in WHEEL_FORCES}
    body = {name: np.asarray(columns[f"true_{name}"], dtype=float)[:, None] for name in ("v_x", "v_y", "yaw_rate")}
    banks = (columns["true_omega_right"], columns["true_omega_left"])
    return forces | {
        "v_x": body["v_x"] - body["yaw_rate"] * np.array(robot.wheel_y),
        "v_y": body["v_y"] + body["yaw_rate"] * np.array(robot.wheel_x),
        "yaw_rate": np.repeat(body["yaw_rate"], 4, axis=1),
        "omega": np.column_stack(banks + banks),
    }


def slip_energy(t: ArrayLike, columns: Mapping[str, ArrayLike]) -> float:
    """Work lost between wheels and soil [J]: integral of -(F_x v_x + F_y v_y + M_z yaw rate + T omega), four wheels.

    That power is never negative (passivity; theory: wheel model, eq. (38)). Trapezoidal rule.

    Args:
        t: time (T,) [s].
        columns: wheel quantities, each (T, 4): force_x, force_y [N], yaw_moment, axle_torque [N m] of the soil
            on the wheel, v_x, v_y [m/s] of the hub, yaw_rate, omega [rad/s].

    Raises:
        InputError: a quantity is missing.
    """
    pairs = (("force_x", "v_x"), ("force_y", "v_y"), ("yaw_moment", "yaw_rate"), ("axle_torque", "omega"))
    missing = [name for pair in pairs for name in pair if name not in columns]
    if missing:
        raise InputError(f"wheel quantity {missing[0]!r} is missing: slip energy needs all of {pairs}.")
    power = sum(np.asarray(columns[a], dtype=float) * np.asarray(columns[b], dtype=float) for a, b in pairs)
    return float(-np.trapezoid(np.sum(power, axis=-1), np.asarray(t, dtype=float)))


def wheel_speed_variation(t: ArrayLike, omega_right: ArrayLike, omega_left: ArrayLike) -> float:
    """Total variation of the bank speeds over the duration, both banks added [rad/s^2]."""
    t, right, left = finite_series(t=t, omega_right=omega_right, omega_left=omega_left)
    variation = np.abs(np.diff(right)).sum() + np.abs(np.diff(left)).sum()
    return float(variation / (t[-1] - t[0])) if len(t) > 1 else 0.0


def count_stalls(
    t: ArrayLike, expected: ArrayLike, actual: ArrayLike, minimum_expected: float, duration: float = STALL_DURATION
) -> int:
    """Intervals of at least ``duration`` [s] in which a speed stayed below a tenth of the expected one.

    Args:
        t: time (T,) [s].
        expected: speed asked for (T,), either sign.
        actual: speed reached (T,).
        minimum_expected: absolute expected speed from which a sample can count.
        duration: shortest interval counted [s].
    """
    t, expected, actual = finite_series(t=t, expected=expected, actual=actual)
    along = actual * np.sign(expected)
    stalled = (np.abs(expected) >= minimum_expected) & (along < STALL_FRACTION * np.abs(expected))
    edges = np.diff(np.concatenate([[False], stalled, [False]]).astype(int))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
    return int(np.count_nonzero(t[ends] - t[starts] >= duration))


def count_robot_stalls(t: ArrayLike, columns: Mapping[str, ArrayLike], robot: Robot) -> int:
    """Times the faster bank's tread ran above 0.05 m/s (ours) and the robot's footprint moved at under a tenth of it.

    The footprint's speed adds the turning of the wheels about the centre, so that turning on the spot is motion.
    """
    rate = np.maximum(np.abs(columns["true_omega_right"]), np.abs(columns["true_omega_left"]))
    tread = rate * max(wheel.outer_radius for wheel in robot.wheels)
    turning = np.asarray(columns["true_yaw_rate"], dtype=float) * robot.half_track
    moved = np.sqrt(np.square(columns["true_v_x"]) + np.square(columns["true_v_y"]) + np.square(turning))
    return count_stalls(t, tread, moved, minimum_expected=0.05)
