"""What a fit minimises: weighted residuals of windows, nuisances with priors, and whatever effects are assumed.

Local unknowns of every window (initial state and local variations, all with priors) are eliminated linearly by a QR
factorisation, so that a sensitivity that they could explain counts for nothing. This module says what residuals and
sensitivities are; :mod:`~ddagr_gym.identification.least_squares` has the algebra,
:mod:`~ddagr_gym.identification.gauss_newton` the iteration.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.block_means import BlockedWindows
from ddagr_gym.identification.fit_numerics import block_mean_numerics
from ddagr_gym.identification.headings import headings_matter, turned_starts
from ddagr_gym.identification.least_squares import Elimination, huber_loss, huber_roots
from ddagr_gym.identification.motor_currents import CurrentModel
from ddagr_gym.identification.nuisances import SHIFT_AS_EFFECT, Nuisances
from ddagr_gym.identification.parameters import disjoint_scopes
from ddagr_gym.identification.reading_effects import bias_change
from ddagr_gym.identification.side_by_side import side_by_side
from ddagr_gym.identification.spells import Spell
from ddagr_gym.identification.window_model import Reference, WindowModel
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


_AT_BOUND = 1e-3
"""Share of its range from which a parameter counts as held at a bound (ours): damped steps come close, no more."""

_NEAR_BOUND = 0.03
"""An upper bound below this (that of the commands' shift [s], two samples) is no limit to finite differences: it says
what is believed, not what can be simulated."""

STATE_PRIOR = np.array([1e3, 1e3, 1e2, 0.5, 0.2, 0.5, 1.0, 1.0])
"""Standard deviations of the first guess of STATE [m, m, rad, m/s, m/s, rad/s, rad/s, rad/s]: wide for the pose, loose
for the motion (ours)."""


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


def _beside(point: Point, chosen: Sequence[int], steps: Array | float) -> Point:
    """A point with some parameters beside it."""
    values = point.values.copy()
    values[chosen] += steps
    return replace(point, values=values)


class Problem:
    """What a fit minimises: windows, model, nuisances, and how residuals count.

    Args:
        robot: nominal robot.
        soil: nominal soil.
        blocked: windows with their noise.
        nuisances: what is uncertain.
        imposed: whether the windows' commands are recorded wheel speeds, see :class:`WindowModel`.
        known: missing physics that is taken as it is, beside the effects of a :class:`Point`, which a fit moves.
        robust: (8,) size of a weighted residual of each channel from which the loss is linear; None for squares.
        delay: by which the commands act late besides the shift parameters [s].
        threads: of the simulator.
        numerics: of the simulator.
        slopes: of the simulator where it only serves sensitivities; the same by default.
        currents: how motor currents follow, where the windows compare them.
    """

    def __init__(
        self,
        robot: Robot,
        soil: Soil,
        blocked: BlockedWindows,
        nuisances: Nuisances,
        *,
        imposed: bool = False,
        known: Sequence[Effect] = (),
        robust: Array | None = None,
        delay: float = 0.0,
        threads: int = 1,
        numerics: Numerics | None = None,
        slopes: Numerics | None = None,
        currents: CurrentModel | None = None,
    ) -> None:
        self.robot = robot
        self.blocked = blocked
        self.nuisances = nuisances
        model = partial(
            WindowModel, robot, soil, blocked.windows, nuisances.parameters, imposed=imposed, threads=threads,
            delay=delay, currents=currents, known=known,
        )  # fmt: skip
        self.model = model(numerics=block_mean_numerics() if numerics is None else numerics)
        self._slopes = None if slopes is None else model(numerics=slopes)
        self.prior = np.array([p.prior for p in nuisances.parameters])
        self.low = np.array([p.low for p in nuisances.parameters])
        self.high = np.array([p.high for p in nuisances.parameters])
        self.local_prior = np.array([*STATE_PRIOR, *(unknown.deviation for unknown in nuisances.local)])
        self._robust = robust

    def subset(self, chosen: NDArray[np.int64] | Chosen) -> Problem:
        """The same problem on some of the windows."""
        return self.on(self.blocked.subset(chosen))

    def with_held_headings(self) -> Problem:
        """The same problem whose headings stay where they are."""
        return self.holding(np.array([p.heading for p in self.nuisances.parameters]))

    def holding(self, chosen: Chosen) -> Problem:
        """The same problem whose chosen parameters (P,) stay where they are."""
        held = copy(self)
        held.prior = np.where(chosen, 0.0, self.prior)
        return held

    def expecting(self, priors: Mapping[str, float]) -> Problem:
        """The same problem with other prior deviations of parameters that it moves, by name."""
        other = copy(self)
        parameters = tuple(replace(p, prior=priors.get(p.name, p.prior)) for p in self.nuisances.parameters)
        other.nuisances = replace(self.nuisances, parameters=parameters)
        other.prior = np.where(self.prior > 0.0, [p.prior for p in parameters], 0.0)
        return other

    def on(self, blocked: BlockedWindows) -> Problem:
        """The same problem on other windows of the same recordings."""
        other = self._simulated(lambda model: model.on(blocked.windows))
        other.blocked = blocked
        return other

    def during(self, spells: Mapping[str, Spell]) -> Problem:
        """The same problem with effects that are present in a part of the windows only, by name."""
        return self._simulated(lambda model: model.during(spells))

    @property
    def spells(self) -> Mapping[str, Spell]:
        """Parts of the drives in which effects are present, by name; all of it for those without one."""
        return self.model.spells

    def present(self, name: str) -> Chosen:
        """(W,) windows in which an effect of a name is present where it is assumed."""
        windows, spell = self.blocked.windows, self.spells.get(name)
        return np.ones(windows.count, dtype=bool) if spell is None else spell.in_windows(windows)

    def on_threads(self, threads: int) -> Problem:
        """The same problem, simulated on another number of threads."""
        return self._simulated(lambda model: model.on_threads(threads))

    def _simulated(self, changed: Callable[[WindowModel], WindowModel]) -> Problem:
        """The same problem with a change of its models, that of the sensitivities included."""
        other = copy(self)
        other.model, other._slopes = changed(self.model), self._slopes and changed(self._slopes)
        return other

    def model_of(self, windows: WindowSet) -> WindowModel:
        """The same model over other windows of the same recordings."""
        return self.model.on(windows)

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
        span = self.high - self.low
        near = np.where(np.isfinite(span), _AT_BOUND * span, 0.0)
        held = (point.values <= self.low + near) | (point.values >= self.high - near)
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

    def varied(self, point: Point, reference: Reference) -> Array:
        """The same where it only serves a sensitivity, near a reference."""
        model = self._slopes or self.model
        return model.predict(point.values, point.states, point.effects, near=reference)

    def changes(self, pairs: Sequence[tuple[Point | None, Point]], reference: Reference) -> Iterator[Array]:
        """Weighted changes (W, M) of such predictions between pairs of points.

        Args:
            pairs: begin and end of each change; it begins at the reference where there is None.
            reference: of :meth:`reference`, near which all points are.
        """

        def change(pair: tuple[Point | None, Point], threads: int) -> Array:
            (begin, end), own = pair, self.on_threads(threads)
            before = reference.prediction if begin is None else own.varied(begin, reference)
            return self.blocked.change(own.varied(end, reference), before)

        return side_by_side(change, pairs, self.model.threads)

    def reference(self, point: Point) -> Reference:
        """What predictions for sensitivities are held against: that at a point, by the same numerics."""
        return (self._slopes or self.model).reference(point.values, point.states, point.effects)

    def residual(self, point: Point, prediction: Array) -> Array:
        """Weighted block residuals with the priors of the local unknowns below, (W, M + S)."""
        offset = np.zeros((self.blocked.windows.count, len(self.local_prior)))
        offset[:, : len(STATE_PRIOR)] = (self.starts(point.values) - point.states) / STATE_PRIOR
        return np.concatenate([self.blocked.residual(prediction), offset], axis=1)

    def losses(self, residual: Array) -> Array:
        """(W,) loss of residuals (W, M + S)."""
        return np.asarray(self._loss(residual).sum(axis=1))

    def losses_by_channel(self, residual: Array) -> dict[str, float]:
        """Loss of residuals (W, M + S) of every channel, over all windows."""
        sums = self.blocked.by_channel(self._loss(residual)).sum(axis=(0, 1)).tolist()
        return dict(zip(CHANNELS, sums, strict=True))

    def _loss(self, residual: Array) -> Array:
        """The same shape."""
        limits = self._limits
        return np.asarray(0.5 * residual**2 if limits is None else huber_loss(residual, limits))

    @property
    def _limits(self) -> Array | None:
        """(M + S,) sizes of residuals from which the loss is linear; priors are squares throughout."""
        if self._robust is None:
            return None
        blocks = self.blocked.weights.shape[1]
        return np.concatenate([np.tile(self._robust, blocks), np.full(len(self.local_prior), np.inf)])

    def padded(self, columns: Array) -> Array:
        """Columns (W, M, K) with the rows of the unknowns' priors below, (W, M + S, K)."""
        rows = np.zeros((columns.shape[0], len(self.local_prior), columns.shape[2]))
        return np.concatenate([columns, rows], axis=1)

    def parameter_columns(self, point: Point, base: Array, reference: Reference | None = None) -> Array:
        """Weighted sensitivity to every nuisance parameter, (W, M, P).

        One simulation serves all parameters of scopes that do not overlap: a window sees one of them. So do headings,
        see :meth:`heading_columns`, and biases need none. What is held and has no local unknown is left out.

        Args:
            point: where the model stands.
            base: (W, T, 8) prediction there.
            reference: of :meth:`reference`; simulated when it is None.
        """
        columns = np.zeros((*self.blocked.mask.shape, len(self.prior)))
        simulated = []
        for k, parameter in enumerate(self.nuisances.parameters):
            of_current = self._current_column(parameter.name, point, base)
            if of_current is not None:
                columns[..., k] = of_current
                continue
            channel = _BIAS_CHANNEL.get(parameter.entries[0]) if len(parameter.entries) == 1 else None
            if channel is not None and not parameter.factor:
                acts = parameter.acts_in(self.blocked.windows.recording)
                change = bias_change(base.shape, channel, acts, point.effects, self.present)
                columns[..., k] = self.blocked.derivative(change, base)
            elif not parameter.heading and (self.prior[k] > 0.0 or k in self._varied):
                simulated.append(k)
        reference = self.reference(point) if reference is None else reference
        groups = disjoint_scopes(self.nuisances.parameters, simulated)
        spans = [np.array([self._difference(k, point.values[k]) for k in group]) for group in groups]
        pairs = [
            (_beside(point, group, span[:, 0]) if span[:, 0].any() else None, _beside(point, group, span[:, 1]))
            for group, span in zip(groups, spans, strict=True)
        ]
        for group, span, change in zip(groups, spans, self.changes(pairs, reference), strict=True):
            for k, (start, end) in zip(group, span, strict=True):
                acts = self.nuisances.parameters[k].acts_in(self.blocked.windows.recording)
                columns[acts, :, k] = change[acts] / (end - start)
        return self.heading_columns(point, columns, reference)

    def _difference(self, k: int, value: float) -> tuple[float, float]:
        """Begin and end of the finite difference to parameter k, from its value.

        Back from an upper bound, but for one that is next to 0; to both sides inside the bounds where it is centred.
        """
        parameter = self.nuisances.parameters[k]
        step = parameter.step
        if parameter.centred:
            return max(-step, self.low[k] - value), min(step, self.high[k] - value)
        return 0.0, step if value + step <= max(self.high[k], _NEAR_BOUND) else -step

    def local_columns(self, point: Point, reference: Reference) -> Array:
        """The sensitivities (W, M, P) to the parameters that have a local unknown; 0 for all others."""
        columns = np.zeros((*self.blocked.mask.shape, len(self.prior)))
        pairs = [(None, _beside(point, [k], self.nuisances.parameters[k].step)) for k in self._varied]
        for k, change in zip(self._varied, self.changes(pairs, reference), strict=True):
            columns[..., k] = change / self.nuisances.parameters[k].step
        return columns

    @property
    def _varied(self) -> list[int]:
        """Indices of the parameters that have a local unknown."""
        return [unknown.parameter for unknown in self.nuisances.local if unknown.parameter is not None]

    def heading_columns(self, point: Point, by_parameter: Array, reference: Reference | None = None) -> Array:
        """Sensitivities (W, M, P) with those to the headings as they are with the effects of a point.

        One simulation serves all headings: every window belongs to one recording.
        """
        own = [k for k, parameter in enumerate(self.nuisances.parameters) if parameter.heading]
        if not own:
            return by_parameter
        found = by_parameter.copy()
        found[..., own] = 0.0
        if not headings_matter(point.effects):
            return found
        step = self.nuisances.parameters[own[0]].step
        values = point.values.copy()
        values[own] += step
        reference = self.reference(point) if reference is None else reference
        change = next(self.changes([(None, self.moved(point, values))], reference)) / step
        for k in own:
            chosen = self.nuisances.parameters[k].acts_in(self.blocked.windows.recording)
            found[..., k] = np.where(chosen[:, None], change, 0.0)
        return found

    def _current_column(self, name: str, point: Point, base: Array) -> Array | None:
        """(W, M) exact sensitivity to a constant of the currents; None for all other parameters."""
        currents = self.model.currents
        change = None if currents is None else currents.derivative(name, base, self.model.named(point.values))
        return None if change is None else self.blocked.derivative(change, base)

    def eliminate(
        self, point: Point, base: Array, by_parameter: Array, reference: Reference | None = None
    ) -> Elimination:
        """Basis of the local unknowns of each window at a point (theory: identification, eq. (7)).

        Args:
            point: where the model stands.
            base: (W, T, 8) prediction there.
            by_parameter: (W, M, P) sensitivities, of which those with a local unknown count.
            reference: of :meth:`reference`; simulated when it is None.
        """
        model = self._slopes or self.model
        reference = self.reference(point) if reference is None else reference
        changes = model.state_derivatives(point.values, point.states, reference, point.effects)
        by_state = np.nan_to_num(self.blocked.derivative(changes, reference.prediction))
        local = [
            by_parameter[..., unknown.parameter]
            if unknown.channel is None
            else self.blocked.derivative(bias_change(base.shape, unknown.channel), base)
            for unknown in self.nuisances.local
        ]
        columns = np.concatenate([by_state, *(column[..., None] for column in local)], axis=2)
        rows = np.broadcast_to(np.diag(1.0 / self.local_prior), (len(columns), *2 * (columns.shape[2],)))
        stacked = np.concatenate([columns * self.blocked.mask[..., None], rows], axis=1)
        limits = self._limits
        roots = None if limits is None else huber_roots(self.residual(point, base), limits)
        return Elimination.of(stacked, roots)
