"""Where in what the robot did something stands out: in which motion, at which command, time or place.

What is tested is a list of pieces with a weight each (the gain of an effect, or the mismatch). Ordered by the value of
an operating condition, the share of the weight runs ahead of the share of the time where the weight is concentrated;
the largest excess over all ranges is N. Kuiper's statistic, over all discs for places. Its null distribution shifts the
weights along each recording, which keeps their correlation; the largest standardised excess over all operating
conditions is what a finding is compared with (a max-statistic), so that noise makes no phrases.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.location import CONDITION_LEVEL, OperatingConditionShare, Unevenness

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

CONDITIONS: Mapping[str, tuple[str, str]] = {
    "speed": ("m/s", "forward speed, predicted"),
    "slip": ("-", "mean size of the four wheels' slip ratios, predicted"),
    "turning": ("rad/s", "size of the yaw rate, predicted"),
    "yaw_rate": ("rad/s", "predicted, positive to the left"),
    "heading": ("rad", "predicted, in the world's frame"),
    "command": ("rad/s", "larger of the two banks' speed commands"),
    "command_change": ("rad/s", "largest change of a command in the piece and the one before"),
    "time": ("s", "of the recording"),
}
"""Unit and meaning of the ordered operating conditions; places and recordings come beside them."""

LEAST_DIFFERENCE = 0.3
"""Difference between the sizes of an effect in two operating conditions, over the fitted size, worth naming (ours)."""

BINS = 6
"""Bins, with about as many pieces each, in which shares are listed (ours: few, so that each holds several pieces; with
less than two pieces a bin nothing is tested)."""

_NEAR_END = 0.05
"""Share of the pieces beyond a range up to which it counts as open (ours)."""

_TIED = 1e-9
"""Distance over the range of all values below which two count as equal."""

_PERMUTATIONS = 300
"""Draws of the null distribution (ours: at CONDITION_LEVEL the standard error of p is 0.013)."""

_RADII = (0.5, 1.0, 1.5, 2.5, 4.0)
"""Of the discs in which places are sought [m] (ours: from a spot under the robot to a patch several robots long)."""

_MOST_CENTRES = 60
"""Discs of each radius are centred on about so many pieces, evenly chosen along the drive (ours: limits the time)."""


@dataclass(frozen=True, eq=False)
class Pieces:
    """What the robot did in each piece.

    Attributes:
        recording: (n,) number.
        values: (n,) by name of CONDITIONS; NaN where unknown.
        x: (n,) world [m].
        y: (n,) the same.
        frames_apart: whether the places are in several frames, so that none is sought.
    """

    recording: Integers
    values: Mapping[str, Array]
    x: Array
    y: Array
    frames_apart: bool = False


def shifted(weight: Array, recording: Integers, rng: np.random.Generator, count: int) -> Array:
    """(count, n) weights, each recording's shifted along itself by a random number of pieces."""
    order = np.tile(np.arange(len(weight)), (count, 1))
    for number in np.unique(recording):
        rows = np.flatnonzero(recording == number)
        moves = rng.integers(len(rows), size=(count, 1))
        order[:, rows] = rows[(np.arange(len(rows)) + moves) % len(rows)]
    return np.asarray(weight[order])


def shares(weight: Array, pieces: Pieces, rng: np.random.Generator) -> tuple[OperatingConditionShare, ...]:
    """How a weight lies over all operating conditions, what stands out most first; none where it sums to nothing.

    Args:
        weight: (n,) of the pieces; single ones may be negative.
        pieces: what the robot did.
        rng: of the shifts.
    """
    total = float(weight.sum())
    if total <= 0.0 or len(weight) < 2 * BINS:
        return ()
    trials = shifted(weight / total, pieces.recording, rng, _PERMUTATIONS)
    every = np.concatenate([weight[None] / total, trials])
    found: list[tuple[OperatingConditionShare, Array]] = []
    for name, values in pieces.values.items():
        known = np.isfinite(values)
        if known.all() and np.ptp(values) > 0.0:
            found.append(_ordered(name, every, values, np.full(len(values), 1.0 / len(values))))
    if not pieces.frames_apart:
        found.append(_places(every, pieces))
    return _with_p(found)


def _with_p(found: list[tuple[OperatingConditionShare, Array]]) -> tuple[OperatingConditionShare, ...]:
    """Probabilities over all operating conditions at once, from statistics (1 + permutations,) of each."""
    table = np.stack([statistic for _, statistic in found])
    middle, spread = table[:, 1:].mean(axis=1), np.maximum(table[:, 1:].std(axis=1), 1e-9)
    standard = (table - middle[:, None]) / spread[:, None]
    largest = standard[:, 1:].max(axis=0)
    probability = [(1.0 + float((largest >= own).sum())) / (1.0 + len(largest)) for own in standard[:, 0]]
    named = [replace(share, p=p) for (share, _), p in zip(found, probability, strict=True)]
    return tuple(sorted(named, key=lambda share: (not share.stands_out, -share.excess)))


def _ordered(name: str, every: Array, values: Array, usual: Array) -> tuple[OperatingConditionShare, Array]:
    """Kuiper's statistic of weights (P, n) over values (n,), and the range that stands out for the first row.

    Args:
        name: of the operating condition.
        every: the weights, and trials of the null distribution.
        values: of the operating condition.
        usual: (n,) weights where nothing stands out.
    """
    order = np.argsort(values, kind="stable")
    count = len(values)
    ahead = np.cumsum((every - usual)[:, order], axis=1)
    cuts = _between_values(values[order])
    ahead = np.concatenate([np.zeros((len(every), 1)), ahead], axis=1)[:, cuts]
    statistic = ahead.max(axis=1) - ahead.min(axis=1)
    first, last = int(cuts[ahead[0].argmin()]), int(cuts[ahead[0].argmax()])
    inside = np.zeros(count, dtype=bool)
    if first < last:
        inside[order[first:last]] = True
    else:  # the range wraps around both ends: of a circle one range, else the better of its two halves
        inside[order[first:]] = True
        inside[order[:last]] = True
        if name != "heading":
            first, last = _better_end(every[0][order], first, last)
            inside[:] = False
            inside[order[first:last]] = True
    ends = _ends(values, order, first, last, name == "heading")
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, BINS + 1)))
    place = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, max(len(edges) - 2, 0))
    bins = max(len(edges) - 1, 1)
    weight, time = float(every[0][inside].sum()), float(inside.mean())
    share = OperatingConditionShare(
        name, CONDITIONS[name][0], tuple(edges.tolist()),
        tuple((np.bincount(place, minlength=bins) / count).tolist()),
        tuple(np.bincount(place, every[0], minlength=bins).tolist()),
        ends[0], ends[1], weight - time, weight, time, 1.0,
    )  # fmt: skip
    return share, statistic


def _between_values(ranked: Array) -> Integers:
    """Places at which sorted values may be cut: nowhere inside a group of equal ones."""
    inner = 1 + np.flatnonzero(np.diff(ranked) > _TIED * np.ptp(ranked))
    return np.concatenate([[0], inner, [len(ranked)]])


def _trend(every: Array, values: Array) -> Array:
    """(P,) size of the trend of weights (P, n) with the ranks of values (n,)."""
    from scipy.stats import rankdata

    rank = rankdata(values) - 0.5 * (len(values) + 1)
    return np.asarray(np.abs(every @ rank) / len(values))


def _better_end(weight: Array, first: int, last: int) -> tuple[int, int]:
    """Of two ranges at the ends of sorted weights, the one with the larger excess; never an empty one."""
    count = len(weight)
    if first == count or last == 0:
        return (0, last or count) if first == count else (first, count)
    low = float(weight[:last].sum()) - last / count
    high = float(weight[first:].sum()) - (count - first) / count
    return (0, last) if low > high else (first, count)


def _ends(values: Array, order: Integers, first: int, last: int, circular: bool) -> tuple[float | None, float | None]:
    """Limits of a range of sorted values; None at an open end."""
    ranked = values[order]
    count = len(ranked)
    if circular:
        return float(ranked[first % count]), float(ranked[(last - 1) % count])
    near = _NEAR_END * count
    open_low = first <= near or ranked[first] == ranked[0]
    open_high = last >= count - near or ranked[last] == ranked[-1]
    low = None if open_low else float(0.5 * (ranked[first - 1] + ranked[first]))
    high = None if open_high else float(0.5 * (ranked[last - 1] + ranked[last]))
    return low, high


def _places(every: Array, pieces: Pieces) -> tuple[OperatingConditionShare, Array]:
    """Largest excess of weights (P, n) in a disc."""
    step = max(len(pieces.x) // _MOST_CENTRES, 1)
    centres = np.stack([pieces.x, pieces.y], axis=1)[::step]
    distance = np.hypot(pieces.x[:, None] - centres[:, 0], pieces.y[:, None] - centres[:, 1])
    discs = np.concatenate([distance <= radius for radius in _RADII], axis=1).astype(float)
    excess = every @ discs - discs.mean(axis=0)
    best = int(excess[0].argmax())
    inside = discs[:, best] > 0.0
    weight = np.maximum(every[0][inside], 0.0)
    scale = max(float(weight.sum()), 1e-12)
    x, y = float(pieces.x[inside] @ weight) / scale, float(pieces.y[inside] @ weight) / scale
    radius = float(_RADII[best // len(centres)])
    share, time = float(every[0][inside].sum()), float(inside.mean())
    found = OperatingConditionShare(
        "place", "m", (x, y, radius), (time,), (share,), None, None, share - time, share, time, 1.0
    )
    return found, excess.max(axis=1)


def uneven(
    remainder: Array, information: Array, window: Integers, pieces: Pieces, rng: np.random.Generator
) -> Unevenness | None:
    """The operating condition by which a fitted effect's size differs most, if that is no chance.

    Theory: diagnosis, section 10. A score test of its constancy: ordered by an operating condition, the running sum of
    what is left along the effect wanders off where its size is not the same (A. Zeileis, K. Hornik, 2007, generalised
    M-fluctuation tests), and its trend is steep where the size drifts, which few windows show more clearly; signs drawn
    by window give the null distribution.

    Args:
        remainder: (n,) inner product of the residual beside the effect and the effect.
        information: (n,) squared size of the effect.
        window: (n,) number of each piece's window, within which errors are alike.
        pieces: what the robot did.
        rng: of the signs.
    """
    whole = float(information.sum())
    if whole <= 0.0 or len(remainder) < 2 * BINS:
        return None
    _, group = np.unique(window, return_inverse=True)
    signs = rng.choice([-1.0, 1.0], size=(_PERMUTATIONS, int(group.max()) + 1))[:, group]
    every = np.concatenate([remainder[None], signs * remainder])
    every = every - every.sum(axis=1, keepdims=True) * information / whole
    every /= max(float(np.sqrt((np.bincount(group, remainder) ** 2).sum())), 1e-12)
    known = {n: v for n, v in pieces.values.items() if np.isfinite(v).all() and np.ptp(v) > 0.0}
    found = [_ordered(name, every, values, np.zeros(len(values))) for name, values in known.items()]
    found += [(share, _trend(every, known[share.name])) for share, _ in found if share.name != "heading"]
    if not found:
        return None
    clear = [share for share in _with_p(found) if share.p < CONDITION_LEVEL]
    split = [_split(share, remainder, information, _inside(pieces.values[share.name], share)) for share in clear]
    wide = [(explained, item) for explained, item in split if item is not None]
    return max(wide, key=lambda pair: pair[0])[1] if wide else None


def _split(
    share: OperatingConditionShare, remainder: Array, information: Array, inside: NDArray[np.bool_]
) -> tuple[float, Unevenness | None]:
    """Fall of the squares by a size of its own in a range, and the sizes; none where they differ by little."""
    within, beyond = float(information[inside].sum()), float(information[~inside].sum())
    if within <= 0.0 or beyond <= 0.0:
        return 0.0, None
    sizes = 1.0 + float(remainder[inside].sum()) / within, 1.0 + float(remainder[~inside].sum()) / beyond
    difference = sizes[0] - sizes[1]
    explained = difference**2 * within * beyond / (within + beyond)
    if abs(difference) < LEAST_DIFFERENCE:
        return explained, None
    return explained, Unevenness(share.name, share.unit, share.low, share.high, *sizes, share.p)


def _inside(values: Array, share: OperatingConditionShare) -> NDArray[np.bool_]:
    """(n,) whether values lie in the range of an operating condition; one of headings may wrap around."""
    low = -np.inf if share.low is None else share.low
    high = np.inf if share.high is None else share.high
    if low > high:
        return np.asarray((values >= low) | (values <= high))
    return np.asarray((values >= low) & (values <= high))
