"""Which of several sources of one motion disagrees in sign with the others.

Every pair of sources has a correlation through the origin, with an interval over blocks of the drive. The sources are
split into two camps so that as much correlation as possible is positive within and negative across them; the smaller
camp is at fault. Equal camps decide nothing.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ddagr_gym.recordings.checks.blocks import FEWEST_BLOCKS, interval_of, resample
from ddagr_gym.recordings.checks.findings import Interval
from ddagr_gym.recordings.schema import FloatArray

LEAST_AGREEMENT = 0.3
"""Correlation that a pair must have to count (ours): one tenth of the variance in common; sound pairs of the open
recordings have 0.45 to 1.0."""

Pair = tuple[str, str]


@dataclass(frozen=True)
class Votes:
    """What the sources of one motion say of each other.

    Attributes:
        correlation: by pair of sources [-].
        interval: its 99 % interval, by pair.
        camps: sources in two camps that move against each other, the larger first; both as large: undecided. A source
            that correlates with no other is in neither.
        support: by source in a camp, its mean correlation with the sources of the larger camp [-].
        support_interval: its 99 % interval.
        third: what decided between camps of one size, in words; "" where nothing had to.
    """

    correlation: Mapping[Pair, float]
    interval: Mapping[Pair, Interval]
    camps: tuple[tuple[str, ...], tuple[str, ...]]
    support: Mapping[str, float]
    support_interval: Mapping[str, Interval]
    third: str = ""

    @property
    def decided(self) -> bool:
        """Whether one camp is larger, or something else has decided for it."""
        return bool(self.third) or len(self.camps[0]) > len(self.camps[1])

    @property
    def majority(self) -> tuple[str, ...]:
        """Sources that agree; empty where nothing is decided."""
        return self.camps[0] if self.decided else ()

    @property
    def minority(self) -> tuple[str, ...]:
        """Sources that move against them; empty where nothing is decided."""
        return self.camps[1] if self.decided else ()


def votes(signals: Mapping[Pair, tuple[FloatArray, FloatArray]], block: FloatArray, rng: np.random.Generator) -> Votes:
    """Votes from the windows in which both sources of a pair are known.

    Args:
        signals: by pair of sources, what each says in every window (n,), NaN where it does not know.
        block: number of the block of the drive of each window (n,).
        rng: of the resampling.
    """
    pairs = list(signals)
    sums = np.stack([_moments(*signals[pair], block) for pair in pairs], axis=1) if pairs else np.empty((0, 0, 3))
    sums = sums[np.any(sums[:, :, 2] > 0, axis=1)]
    if len(sums) < FEWEST_BLOCKS:
        return Votes({}, {}, ((), ()), {}, {})
    values, resampled = resample(sums, _correlations, rng)
    intervals = [interval_of(float(v), resampled[:, i], len(sums)) for i, v in enumerate(values)]
    signs = {
        pair: float(v) if abs(v) >= LEAST_AGREEMENT and (low > 0 or high < 0) else 0.0
        for pair, v, (low, high) in zip(pairs, values, intervals, strict=True)
    }
    found = Votes(
        dict(zip(pairs, map(float, values), strict=True)),
        dict(zip(pairs, intervals, strict=True)),
        _camps(signs),
        {},
        {},
    )
    return supported(found, dict(zip(pairs, resampled.T, strict=True)), len(sums))


def supported(found: Votes, resampled: Mapping[Pair, FloatArray], blocks: int) -> Votes:
    """Votes with every source's mean correlation with the first camp.

    Args:
        found: without.
        resampled: correlations by pair (m,).
        blocks: number of blocks.
    """
    support, interval = {}, {}
    for source in itertools.chain(*found.camps):
        with_majority = [pair for pair in resampled if source in pair and {*pair} - {source} <= {*found.camps[0]}]
        if with_majority:
            mean = float(np.mean([found.correlation[pair] for pair in with_majority]))
            support[source] = mean
            interval[source] = interval_of(mean, np.mean([resampled[p] for p in with_majority], axis=0), blocks)
    return replace(found, support=support, support_interval=interval)


def with_other_majority(found: Votes) -> Votes:
    """Votes whose camps have changed places: what supported one speaks against the other."""
    support = {source: -value for source, value in found.support.items()}
    return replace(
        found, support=support, support_interval={s: (-high, -low) for s, (low, high) in found.support_interval.items()}
    )


def _moments(x: FloatArray, y: FloatArray, block: FloatArray) -> FloatArray:
    """Sums of x x, x y, y y over each block (blocks, 3)."""
    known = np.isfinite(x) & np.isfinite(y)
    number = block[known].astype(np.int64)
    count = int(block.max()) + 1 if block.size else 0
    a, b = x[known], y[known]
    return np.stack([np.bincount(number, v, minlength=count) for v in (a * a, a * b, b * b)], axis=1)


def _correlations(totals: FloatArray) -> FloatArray:
    """Correlation of each pair (m, pairs) from its sums (m, pairs, 3); 0 where one of them never moves."""
    power = totals[..., 0] * totals[..., 2]
    return np.where(power > 0, totals[..., 1] / np.sqrt(np.where(power > 0, power, 1.0)), 0.0)


def _camps(signs: Mapping[Pair, float]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Split of the largest set of sources that are connected with each other, the larger camp first."""
    sources = _connected([pair for pair, value in signs.items() if value])
    if not sources:
        return (), ()
    splits = [dict(zip(sources, (1, *rest), strict=True)) for rest in _signs(len(sources) - 1)]
    known = [(a, b, value) for (a, b), value in signs.items() if value and a in sources]
    best = max(splits, key=lambda side: sum(value * side[a] * side[b] for a, b, value in known))
    one, other = (tuple(s for s in sources if best[s] == side) for side in (1, -1))
    return (one, other) if len(one) >= len(other) else (other, one)


def _signs(count: int) -> npt.NDArray[np.int64]:
    """All rows of ``count`` signs, all positive first."""
    return np.array(list(itertools.product((1, -1), repeat=count)), dtype=np.int64).reshape(2**count, count)


def _connected(pairs: Sequence[Pair]) -> list[str]:
    """The largest set of sources that pairs connect, in the order of the pairs."""
    groups: list[list[str]] = []
    for pair in pairs:
        touching = [group for group in groups if set(group) & set(pair)]
        merged = list(dict.fromkeys([*itertools.chain(*touching), *pair]))
        groups = [group for group in groups if group not in touching] + [merged]
    return max(groups, key=len) if groups else []
