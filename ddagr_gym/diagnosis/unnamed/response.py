"""What small forces, moments and command errors along a window would do to its readings, without a simulation each.

The model is linearised block by block: every block of every window is started anew from the predicted motion, once per
state and input. Chained, these small systems answer to any course of forces, the vehicle's own damping included, where
a residual acceleration times mass would miss whatever is balanced by slip.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.localisation.residual_wrench import HeldWrench
from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.identification.problem import Problem
from ddagr_gym.identification.window_model import STATE_ENTRIES, STATE_STEPS, pose_derivatives
from ddagr_gym.identification.windows import CHANNELS, STATE, WindowSet
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects import Effect

Array = NDArray[np.float64]

INPUTS = ("F_x", "F_y", "M_z", "command_right", "command_left")
"""Wrench on the body at its origin, in body axes, and changes of the bank speed commands."""

_WRENCH_STEP = 2.0  # [N, N m], ours: a fiftieth of the rolling resistance, far above the solver's tolerance
_COMMAND_STEP = 2e-3  # [rad/s], as the steps of the bank speeds
_TORQUES = tuple(layout.AXLE_TORQUE + wheel for wheel in range(4))
_BEYOND = 1.1  # ours


@dataclass(frozen=True, eq=False)
class Course:
    """Predicted motion and torques at the samples.

    Attributes:
        states: (W, T, 8) STATE after each sample.
        torques: (W, T, 2) soil's moment about the axles of each bank [N m].
    """

    states: Array
    torques: Array


@dataclass(frozen=True, eq=False)
class Response:
    """Blockwise linear model of W windows of B blocks about a prediction.

    Attributes:
        transition: (W, B, 8, 8) of STATE over a block.
        drive: (W, B, 8, 5) of STATE by INPUTS held over the block.
        output: (W, B, 8, 8) block means of the channels by STATE at the block's start.
        direct: (W, B, 8, 5) the same by INPUTS.
    """

    transition: Array
    drive: Array
    output: Array
    direct: Array

    def to(self, target: str, courses: Array) -> Array:
        """Block means of the channels, (W, B, 8, K), of an input that follows courses.

        Args:
            target: of INPUTS.
            courses: (W, B, K) of the input, in N, N m or rad/s.
        """
        k = INPUTS.index(target)
        count, blocks, number = courses.shape
        state = np.zeros((count, 8, number))
        result = np.empty((count, blocks, 8, number))
        for b in range(blocks):
            course = courses[:, b, None, :]
            result[:, b] = np.matmul(self.output[:, b], state) + self.direct[:, b, :, k, None] * course
            state = np.matmul(self.transition[:, b], state) + self.drive[:, b, :, k, None] * course
        return result


def course_of(problem: Problem, fitted: Fitted) -> Course:
    """Motion and torques that a fitted model predicts."""
    point = fitted.point
    _, record = problem.model.predict_recorded(point.values, point.states, (*STATE_ENTRIES, *_TORQUES), point.effects)
    torque = record[..., len(STATE_ENTRIES) :]
    banks = np.stack([torque[..., 0] + torque[..., 2], torque[..., 1] + torque[..., 3]], axis=2)
    return Course(record[..., : len(STATE_ENTRIES)], banks)


def linearise(problem: Problem, fitted: Fitted, course: Course) -> Response:
    """Blockwise linear model about a fitted model's prediction: eleven short simulations."""
    point = fitted.point
    pieces, starts = _pieces(problem, fitted, course)
    model = problem.model_of(pieces)

    def run(states: Array, effects: tuple[Effect, ...] = point.effects) -> tuple[Array, Array]:
        readings, record = model.predict_recorded(point.values, states, STATE_ENTRIES, effects)
        return readings, record[:, -1]

    base, end = run(starts)
    shape = problem.blocked.sigma.shape[:2]

    def mean(change: Array) -> Array:
        return problem.blocked.means_of_all(change.reshape(shape[0], -1, len(CHANNELS)))

    transition, output = np.zeros((*shape, 8, 8)), np.zeros((*shape, 8, 8))
    for k in range(3, len(STATE)):
        moved = starts.copy()
        moved[:, k] += STATE_STEPS[k]
        readings, after = run(moved)
        transition[..., k] = ((after - end) / STATE_STEPS[k]).reshape(*shape, 8)
        output[..., k] = mean((readings - base) / STATE_STEPS[k])
    by_pose = pose_derivatives(starts, base)
    for k in range(3):
        output[..., k] = mean(by_pose[..., k])
    _shift_pose(transition, end, starts)
    drive, direct = np.zeros((*shape, 8, 5)), np.zeros((*shape, 8, 5))
    for k, pushed in enumerate(np.eye(3) * _WRENCH_STEP):
        readings, after = run(starts, (*point.effects, HeldWrench(*pushed)))
        drive[..., k] = ((after - end) / _WRENCH_STEP).reshape(*shape, 8)
        direct[..., k] = mean((readings - base) / _WRENCH_STEP)
    for bank in range(2):
        commands = pieces.commands.copy()
        commands[:, pieces.history :, bank] += _COMMAND_STEP
        other = problem.model_of(replace(pieces, commands=commands))
        readings, record = other.predict_recorded(point.values, starts, STATE_ENTRIES, point.effects)
        drive[..., 3 + bank] = ((record[:, -1] - end) / _COMMAND_STEP).reshape(*shape, 8)
        direct[..., 3 + bank] = mean((readings - base) / _COMMAND_STEP)
    _mend(problem, (transition, drive, output, direct))
    return Response(transition, drive, output, direct)


def _mend(problem: Problem, parts: tuple[Array, Array, Array, Array]) -> None:
    """Blocks in which a push does more than to a free body take the system of the block before.

    They lie where a robot creeps to rest and the solver changes its step between two runs.
    """
    transition, drive, _, _ = parts
    robot, windows = problem.robot, problem.blocked.windows
    period = windows.period * problem.blocked.weights.shape[2]
    free = period / np.array([robot.mass, robot.mass, robot.yaw_inertia])
    moved = np.diagonal(drive[:, :, 3:6, :3], axis1=2, axis2=3)
    kept = np.diagonal(transition[:, :, 3:6, 3:6], axis1=2, axis2=3)
    bad = (np.abs(moved) > _BEYOND * free).any(axis=2) | (np.abs(kept) > _BEYOND).any(axis=2)
    for b in range(1, bad.shape[1]):
        for part in parts:
            part[bad[:, b], b] = part[bad[:, b], b - 1]


def _shift_pose(transition: Array, end: Array, starts: Array) -> None:
    """A shifted or turned start shifts and turns the end."""
    shape = transition.shape[:2]
    for k in range(3):
        transition[..., k, k] = 1.0
    transition[..., 0, 2] = -(end[:, 1] - starts[:, 1]).reshape(shape)
    transition[..., 1, 2] = (end[:, 0] - starts[:, 0]).reshape(shape)


def _pieces(problem: Problem, fitted: Fitted, course: Course) -> tuple[WindowSet, Array]:
    """Every block as a window of its own, and the states at which they start."""
    windows = problem.blocked.windows
    count, blocks, length, _ = problem.blocked.weights.shape
    rows = np.arange(blocks) * length
    before = np.concatenate([fitted.point.states[:, None], course.states[:, rows[1:] - 1]], axis=1)
    kept = windows.history + length
    commands = np.stack([windows.commands[:, row : row + kept] for row in rows], axis=1)

    def repeated(values: Array) -> Array:
        return np.repeat(values, blocks)

    starts = before.reshape(-1, len(STATE))
    return (
        WindowSet(
            windows.period,
            np.repeat(windows.recording, blocks),
            np.repeat(windows.start, blocks),
            repeated(windows.time) + np.tile(rows * windows.period, count),
            commands.reshape(count * blocks, kept, 2),
            windows.history,
            np.zeros((count * blocks, length, len(CHANNELS))),
            starts,
            unknown=np.maximum(np.repeat(windows.unknown, blocks) - np.tile(rows, count), 0),
        ),
        starts,
    )
