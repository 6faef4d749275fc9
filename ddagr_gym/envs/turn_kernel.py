"""One control interval of the row turn, compiled: progress, reward terms, endings, observation.

Reward per step of length dt (every term is logged by name; weights in ``RewardWeights``)::

    progress      + distance gained along the path [m]
    cross_track   - |distance from the path| dt                      [m s]
    curvature     - |R* yaw_rate/speed - side| dt while turning, 2 at most   [s]
    action_rate   - |change of action|^2                             [-]
    slip_power    - sum |F_x (R0 omega - v_x)| + |F_y v_y| dt        [J]
    exit_error    - (|e_y| + L |sin e_psi|)/0.127 m, 10 at most, once at the next row's start line
    success       + 1 once, if that ratio is at most 1
    failure       - 1 once, if bogged or off the headland
    steering      - |R* path curvature - wanted| dt while moving, 2 at most  [s]; wanted is side on the half circle,
                  0 on the rows, less what leads back to the path: e/R* + 2 x course error (critically damped)

Terms use the true state: they are for training, never for a deployed controller.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.control.observation import SCALES
from ddagr_gym.control.row_turn import FURROW_SLACK
from ddagr_gym.envs.constants import HEADLAND_DEPTH, OBSERVATION_LIMIT, ROW_MARGIN
from ddagr_gym.jit import kernel
from ddagr_gym.physics.layout import (
    BOGGED,
    FORCE_X,
    FORCE_Y,
    HALF_WHEELBASE,
    SAMPLE_PERIOD,
    V_X,
    V_Y,
    WHEEL,
    WHEEL_OMEGA,
    WHEEL_V_X,
    WHEEL_V_Y,
    YAW_RATE,
)

Array = NDArray[np.float64]

TERMS = (
    "progress",
    "cross_track",
    "curvature",
    "action_rate",
    "slip_power",
    "exit_error",
    "success",
    "failure",
    "steering",
)
"""Reward terms, in the order of the weights."""

(
    RADIUS,
    SIGN,
    RUN_IN,
    RUN_OUT,
    SPEED,
    GYRO_HEADING,
    ODOMETER,
    DISTANCE,
    ACTION_RIGHT,
    ACTION_LEFT,
    LAST_X,
    LAST_Y,
    LAST_YAW,
    EXITED,
    EXIT_LATERAL,
    EXIT_HEADING,
    ENDING,
    SUCCESS,
    TIME,
    COURSE,
    TASK_SIZE,
) = range(21)
"""Entries of an environment's task vector."""

NO_ENDING, EXIT_REACHED, BOGGED_DOWN, LEFT_HEADLAND, TIME_OUT = range(5)
"""Numbered endings: 1 to 3 terminate, 4 truncates."""

CORRIDOR = 0.35
"""Beyond this distance from its row's line a robot between the rows stands on a bed [m] (ours)."""
HEADLAND_MARGIN = 1.5
"""Room beside the two rows [m] (ours)."""
_LARGEST_EXIT_RATIO = 10.0  # (ours) more than ten furrows off is no worse an exit, and the reward stays bounded
_LEAST_WAY = 0.02  # [s], a quarter of a step: below it the direction of travel means little


@kernel()
def path_distance(task: Array, x: float, y: float) -> tuple[float, float]:
    """Distance along the commanded path and distance from it [m], as ``RowTurn.project``."""
    radius = task[RADIUS]
    from_centre = task[SIGN] * y - radius
    if x >= 0.0:
        angle = math.atan2(x, -from_centre)
        return task[RUN_IN] + radius * angle, abs(math.hypot(x, from_centre) - radius)
    offset = abs(abs(from_centre) - radius)
    if from_centre > 0.0:
        return task[RUN_IN] + math.pi * radius - x, offset
    return task[RUN_IN] + x, offset


@kernel()
def _off_headland(task: Array, x: float, y: float) -> bool:
    side = task[SIGN] * y
    if x < -0.05:
        off_row = min(abs(side), abs(side - 2.0 * task[RADIUS])) > CORRIDOR
        return off_row or x < -max(task[RUN_IN], task[RUN_OUT]) - ROW_MARGIN
    return x > HEADLAND_DEPTH or side < -HEADLAND_MARGIN or side > 2.0 * task[RADIUS] + HEADLAND_MARGIN


@kernel()
def _cross_exit_line(task: Array, x: float, y: float, yaw: float) -> None:
    """Note lateral and heading error where the path crosses x = 0 into the next row (theory: control, metric 4)."""
    if task[LAST_X] >= 0.0 > x and task[SIGN] * y > task[RADIUS] and task[EXITED] == 0.0:
        part = task[LAST_X] / (task[LAST_X] - x)
        y = task[LAST_Y] + part * (y - task[LAST_Y])
        yaw = task[LAST_YAW] + part * (yaw - task[LAST_YAW])
        task[EXITED] = 1.0
        task[EXIT_LATERAL] = 2.0 * task[SIGN] * task[RADIUS] - y
        error = yaw - math.pi
        task[EXIT_HEADING] = error - 2.0 * math.pi * math.ceil(error / (2.0 * math.pi) - 0.5)


@kernel()
def _slip_power(row: Array) -> float:
    """Power lost in sliding [W]."""
    total = 0.0
    for i in range(4):
        rim = (row[WHEEL + i] + row[WHEEL + 8 + i]) * row[WHEEL_OMEGA + i]
        total += abs(row[FORCE_X + i] * (rim - row[WHEEL_V_X + i])) + abs(row[FORCE_Y + i] * row[WHEEL_V_Y + i])
    return total


@kernel()
def _follow(task: Array, readings: Array, record: Array, period: float) -> None:
    """Dead reckoning from gyro and encoders, and the exit line, sample by sample."""
    for k in range(readings.shape[0]):
        task[GYRO_HEADING] += readings[k, 2] * period
        task[ODOMETER] += 0.5 * (readings[k, 3] + readings[k, 4]) * period
        _cross_exit_line(task, record[k, 0], record[k, 1], record[k, 2])
        task[LAST_X] = record[k, 0]
        task[LAST_Y] = record[k, 1]
        task[LAST_YAW] = record[k, 2]


@kernel()
def _steering_error(task: Array, step_x: float, step_y: float, x: float, y: float) -> float:
    """R* times the curvature of the driven path less the wanted one; 0 where the robot hardly moves.

    The driven path's curvature is the change of course, that is the direction of travel, over the way.
    """
    radius, sign = task[RADIUS], task[SIGN]
    way = math.hypot(step_x, step_y)
    if way < _LEAST_WAY * task[SPEED]:
        return 0.0
    course = math.atan2(step_y, step_x)
    change = course - task[COURSE]
    change -= 2.0 * math.pi * math.ceil(change / (2.0 * math.pi) - 0.5)
    task[COURSE] += change
    turned = min(max((path_distance(task, x, y)[0] - task[RUN_IN]) / radius, 0.0), math.pi)
    from_centre = sign * y - radius
    inside = radius - (math.hypot(x, from_centre) if x >= 0.0 else abs(from_centre))
    # like the path, all for a turn to the left: positive error is to the left of the path
    error = sign * task[COURSE] - turned
    wanted = (1.0 if 0.0 < turned < math.pi else 0.0) - inside / radius - 2.0 * error
    return sign * radius * change / way - wanted


@kernel()
def _ending(task: Array, row: Array, x: float, y: float) -> float:
    for i in range(4):
        if row[BOGGED + i] > 0.0:
            return BOGGED_DOWN
    if task[EXITED] > 0.0 and x <= -task[RUN_OUT]:
        return EXIT_REACHED
    if _off_headland(task, x, y):
        return LEFT_HEADLAND
    return NO_ENDING


@kernel()
def _exit_ratio(task: Array, half_wheelbase: float) -> float:
    """Deviation at the exit line over what a furrow forgives, at most ``_LARGEST_EXIT_RATIO``; notes success."""
    deviation = abs(task[EXIT_LATERAL]) + half_wheelbase * abs(math.sin(task[EXIT_HEADING]))
    ratio = deviation / FURROW_SLACK
    forward = abs(task[EXIT_HEADING]) < 0.5 * math.pi
    task[SUCCESS] = 1.0 if ratio <= 1.0 and forward else 0.0
    return min(ratio if forward else _LARGEST_EXIT_RATIO, _LARGEST_EXIT_RATIO)


@kernel()
def observe(task: Array, readings: Array, outer_radius: float, observation: NDArray[np.float32]) -> None:
    """Write the scaled observation: means of the readings over the interval, and the task's reference."""
    values = np.zeros(len(SCALES))
    for k in range(readings.shape[0]):
        for j in range(5):
            values[j] += readings[k, j] / readings.shape[0]
    values[5] = task[ACTION_RIGHT]
    values[6] = task[ACTION_LEFT]
    values[7] = task[SIGN]
    values[8] = task[RADIUS]
    values[9] = task[SPEED]
    values[10] = math.pi - task[SIGN] * task[GYRO_HEADING]
    values[11] = max(task[RUN_IN] - outer_radius * task[ODOMETER], 0.0)
    for j in range(len(SCALES)):
        scaled = values[j] / SCALES[j]
        observation[j] = min(max(scaled, -OBSERVATION_LIMIT), OBSERVATION_LIMIT)


@kernel()
def judge(
    task: Array, row: Array, action: Array, readings: Array, record: Array, weights: Array, terms: Array
) -> float:
    """Reward of one control interval; updates the task vector.

    Args:
        task: (TASK_SIZE,) of one environment, updated.
        row: simulator row after the interval.
        action: (2,) right, left.
        readings: (samples, 8).
        record: (samples, 3) true x, y, yaw.
        weights: (terms,).
        terms: (terms,), written unweighted.

    Returns:
        The weighted sum of the terms.
    """
    period = row[SAMPLE_PERIOD]
    duration = period * readings.shape[0]
    was_exited = task[EXITED]
    step_x, step_y = -task[LAST_X], -task[LAST_Y]
    _follow(task, readings, record, period)
    task[TIME] += duration
    x, y = task[LAST_X], task[LAST_Y]
    distance, offset = path_distance(task, x, y)
    terms[0] = min(max(distance - task[DISTANCE], -1.0), 1.0)
    task[DISTANCE] = distance
    terms[1] = -offset * duration
    speed = math.hypot(row[V_X], row[V_Y])
    curvature = task[RADIUS] * row[YAW_RATE] / max(speed, 0.02)
    terms[2] = -min(abs(curvature - task[SIGN]), 2.0) * duration if x >= 0.0 else 0.0
    right, left = action[0] - task[ACTION_RIGHT], action[1] - task[ACTION_LEFT]
    terms[3] = -(right * right + left * left)
    task[ACTION_RIGHT], task[ACTION_LEFT] = action[0], action[1]
    terms[4] = -_slip_power(row) * duration
    terms[5], terms[6], terms[7] = 0.0, 0.0, 0.0
    if task[EXITED] > was_exited:
        terms[5] = -_exit_ratio(task, row[HALF_WHEELBASE])
        terms[6] = task[SUCCESS]
    task[ENDING] = _ending(task, row, x, y)
    if task[ENDING] == BOGGED_DOWN or task[ENDING] == LEFT_HEADLAND:
        terms[7] = -1.0
    terms[8] = -min(abs(_steering_error(task, step_x + x, step_y + y, x, y)), 2.0) * duration
    total = 0.0
    for j in range(terms.shape[0]):
        total += weights[j] * terms[j]
    return total


@kernel()
def judge_rows(
    tasks: Array, rows: Array, actions: Array, readings: Array, record: Array, weights: Array, outer_radius: Array,
    terms: Array, rewards: Array, observations: NDArray[np.float32],
) -> None:  # fmt: skip
    """:func:`judge` and :func:`observe` for all environments; leading dimension N on every array but ``weights``."""
    for n in range(tasks.shape[0]):
        rewards[n] = judge(tasks[n], rows[n], actions[n], readings[n], record[n], weights, terms[n])
        observe(tasks[n], readings[n], outer_radius[n], observations[n])


@kernel()
def observe_start(
    tasks: Array, chosen: NDArray[np.int64], outer_radius: Array, observations: NDArray[np.float32]
) -> None:
    """Observation of an environment that has just been reset: it stands still, and its readings are zero."""
    nothing = np.zeros((1, 5))
    for n in chosen:
        observe(tasks[n], nothing, outer_radius[n], observations[n])
