"""B5: model-predictive control on the control-affine model at the filter's estimate (theory: control, eq. (6))."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.control.observation import EKF_FEATURES, FEATURE_SCALES, OBSERVATION, TurnObservation, decode
from ddagr_gym.control.predictive_model import (
    INPUT_SIZE,
    STATE_SIZE,
    PredictiveModel,
    import_casadi,
    linearised_transition,
)
from ddagr_gym.control.turn_controller import commanded_turn
from ddagr_gym.errors import InputError
from ddagr_gym.validated import Validated, bounded

Array = NDArray[np.float64]

_FIRST_ITERATIONS = 4
"""Gauss-Newton iterations at the first plan of an episode; later plans start from the last one and take one."""

_ERROR_ENTRIES = (5, 6, 0)
"""State entries whose squares are weighted: lateral error, heading error, speed."""


@dataclass(frozen=True)
class PredictiveSettings(Validated):
    """Horizon and weights of the plan.

    Attributes:
        horizon: control periods that are planned.
        lateral: weight of the squared lateral error.
        heading: of the squared heading error.
        speed: of the squared error of the speed.
        change: of the squared change of a command between periods.
        offset_rate: share of the last prediction's error that goes into its offset at each period.
    """

    horizon: int = bounded("-", 2, 100, default=20)
    lateral: float = bounded("1/m^2", 0.0, 1e6, default=20.0)
    heading: float = bounded("-", 0.0, 1e6, default=2.0)
    speed: float = bounded("s^2/m^2", 0.0, 1e6, default=5.0)
    change: float = bounded("s^2", 0.0, 1e6, default=0.05, open_low=True)
    offset_rate: float = bounded("-", 0.0, 1.0, default=0.1)


class DeadReckoning:
    """Pose from the filter's speed and the integrated gyro, from the start of the run-in.

    Attributes:
        turn: the commanded manoeuvre.
        x, y: position in the frame of :mod:`ddagr_gym.control.row_turn` [m].
    """

    def __init__(self, seen: TurnObservation) -> None:
        self.turn = commanded_turn(seen)
        self.x, self.y = -self.turn.run_in, 0.0
        self._heading = 0.0

    def advance(self, speed: float, heading: float, period: float) -> None:
        """Move for one period at ``speed`` [m/s]; ``heading`` [rad] is the one at its end."""
        middle = 0.5 * (heading + self._heading)
        self.x += speed * period * math.cos(middle)
        self.y += speed * period * math.sin(middle)
        self._heading = heading

    def errors(self) -> tuple[float, float, float]:
        """Distance along the path [m], lateral error [m], heading error [rad]."""
        distance, lateral = self.turn.project(self.x, self.y)
        return float(distance), float(lateral), self._heading - float(self.turn.heading(distance))


class ModelPredictive:
    """Controller ``(observation, info) -> action`` that plans bank speeds over a horizon; needs the filter's features.

    Direct multiple shooting with the transition of :mod:`ddagr_gym.control.predictive_model`; one Gauss-Newton step a
    period from the shifted last plan (real-time iteration: Diehl, Bock, Schloeder, SIAM J. Control Optim. 43 (2005)
    1714), condensed to a quadratic program in the commands within the robot's limits, which DAQP solves (Arnstroem,
    Bemporad, Axehill, IEEE Trans. Autom. Control 67 (2022) 4362). What the last prediction of speed and yaw rate missed
    is carried as an offset (offset-free control: Pannocchia and Rawlings, AIChE Journal 49 (2003) 426). Where the
    solver fails, the last plan goes on, and is counted.

    Args:
        model: of the prediction.
        prior: (4,) logs of a1, a2, b, Rc that the filter's features count from.
        settings: horizon and weights.

    Attributes:
        solve_times: of this episode's plans [s].
        failed_solves: plans of this episode that the solver did not make.

    Raises:
        InputError: casadi is not installed, or has no solver for the quadratic program.
    """

    def __init__(
        self, model: PredictiveModel, prior: ArrayLike, settings: PredictiveSettings = PredictiveSettings()
    ) -> None:
        ca = import_casadi()
        self._model, self._settings = model, settings
        self._prior = np.asarray(prior, dtype=float)
        steps, size = settings.horizon, INPUT_SIZE * settings.horizon
        self._linearise = linearised_transition(ca, model).map(steps)
        problem = {"h": ca.Sparsity.dense(size, size), "a": ca.Sparsity(0, size)}
        if not ca.has_conic("daqp"):
            raise InputError(f"casadi {ca.__version__} has no DAQP: install casadi 3.7 or newer.")
        self._program = ca.conic("plan", "daqp", problem, {"error_on_fail": False})
        self._weights = np.sqrt([settings.lateral, settings.heading, settings.speed])
        self._difference = np.eye(size) - np.eye(size, k=-INPUT_SIZE)
        self.reset()

    def reset(self) -> None:
        """Forget the plan and where the robot is."""
        self._place: DeadReckoning | None = None
        self._expected: Array | None = None
        self._offset = np.zeros(2)
        self._lateral_velocity = 0.0
        self.solve_times: list[float] = []
        self.failed_solves = 0

    def __call__(self, observation: ArrayLike, info: Any = None) -> NDArray[np.float32]:
        """Action (2,), right and left bank speed over the robot's maximum."""
        values = np.asarray(observation, dtype=float)
        if values.shape != (len(OBSERVATION) + len(EKF_FEATURES),):
            raise InputError(f"observation has shape {values.shape}: this controller needs DDAGR-Turn-EKF-v0.")
        seen, features = decode(values), values[len(OBSERVATION) :] * FEATURE_SCALES
        state, distance = self._locate(seen, features)
        start = time.perf_counter()
        command = self._plan(seen, state, self._stages(seen, features, distance))
        self.solve_times.append(time.perf_counter() - start)
        return np.clip(command / self._model.robot.maximum_wheel_speed, -1.0, 1.0).astype(np.float32)

    def _locate(self, seen: TurnObservation, features: Array) -> tuple[Array, float]:
        """State of the model (7,), and distance along the path [m]."""
        heading = seen.side * (math.pi - seen.heading_to_go)
        speed, rate = float(features[0]), float(features[1])
        if self._place is None:
            self._place = DeadReckoning(seen)
        else:
            self._place.advance(speed, heading, self._model.period)
        if self._expected is not None:
            missed = np.array([speed, rate]) - self._expected[[0, 2]]
            self._offset += self._settings.offset_rate * (missed - self._offset)
            self._lateral_velocity = float(self._expected[1])
        distance, lateral, heading_error = self._place.errors()
        banks = (seen.encoder_right, seen.encoder_left)
        return np.array([speed, self._lateral_velocity, rate, *banks, lateral, heading_error]), distance

    def _stages(self, seen: TurnObservation, features: Array, distance: float) -> Array:
        """Parameters of the transition for each period of the horizon (7, horizon)."""
        assert self._place is not None
        ahead = (np.arange(self._settings.horizon) + 0.5) * self._model.period * seen.target_speed
        stages = np.empty((7, self._settings.horizon))
        stages[:4] = np.exp(self._prior + features[2:6])[:, None]
        stages[4] = self._place.turn.curvature(distance + ahead)
        stages[5:] = self._offset[:, None]
        return stages

    def _plan(self, seen: TurnObservation, state: Array, stages: Array) -> Array:
        """Command (2,) of the first period [rad/s]."""
        last = np.array([seen.last_action_right, seen.last_action_left]) * self._model.robot.maximum_wheel_speed
        iterations = 1
        if self._expected is None:
            self._states = np.repeat(state[:, None], self._settings.horizon + 1, axis=1)
            self._commands = self._first_commands(seen, stages)
            iterations = _FIRST_ITERATIONS
        else:
            self._states = np.column_stack([self._states[:, 1:], self._states[:, -1]])
            self._commands = np.column_stack([self._commands[:, 1:], self._commands[:, -1]])
        for _ in range(iterations):
            self._improve(state, stages, last, seen.target_speed)
        self._expected = self._states[:, 1].copy()
        command: Array = self._commands[:, 0].copy()
        return command

    def _first_commands(self, seen: TurnObservation, stages: Array) -> Array:
        """Bank speeds without slip (2, horizon), the guess of the first plan."""
        spread = self._model.robot.half_track * stages[4]
        return seen.target_speed / self._model.outer_radius * np.stack([1.0 + spread, 1.0 - spread])

    def _improve(self, state: Array, stages: Array, last: Array, target_speed: float) -> None:
        """One Gauss-Newton step of the plan from ``state``."""
        after, by_state, by_input = (np.array(v) for v in self._linearise(self._states[:, :-1], self._commands, stages))
        free, sensitivity = self._condense(state, after, by_state, by_input)
        error = free.copy()
        error[:, 2] += self._offset[0] - target_speed
        matrix = (self._weights[:, None] * sensitivity).reshape(-1, sensitivity.shape[-1])
        residual = (self._weights * error).ravel()
        commands = self._commands.T.ravel()
        change = self._difference @ commands
        change[:INPUT_SIZE] -= last
        hessian = matrix.T @ matrix + self._settings.change * self._difference.T @ self._difference
        gradient = matrix.T @ residual + self._settings.change * self._difference.T @ change
        limit = self._model.robot.maximum_wheel_speed
        found = self._program(h=hessian, g=gradient, lbx=-limit - commands, ubx=limit - commands)
        step = np.array(found["x"]).ravel()
        if not self._program.stats()["success"] or not np.isfinite(step).all():
            self.failed_solves += 1
            return
        self._states = self._moved(state, after, by_state, by_input, step)
        self._commands = (commands + step).reshape(-1, INPUT_SIZE).T

    def _moved(self, state: Array, after: Array, by_state: Array, by_input: Array, step: Array) -> Array:
        """Nodes (7, horizon + 1) of the linearised plan after a step of the commands."""
        nodes = np.empty_like(self._states)
        nodes[:, 0] = state
        for k in range(self._settings.horizon):
            columns, inputs = slice(STATE_SIZE * k, STATE_SIZE * (k + 1)), slice(INPUT_SIZE * k, INPUT_SIZE * (k + 1))
            moved = by_state[:, columns] @ (nodes[:, k] - self._states[:, k]) + by_input[:, inputs] @ step[inputs]
            nodes[:, k + 1] = after[:, k] + moved
        return nodes

    def _condense(self, state: Array, after: Array, by_state: Array, by_input: Array) -> tuple[Array, Array]:
        """Weighted entries along the horizon without a step (N, 3), and derivatives by all commands (N, 3, 2 N)."""
        steps = self._settings.horizon
        free, sensitivity = np.empty((steps, 3)), np.empty((steps, 3, INPUT_SIZE * steps))
        deviation = state - self._states[:, 0]
        chain = np.zeros((STATE_SIZE, INPUT_SIZE * steps))
        for k in range(steps):
            columns, inputs = slice(STATE_SIZE * k, STATE_SIZE * (k + 1)), slice(INPUT_SIZE * k, INPUT_SIZE * (k + 1))
            chain = by_state[:, columns] @ chain
            chain[:, inputs] += by_input[:, inputs]
            node = after[:, k] + by_state[:, columns] @ deviation
            deviation = node - self._states[:, k + 1]
            free[k], sensitivity[k] = node[list(_ERROR_ENTRIES)], chain[list(_ERROR_ENTRIES)]
        return free, sensitivity
