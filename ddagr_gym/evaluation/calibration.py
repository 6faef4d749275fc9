"""Bank speeds that make a commanded turn on a known soil: the calibration behind the constant-speed controllers."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ddagr_gym.control.constant_speeds import ConstantSpeeds
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Numerics, Robot, Soil
from ddagr_gym.physics import layout
from ddagr_gym.simulator import Simulator

_NEARLY_AT_REST = 0.05  # [rad/s] (ours): beyond the kink that the force has at rest
_SHARES = tuple(round(1.0 - 0.02 * k, 2) for k in range(26))
_SETTLING_SAMPLES = 500  # 4 s at 125 Hz: more than ten time constants of body and motors


def steady_motion(
    robot: Robot, soil: Soil, right: float, left: float, numerics: Numerics = Numerics()
) -> NDArray[np.float64]:
    """Steady (v_x, v_y, yaw_rate) [m/s, m/s, rad/s] of a robot at constant bank speeds [rad/s].

    Raises:
        InputError: the robot bogs down.
    """
    simulator = Simulator(1, numerics=numerics)
    simulator.configure(0, robot, soil)
    radius = robot.wheels[0].outer_radius
    guess = {
        "v_x": radius * (right + left) / 2,
        "yaw_rate": 0.6 * radius * (right - left) / (2 * robot.half_track),
        "omega_right": right,
        "omega_left": left,
    }
    simulator.reset(state=guess)
    simulator.step(np.array([[right, left]]), samples=_SETTLING_SAMPLES)
    if simulator.bogged[0]:
        raise InputError(f"robot {robot.name!r} bogs down on this soil at bank speeds {right:g}, {left:g} rad/s.")
    motion: NDArray[np.float64] = simulator.rows[0, layout.V_X : layout.V_X + 3].copy()
    return motion


def turning_speeds(robot: Robot, soil: Soil, speed: float, curvature: float) -> tuple[float, float]:
    """Right and left bank speeds [rad/s] at which the robot drives steadily at ``speed`` and ``curvature``.

    Args:
        robot: the robot.
        soil: the soil, known.
        speed: |(v_x, v_y)| [m/s].
        curvature: yaw rate over speed [1/m], counter-clockwise positive.

    Raises:
        InputError: no bank speeds within the robot's limit make it, or the robot bogs down.
    """
    radius, track, limit = robot.wheels[0].outer_radius, robot.half_track, robot.maximum_wheel_speed

    def mismatch(banks: NDArray[np.float64]) -> NDArray[np.float64]:
        v_x, v_y, rate = steady_motion(robot, soil, float(banks[0]), float(banks[1]))
        return np.array([(math.hypot(v_x, v_y) - speed) / speed, track * (rate / speed - curvature)])

    spread = 1.4 * track * curvature  # effective over geometric track in a turn is 1.3 to 1.85
    guess = np.clip(speed / radius * np.array([1 + spread, 1 - spread]), -0.99 * limit, 0.99 * limit)
    for start in _starts(guess):
        found = least_squares(mismatch, start, bounds=(-limit, limit), diff_step=1e-3, xtol=1e-8, ftol=1e-12)
        if np.abs(found.fun).max() <= 2e-3:
            return float(found.x[0]), float(found.x[1])
    raise InputError(
        f"no bank speeds within {limit:g} rad/s turn robot {robot.name!r} at {speed:g} m/s and radius "
        f"{1 / abs(curvature) if curvature else math.inf:g} m on this soil: choose a lower speed or a wider turn."
    )


def _starts(guess: NDArray[np.float64]) -> Iterator[NDArray[np.float64]]:
    """A guess, then others with the slower bank just before and after rest, where its force has a kink."""
    yield guess
    slower = int(np.argmin(np.abs(guess)))
    for speed in (_NEARLY_AT_REST, -_NEARLY_AT_REST):
        other = guess.copy()
        other[slower] = speed
        yield other


def fastest_turning_speeds(
    robot: Robot, soil: Soil, speed: float, curvature: float
) -> tuple[float, tuple[float, float]]:
    """Speed [m/s] and its :func:`turning_speeds`: ``speed``, or the fastest below it that the motors reach (ours).

    Speeds are tried down to half of it, each 2 % of it below the one before.

    Raises:
        InputError: as :func:`turning_speeds`, for half of the speed.
    """
    for share in _SHARES[:-1]:
        try:
            return share * speed, turning_speeds(robot, soil, share * speed, curvature)
        except InputError:
            continue
    return _SHARES[-1] * speed, turning_speeds(robot, soil, _SHARES[-1] * speed, curvature)


def calibrate_constant_speeds(robot: Robot, soil: Soil, turn: RowTurn) -> ConstantSpeeds:
    """B1 for a turn: straight and turning bank speeds that are right on ``soil``, lead for the motors' lag.

    A turn that is too fast for the motors is driven more slowly, at the commanded radius.

    Raises:
        InputError: as :func:`turning_speeds`, for half of the speed.
    """
    straight, _ = turning_speeds(robot, soil, turn.speed, 0.0)
    speed, (outer, inner) = fastest_turning_speeds(robot, soil, turn.speed, 1.0 / turn.radius)
    lead = speed / turn.radius / robot.motor_rate
    return ConstantSpeeds(straight, outer, inner, lead, robot.maximum_wheel_speed)
