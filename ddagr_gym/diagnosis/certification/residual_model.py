"""A flexible model of what a simulator leaves: how much of the mismatch anything could explain from the same readings.

A ridge regression and then a forest map what the robot is told and does, where it is and which way it faces, to the
errors of its readings and of its motion over half a second. A corrected forecast is integrated anew, block by block, so
that a better yaw rate also makes a better path. It names nothing; it is the yardstick beside the named effects.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.windows import CHANNELS, WindowSet

Array = NDArray[np.float64]

BLOCK = 0.5
"""Time over which readings and errors are averaged [s]."""

RATES = CHANNELS[:5]
"""Channels that are corrected as they are."""

TARGETS = (*RATES, "forward", "left", "turn")
"""Errors that the model predicts: readings, then velocity in body axes [m/s] and turn rate by the poses [rad/s]."""

_XY = [CHANNELS.index("pose_x"), CHANNELS.index("pose_y")]
_YAW = CHANNELS.index("pose_yaw")
_PENALTIES = (0.1, 1.0, 10.0, 100.0, 1000.0)
"""Of the ridge regression on standardised inputs: leave-one-out errors choose one for each target (ours: decades from
nearly none, beside the number of blocks, to more than there are blocks)."""

_LEAST_ROWS = 30
"""Blocks below which nothing is fitted (ours: five leaves of the forest, which hold at least six each)."""

_STRETCH = 10.0  # seconds that stay together when the model judges itself


@dataclass(frozen=True, eq=False)
class Rollout:
    """Forecasts of a model with what is known about them.

    Attributes:
        windows: from the starts on.
        readings: (W, T, 8) predicted.
        states: (W, T, 8) predicted STATE.
    """

    windows: WindowSet
    readings: Array
    states: Array

    @property
    def length(self) -> int:
        """Samples in a block."""
        return max(round(BLOCK / self.windows.period), 1)

    @property
    def blocks(self) -> int:
        """B, whole ones; what is left over at the end is corrected like the last."""
        return self.windows.samples // self.length

    def by_block(self, values: Array) -> Array:
        """Means (W, B, ...) of values (W, T, ...) without NaN; NaN where there is nothing else."""
        kept = values[:, : self.blocks * self.length]
        kept = kept.reshape(len(values), self.blocks, self.length, *values.shape[2:])
        known = np.isfinite(kept).sum(axis=2)
        return np.asarray(np.where(known > 0, np.nansum(kept, axis=2) / np.maximum(known, 1), np.nan))


def features(rollout: Rollout, block: int, heading: Array, place: Array) -> Array:
    """What the errors of one block may depend on, (W, F).

    Args:
        rollout: forecasts.
        block: which.
        heading: (W,) at the block [rad].
        place: (W, 2) at the block [m].
    """
    windows, length = rollout.windows, rollout.length
    rows = slice(windows.history + block * length, windows.history + (block + 1) * length)
    earlier = slice(max(rows.start - length, 0), rows.start) if rows.start else rows
    now, before = windows.commands[:, rows].mean(axis=1), windows.commands[:, earlier].mean(axis=1)
    state = rollout.states[:, block * length : (block + 1) * length].mean(axis=1)
    v_x, v_y, turn, right, left = state[:, 3:8].T
    speed, facing = 0.5 * (right + left), np.stack([np.cos(heading), np.sin(heading)], axis=1)
    columns = [
        now, now - before, now - state[:, 6:8], np.sign(now), facing, facing * speed[:, None], place,
        np.stack([v_x, v_y, turn, np.abs(turn), v_x * turn, right - left, speed, np.abs(speed)], axis=1),
        (windows.time + block * BLOCK)[:, None],
    ]  # fmt: skip
    return np.concatenate(columns, axis=1)


def targets(rollout: Rollout, block: int) -> Array:
    """Errors of one inner block, measured less predicted, (W, 8) by TARGETS; NaN where nothing measures them."""
    mean = rollout.by_block(rollout.windows.measured - rollout.readings)
    known = np.isfinite(rollout.windows.measured)
    tracks = []
    for source in (rollout.windows.measured, rollout.readings):
        sampled = np.where(known, source, np.nan)
        yaw = np.unwrap(np.where(known[..., _YAW], source[..., _YAW], rollout.readings[..., _YAW]), axis=1)
        blocked = rollout.by_block(sampled[..., _XY])
        tracks.append((blocked, rollout.by_block(np.where(known[..., _YAW], yaw, np.nan))))
    moved = [_body_velocity(place, yaw, block) for place, yaw in tracks]
    return np.concatenate([mean[:, block, : len(RATES)], moved[0] - moved[1]], axis=1)


def _body_velocity(place: Array, yaw: Array, block: int) -> Array:
    """(W, 3) velocity in body axes and turn rate from the blocks around one."""
    step = (place[:, block + 1] - place[:, block - 1]) / (2.0 * BLOCK)
    c, s = np.cos(yaw[:, block]), np.sin(yaw[:, block])
    turn = (yaw[:, block + 1] - yaw[:, block - 1]) / (2.0 * BLOCK)
    return np.stack([c * step[:, 0] + s * step[:, 1], c * step[:, 1] - s * step[:, 0], turn], axis=1)


@dataclass(frozen=True, eq=False)
class ResidualModel:
    """A fitted one.

    Attributes:
        linear: ridge regression on standardised features.
        forest: of what it leaves.
        trust: (8,) factor on each predicted error: what held up on stretches that were left out, 0 to 1.
        measured: (8,) whether a target was measured at all.
    """

    linear: Any
    forest: Any
    trust: Array
    measured: NDArray[np.bool_]

    def __call__(self, values: Array) -> Array:
        """Predicted errors (W, 8)."""
        found = np.zeros((len(values), len(TARGETS)))
        found[:, self.measured] = _both(self.linear, self.forest, values, int(self.measured.sum()))
        return found * self.trust


def fit_residual_model(rollout: Rollout, seconds: float, seed: int) -> ResidualModel | None:
    """Model of the errors over the first ``seconds`` of forecasts; None where too little was measured.

    Args:
        rollout: forecasts of drives that the model may see, with starts ``seconds`` apart.
        seconds: that count, from the second block on.
        seed: of the forest.
    """
    blocks = range(1, min(1 + max(round(seconds / BLOCK), 1), rollout.blocks - 1))
    if not blocks:
        return None
    yaw, place = rollout.by_block(rollout.states[..., 2]), rollout.by_block(rollout.states[..., :2])
    inputs = np.concatenate([features(rollout, b, yaw[:, b], place[:, b]) for b in blocks])
    outputs = np.concatenate([targets(rollout, b) for b in blocks])
    measured = np.isfinite(outputs).mean(axis=0) > 0.5
    rows = np.isfinite(outputs[:, measured]).all(axis=1)
    group = np.tile(np.floor(rollout.windows.time / _STRETCH) + 1000 * rollout.windows.recording, len(blocks))[rows]
    if rows.sum() < _LEAST_ROWS or not measured.any():
        return None
    inputs, outputs = inputs[rows], outputs[rows][:, measured]
    trust = np.zeros(len(TARGETS))
    trust[measured] = _trust(inputs, outputs, group, seed)
    return ResidualModel(*_fit(inputs, outputs, seed), trust, measured)


def _fit(inputs: Array, outputs: Array, seed: int) -> tuple[Any, Any]:
    from sklearn.ensemble import ExtraTreesRegressor
    from sklearn.linear_model import RidgeCV
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    linear = make_pipeline(StandardScaler(), RidgeCV(_PENALTIES, alpha_per_target=True))
    linear.fit(inputs, outputs)
    left = outputs - linear.predict(inputs).reshape(outputs.shape)
    scale = np.maximum(left.std(axis=0), 1e-12)
    forest = ExtraTreesRegressor(50, min_samples_leaf=6, random_state=seed)
    forest.fit(inputs, left / scale)
    return linear, (forest, scale)


def _both(linear: Any, forest: Any, inputs: Array, outputs: int) -> Array:
    trees, scale = forest
    shape = (len(inputs), outputs)
    return np.asarray(linear.predict(inputs).reshape(shape) + scale * trees.predict(inputs).reshape(shape))


def _trust(inputs: Array, outputs: Array, group: Array, seed: int) -> Array:
    """Slope of left-out errors on their prediction, inside 0 and 1, by target."""
    numbers = np.unique(group, return_inverse=True)[1].reshape(-1) % 3
    predicted = np.zeros_like(outputs)
    for part in np.unique(numbers):
        inside = numbers == part
        if inside.all():
            return np.zeros(outputs.shape[1])
        predicted[inside] = _both(*_fit(inputs[~inside], outputs[~inside], seed), inputs[inside], outputs.shape[1])
    power = np.maximum((predicted**2).sum(axis=0), 1e-30)
    return np.asarray(np.clip((predicted * outputs).sum(axis=0) / power, 0.0, 1.0))


def corrected(model: ResidualModel, rollout: Rollout) -> Array:
    """Readings (W, T, 8) with the predicted errors added and the path integrated anew."""
    readings, states, length = rollout.readings.copy(), rollout.states, rollout.length
    samples, period = rollout.windows.samples, rollout.windows.period
    turned, place = np.zeros(len(readings)), states[:, 0, :2].copy()
    shift = np.zeros((len(readings), 2))
    for block in range(max(rollout.blocks, 1)):
        first = block * length
        rows = slice(first, samples if block == rollout.blocks - 1 else first + length)
        change = model(features(rollout, min(block, rollout.blocks - 1), states[:, first, 2] + turned, place))
        readings[:, rows, : len(RATES)] += change[:, None, : len(RATES)]
        extra = change[:, None, 7] * period * np.arange(1, rows.stop - first + 1)
        heading = states[:, rows, 2] + turned[:, None] + extra
        readings[:, rows, _YAW] += turned[:, None] + extra
        shift_rows = shift[:, None] + _path_shift(states, rows, heading, change[:, 5:7], period)
        readings[:, rows, _XY[0] : _XY[1] + 1] += shift_rows
        shift, turned = shift_rows[:, -1], turned + extra[:, -1]
        place = states[:, rows.stop - 1, :2] + shift
    return readings


def _path_shift(states: Array, rows: slice, heading: Array, velocity: Array, period: float) -> Array:
    """(W, n, 2) shift of the path over a block by another heading and a further velocity in body axes."""
    before = states[:, np.maximum(np.arange(rows.start, rows.stop) - 1, 0), :2]
    step = states[:, rows, :2] - before
    angle = heading - states[:, rows, 2]
    c, s = np.cos(angle), np.sin(angle)
    other = np.stack([c * step[..., 0] - s * step[..., 1], s * step[..., 0] + c * step[..., 1]], axis=-1)
    c, s = np.cos(heading), np.sin(heading)
    forward, left = velocity[:, :1], velocity[:, 1:]
    further = period * np.stack([c * forward - s * left, s * forward + c * left], axis=-1)
    return np.asarray(np.cumsum(other - step + further, axis=1))
