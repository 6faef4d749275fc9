"""How much a flexible model of the residuals explains on stretches that it has not seen, and where something acts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.unnamed.regressors import Motion

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_FEATURES = (
    "v_x", "v_y", "r", "a_x", "a_y", "r_dot", "x", "y", "t", "w_right", "w_left", "w_dot_right", "w_dot_left",
    "c_right", "c_left", "c_dot_right", "c_dot_left", "torque_right", "torque_left",
)  # fmt: skip
_FEWEST = 40
"""Blocks of a channel below which no trees are grown: with leaves of at least 20 no tree could split."""

_PARTS = 4  # of a heading's circle


def features(motion: Motion) -> Array:
    """(W, B, F) of what a flexible model may use."""
    yaw = motion["yaw"].values
    columns = [motion[name].values for name in _FEATURES] + [np.cos(yaw), np.sin(yaw)]
    for side in ("right", "left"):
        if f"angle_{side}" in motion.signals:
            angle = motion[f"angle_{side}"].values
            columns += [np.cos(angle), np.sin(angle)]
    return np.stack(columns, axis=2)


def boosted_share(residual: Array, known: Flags, motion: Motion, fold: NDArray[np.int64]) -> float:
    """Share of the sum of squares that boosted trees remove on windows of folds that they were not grown on.

    Args:
        residual: (W, B, 8) over sigma, the windows' unknowns eliminated.
        known: (W, B, 8) where there is a sample.
        motion: signals per block.
        fold: (W,).
    """
    from sklearn.ensemble import HistGradientBoostingRegressor

    table = features(motion)
    before = after = 0.0
    for channel in range(residual.shape[2]):
        here = known[..., channel]
        part = np.broadcast_to(fold[:, None], here.shape)
        channel_before = float((residual[..., channel][here] ** 2).sum())
        before += channel_before
        left = 0.0
        for number in np.unique(fold):
            grow, test = here & (part != number), here & (part == number)
            values = residual[..., channel][test]
            if grow.sum() < _FEWEST or not test.any():
                left += float((values**2).sum())
                continue
            trees = HistGradientBoostingRegressor(
                max_iter=40, learning_rate=0.15, max_leaf_nodes=8, min_samples_leaf=20, early_stopping=False,
                max_bins=64, random_state=0,
            ).fit(table[grow], residual[..., channel][grow])  # fmt: skip
            left += float(((values - trees.predict(table[test])) ** 2).sum())
        # a model of nothing is always at hand
        after += min(left, channel_before)
    return 1.0 - after / before if before > 0.0 else 0.0


@dataclass(frozen=True)
class Concentration:
    """A subset of the drives in which something is concentrated.

    Attributes:
        words: short phrase.
        share: of all of it that lies there.
        fraction: of the time that this takes.
    """

    words: str
    share: float
    fraction: float


def concentration_of(energy: Array, motion: Motion, recording: NDArray[np.int64]) -> Concentration:
    """The simple subset of the drives with most energy against its share of the time.

    The one of largest Kullback-Leibler divergence between the shares of energy and of time.

    Args:
        energy: (W, B), of any sign.
        motion: signals per block.
        recording: (W,).
    """
    total = float(energy.sum())
    if total <= 0.0:
        return Concentration("everywhere", 1.0, 1.0)
    best = Concentration("everywhere", 1.0, 1.0)
    strongest = _LEAST_INFORMATION
    for words, inside in _subsets(motion, recording):
        fraction = float(inside.mean())
        share = min(max(float(energy[inside].sum()) / total, 0.0), 1.0)
        if not 0.05 <= fraction <= 0.6 or share <= fraction:
            continue
        information = share * np.log(share / fraction)
        if share < 1.0:
            information += (1.0 - share) * np.log((1.0 - share) / (1.0 - fraction))
        if information > strongest:
            best, strongest = Concentration(words, share, fraction), information
    if best.words == "everywhere":
        return best
    text = f"{best.words}: {100 * best.share:.0f} % of it in {100 * best.fraction:.0f} % of the time"
    return Concentration(text, best.share, best.fraction)


_LEAST_INFORMATION = 0.05  # ours: 60 % of it in 45 % of the time


def _subsets(motion: Motion, recording: NDArray[np.int64]) -> list[tuple[str, Flags]]:
    """Simple subsets of the drives, in words, and the blocks that belong to them."""
    speed, turn = np.abs(motion["v_x"].values), motion["r"].values
    change = np.maximum(np.abs(motion["c_dot_right"].values), np.abs(motion["c_dot_left"].values))
    found = [
        ("driving backwards", motion["v_x"].values < -0.02),
        ("right after a change of command", change > 0.2),
    ]
    for q in (0.25, 0.5, 0.75):
        found += _both("speed", speed, q, "m/s", ("slow", "fast"))
        found += _both("turning", np.abs(turn), q, "rad/s", ("straight", "in turns"))
        for name, unit in (("t", "s"), ("x", "m"), ("y", "m")):
            found += _both(name, motion[name].values, q, unit, ("", ""))
    slowest = np.minimum(np.abs(motion["c_right"].values), np.abs(motion["c_left"].values))
    found += [(f"while a bank is commanded slower than {v:g} rad/s", slowest < v) for v in (0.2, 0.4)]
    found += [("turning left", turn > 0.05), ("turning right", turn < -0.05)]
    found += [(f"in recording {k + 1}", np.broadcast_to(recording[:, None] == k, turn.shape)) for k in set(recording)]
    heading = np.angle(np.exp(1j * motion["yaw"].values))
    for k in range(2 * _PARTS):
        middle = np.angle(np.exp(2j * np.pi * k / (2 * _PARTS)))
        near = np.abs(np.angle(np.exp(1j * (heading - middle)))) < np.pi / _PARTS
        found.append((f"heading about {np.degrees(middle):.0f} deg", near))
    return found


def _both(name: str, values: Array, q: float, unit: str, words: tuple[str, str]) -> list[tuple[str, Flags]]:
    limit = float(np.quantile(values, q))
    low, high = (f"{word} ({name}" if word else f"at {name}" for word in words)
    close = ")" if words[0] else ""
    return [
        (f"{low} < {limit:.2g} {unit}{close}", values < limit),
        (f"{high} > {limit:.2g} {unit}{close}", values > limit),
    ]
