"""The fit problem of a diagnosis: block means of windows, nuisances, and whatever effects are assumed.

Unknowns of every window (initial state and local variations, all with priors) are eliminated linearly by a QR
factorisation, so that a sensitivity that they could explain counts for nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.block_means import BlockedWindows
from ddagr_gym.identification.fit_numerics import block_mean_numerics
from ddagr_gym.identification.headings import headings_matter, turned_starts
from ddagr_gym.identification.nuisances import SHIFT_AS_EFFECT, NuisancePriors, Nuisances
from ddagr_gym.identification.window_fit import STATE_PRIOR
from ddagr_gym.identification.window_model import WindowModel
from ddagr_gym.identification.windows import CHANNELS, WindowSet
from ddagr_gym.parameters import Numerics, Robot, Soil
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects import Effect

Array = NDArray[np.float64]
Chosen = NDArray[np.bool_]

_BIAS_CHANNEL = {
    layout.ACCELEROMETER_BIAS: CHANNELS.index("specific_force_x"),
    layout.ACCELEROMETER_BIAS + 1: CHANNELS.index("specific_force_y"),
    layout.GYRO_BIAS: CHANNELS.index("yaw_rate"),
}
"""Entries that add to one channel, whose derivative needs no simulation."""


@dataclass(frozen=True, eq=False)
class Point:
    """Where a model stands.

    Attributes:
        values: (P,) nuisance parameters.
        states: (W, 8) initial states.
        effects: assumed missing physics.
    """

    values: Array
    states: Array
    effects: tuple[Effect, ...] = ()


@dataclass(frozen=True, eq=False)
class Elimination:
    """Orthonormal basis of what the unknowns of each window explain.

    Attributes:
        basis: (W, M + S, S).
        upper: (W, S, S) triangular factor.
    """

    basis: Array
    upper: Array

    def project(self, columns: Array) -> Array:
        """Columns (W, M + S, K) without what the basis explains."""
        return np.asarray(columns - np.matmul(self.basis, np.matmul(self.basis.transpose(0, 2, 1), columns)))

    def explain(self, columns: Array) -> Array:
        """(W, S, K) changes of the unknowns that explain columns (W, M + S, K) best."""
        return np.asarray(
            np.linalg.solve(self.upper, np.matmul(self.basis.transpose(0, 2, 1), columns)), dtype=np.float64
        )

    def subset(self, chosen: NDArray[np.int64] | Chosen) -> Elimination:
        """Only the chosen windows."""
        return Elimination(self.basis[chosen], self.upper[chosen])


class Problem:
    """Windows, model and nuisances of a diagnosis.

    Args:
        robot: nominal robot.
        soil: nominal soil.
        blocked: windows with their noise.
        nuisances: what is uncertain.
        priors: their standard deviations, for the local variations of the sensors.
        threads: of the simulator.
        numerics: of the simulator.
    """

    def __init__(
        self,
        robot: Robot,
        soil: Soil,
        blocked: BlockedWindows,
        nuisances: Nuisances,
        priors: NuisancePriors | None = None,
        *,
        threads: int = 1,
        numerics: Numerics | None = None,
    ) -> None:
        self.blocked = blocked
        self.nuisances = nuisances
        self.priors = NuisancePriors() if priors is None else priors
        self._setting = (robot, soil, threads, block_mean_numerics() if numerics is None else numerics)
        windows = blocked.windows
        self.model = self.model_of(windows)
        self.prior = np.array([p.prior for p in nuisances.parameters])
        self._headings = [k for k, parameter in enumerate(nuisances.parameters) if parameter.heading]
        self.low = np.array([p.low for p in nuisances.parameters])
        self.high = np.array([p.high for p in nuisances.parameters])

    def subset(self, chosen: NDArray[np.int64] | Chosen) -> Problem:
        """The same problem on some of the windows."""
        return self.on(self.blocked.subset(chosen))

    def with_held_headings(self) -> Problem:
        """The same problem whose headings stay where they are."""
        held = self.on(self.blocked)
        held.prior[self._headings] = 0.0
        return held

    def on(self, blocked: BlockedWindows) -> Problem:
        """The same problem on other windows of the same recordings."""
        robot, soil, threads, numerics = self._setting
        return Problem(robot, soil, blocked, self.nuisances, self.priors, threads=threads, numerics=numerics)

    def model_of(self, windows: WindowSet) -> WindowModel:
        """The same model over other windows of the same recordings."""
        robot, soil, threads, numerics = self._setting
        return WindowModel(robot, soil, windows, self.nuisances.parameters, numerics=numerics, threads=threads)

    @property
    def robot(self) -> Robot:
        """The nominal robot."""
        return self._setting[0]

    @property
    def covered(self) -> float:
        """Length of all windows together [s]."""
        windows = self.blocked.windows
        return windows.count * windows.duration

    @property
    def free(self) -> Chosen:
        """(P,) global parameters that a fit moves."""
        return np.asarray(self.prior > 0.0)

    def open_at(self, point: Point) -> NDArray[np.int64]:
        """Global parameters that may still move: those held at a bound explain nothing more.

        The shift of the commands, which a delay takes over, stands for that delay.
        """
        held = (point.values <= self.low + 1e-9) | (point.values >= self.high - 1e-9)
        if any(effect.name == SHIFT_AS_EFFECT for effect in point.effects):
            held &= ~np.array([parameter.shift for parameter in self.nuisances.parameters])
        return np.flatnonzero(self.free & ~held)

    def start(self, effects: Sequence[Effect] = ()) -> Point:
        """The nominal model at the windows' first guess."""
        return Point(np.zeros(len(self.prior)), self.blocked.windows.initial.copy(), tuple(effects))

    def starts(self, values: Array) -> Array:
        """(W, 8) first guess of the states, turned with the headings of recordings without poses."""
        return turned_starts(self.blocked.windows, self.nuisances.parameters, values)

    def moved(self, point: Point, values: Array) -> Point:
        """A point at other values; states turn with the headings."""
        return replace(point, values=values, states=point.states + self.starts(values) - self.starts(point.values))

    def predict(self, point: Point) -> Array:
        """(W, T, 8)."""
        return self.model.predict(point.values, point.states, point.effects)

    def residual(self, point: Point, prediction: Array) -> Array:
        """Weighted block residuals with the states' prior below, (W, M + S)."""
        offset = np.zeros((self.blocked.windows.count, len(self._unknown_priors)))
        offset[:, : len(STATE_PRIOR)] = (self.starts(point.values) - point.states) / STATE_PRIOR
        return np.concatenate([self.blocked.residual(prediction), offset], axis=1)

    @property
    def _unknown_priors(self) -> Array:
        """(S,) of the states, the local parameters and the local sensor biases."""
        sensors = [self.priors.local_accelerometer, self.priors.local_accelerometer, self.priors.local_gyro]
        return np.array([*STATE_PRIOR, *(deviation for _, deviation in self.nuisances.local), *sensors])

    def padded(self, columns: Array) -> Array:
        """Columns (W, M, K) with the rows of the unknowns' priors below, (W, M + S, K)."""
        rows = np.zeros((columns.shape[0], len(self._unknown_priors), columns.shape[2]))
        return np.concatenate([columns, rows], axis=1)

    def parameter_columns(self, point: Point, base: Array) -> Array:
        """Weighted sensitivity to every nuisance parameter, (W, M, P)."""
        columns = []
        for k, parameter in enumerate(self.nuisances.parameters):
            if parameter.heading:
                columns.append(np.zeros(self.blocked.mask.shape))
                continue
            channel = _BIAS_CHANNEL.get(parameter.entries[0]) if len(parameter.entries) == 1 else None
            if channel is not None and not parameter.factor:
                columns.append(self._bias_column(channel, parameter.recording))
                continue
            step = parameter.step if point.values[k] + parameter.step <= max(parameter.high, 0.03) else -parameter.step
            moved = point.values.copy()
            moved[k] += step
            columns.append(self.blocked.change(self.predict(replace(point, values=moved)), base) / step)
        return self.heading_columns(point, base, np.stack(columns, axis=2))

    def heading_columns(self, point: Point, base: Array, by_parameter: Array) -> Array:
        """Sensitivities (W, M, P) with those to the headings as they are with the effects of a point.

        One simulation serves all headings: every window belongs to one recording.
        """
        own = self._headings
        if not own:
            return by_parameter
        found = by_parameter.copy()
        found[..., own] = 0.0
        if not headings_matter(point.effects):
            return found
        step = self.nuisances.parameters[own[0]].step
        values = point.values.copy()
        values[own] += step
        change = self.blocked.change(self.predict(self.moved(point, values)), base) / step
        for k in own:
            chosen = self.blocked.windows.recording == self.nuisances.parameters[k].recording
            found[..., k] = np.where(chosen[:, None], change, 0.0)
        return found

    def _bias_column(self, channel: int, recording: int | None) -> Array:
        windows = self.blocked.windows
        ones = np.zeros(windows.measured.shape)
        chosen = slice(None) if recording is None else windows.recording == recording
        ones[chosen, :, channel] = 1.0
        return self.blocked.means(ones)

    def eliminate(self, point: Point, base: Array, by_parameter: Array) -> Elimination:
        """Basis of the unknowns of each window at a point (theory: identification, eq. (7))."""
        changes = self.model.state_derivatives(point.values, point.states, base, point.effects)
        by_state = np.nan_to_num(self.blocked.means(changes))
        local = by_parameter[..., [index for index, _ in self.nuisances.local]]
        sensors = np.stack([self._bias_column(channel, None) for channel in range(3)], axis=2)
        columns = np.concatenate([by_state, local, sensors], axis=2)
        rows = np.broadcast_to(
            np.diag(1.0 / self._unknown_priors), (columns.shape[0], columns.shape[2], columns.shape[2])
        )
        basis, upper = np.linalg.qr(np.concatenate([columns * self.blocked.mask[..., None], rows], axis=1))
        return Elimination(basis, upper)
