"""Whether a size is constant in a recording, and if not, when it changed: a regression on time with one change point.

Sizes a with gradient g and information M (:mod:`ddagr_gym.diagnosis.mid_drive.sizes`) are described by a few numbers b,
a = D b: one constant for every recording, and for one recording at a time a step at a time t (windows that hold t count
with the share of them that lies after it) or a line. What a description leaves is

    Q_D = g' M^+ g - (D'g)' (D'M D)^+ (D'g),                                                                        (1)

and, the scale of the noise being what is left (n known directions of the sizes), the logarithm of the likelihood ratio
against constant sizes is

    L = n/2 ln(Q_constant / Q_D).                                                                                   (2)

A size whose form is not the library's differs from window to window with what the robot does. With the variance s of
that scatter M becomes (M^-1 + s I)^-1; s is what makes Q_D of the best change n less its numbers (method of moments, as
R. DerSimonian and N. Laird, Control. Clin. Trials 7 (1986) 177).

The step at the best time, or the line, counts where L exceeds a threshold. The 90 % interval of the time holds all t
whose L is at most half of 5.94 below the best (B. E. Hansen, Econometrica 68 (2000) 575, table 1: the likelihood ratio
of a change point is not chi-squared), and is widened to whole windows, since a window's state is free at its start and
takes up part of what happens inside it, and to the gaps beside them, of which no window tells anything.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.mid_drive.sizes import WindowSizes
from ddagr_gym.identification.spells import Spell

Array = NDArray[np.float64]

FEWEST_WINDOWS = 8
"""Windows of a recording in which an effect acts, below which nothing is said of time (ours, as for a diagnosis)."""

FEWEST_ASIDE = 3
"""Windows before and after a step at least (ours): two may differ by chance."""

INSIDE = 4
"""Times that are tried inside each window (ours)."""

CRITICAL = 5.94
"""Twice the fall of the log-likelihood that bounds 90 % of the times (Hansen 2000, table 1)."""

_PASSES = 2
"""Estimates of the scatter, the second beside the change that is best with the first (ours)."""

_HALVINGS = 10
"""Of the interval in which the scatter is sought."""

_ANCHOR = 1e4
"""Information of a mean that is taken as known, over that of all windows."""

_SAME = 1e-6
"""Time between the end of a window and the start of the next one that is none [s]."""

_SMALLEST = 1e-12
"""Share of the information below which there is nothing but rounding."""


@dataclass(frozen=True, eq=False)
class Described:
    """Sizes as a few numbers.

    Attributes:
        left: equation (1).
        values: (K,) b.
        deviation: (K,) standard deviations, by the scale of what is left.
    """

    left: float
    values: Array
    deviation: Array


@dataclass(frozen=True, eq=False)
class Alternative:
    """The best change of a size in one recording.

    Attributes:
        recording: its number.
        line: whether it is a line, not a step.
        time: of the step [s]; of a line the middle of the recording.
        interval: 90 % of the time, to whole windows [s]; of a line all of the recording.
        evidence: equation (2).
        before: size before the step, or at the recording's start.
        after: size after it, or at its end.
        deviation: standard deviations of both.
    """

    recording: int
    line: bool
    time: float
    interval: tuple[float, float]
    evidence: float
    before: float
    after: float
    deviation: tuple[float, float]


class TimeRegression:
    """Descriptions of the sizes of one effect.

    Args:
        sizes: by window.
        scatter: variance of the sizes from window to window besides what the noise makes of them.
    """

    def __init__(self, sizes: WindowSizes, scatter: float = 0.0) -> None:
        share = np.linalg.inv(np.eye(sizes.count) + scatter * sizes.information)
        information = share @ sizes.information
        information = 0.5 * (information + information.T)
        sizes = replace(sizes, gradient=share @ sizes.gradient, information=information)
        self.sizes = sizes
        self._inverse = np.linalg.pinv(sizes.information, rcond=_SMALLEST, hermitian=True)
        self._whole = float(sizes.gradient @ self._inverse @ sizes.gradient)
        self._known = int(np.linalg.matrix_rank(sizes.information, rtol=_SMALLEST, hermitian=True))
        numbers = np.unique(sizes.recording)
        self._constant = (sizes.recording[:, None] == numbers).astype(float)
        self._left = self.described(self._constant).left

    @classmethod
    def of(cls, sizes: WindowSizes) -> TimeRegression:
        """With the scatter by window that is left beside the best change."""
        scatter = 0.0
        for _ in range(_PASSES):
            best = cls(sizes, scatter).best()
            if best is None:
                break
            scatter = _scatter(sizes, best)
        return cls(sizes, scatter)

    @property
    def recordings(self) -> list[int]:
        """Those with enough windows to ask when."""
        numbers, counts = np.unique(self.sizes.recording, return_counts=True)
        return [int(k) for k, count in zip(numbers, counts, strict=True) if count >= FEWEST_WINDOWS]

    def described(self, design: Array) -> Described:
        """Sizes as (W, K) combinations of numbers, equation (1)."""
        inner = design.T @ self.sizes.information @ design
        # a description of which nothing is known (a recording that does not show the effect) gets no number
        ridge = _SMALLEST * max(float(np.trace(inner)), _SMALLEST)
        covariance = np.linalg.inv(inner + ridge * np.eye(len(inner)))
        right = design.T @ self.sizes.gradient
        left = max(self._whole - float(right @ covariance @ right), _SMALLEST * max(self._whole, _SMALLEST))
        scale = max(left / max(self._known - design.shape[1], 1), 1.0)
        return Described(left, covariance @ right, np.sqrt(scale * np.diag(covariance)))

    def evidence(self, found: Described) -> float:
        """Equation (2)."""
        return 0.5 * self._known * float(np.log(self._left / found.left))

    def in_stretches(self, windows: int, most: int) -> list[tuple[int, float, float, float, float]]:
        """Recording, start, end, size and its deviation in stretches of about equal numbers of windows.

        Args:
            windows: in a stretch at least.
            most: stretches of a recording.
        """
        parts: list[NDArray[np.int64]] = []
        for number in np.unique(self.sizes.recording):
            own = np.flatnonzero(self.sizes.recording == number)
            own = own[np.argsort(self.sizes.start[own], kind="stable")]
            parts += np.array_split(own, min(max(len(own) // windows, 1), most))
        design = np.zeros((self.sizes.count, len(parts)))
        for k, part in enumerate(parts):
            design[part, k] = 1.0
        found = self.described(design)
        return [
            (
                int(self.sizes.recording[part[0]]), float(self.sizes.start[part[0]]), float(self.sizes.end[part[-1]]),
                float(found.values[k]), float(found.deviation[k]),
            )
            for k, part in enumerate(parts)
        ]  # fmt: skip

    def anchored(self, spell: Spell) -> TimeRegression:
        """The same where the mean of the windows in which an effect is absent is taken to be nothing.

        The level of a size is what robot and soil could make up for; that an effect is absent before or after a time
        has been asked of refits.
        """
        sizes = self.sizes
        absent = ~spell.holds(sizes.recording, sizes.start, sizes.end)
        mean = absent / max(int(absent.sum()), 1)
        weight = _ANCHOR * float(np.trace(sizes.information))
        return TimeRegression(replace(sizes, information=sizes.information + weight * np.outer(mean, mean)))

    def around(self, found: Alternative) -> tuple[float, float]:
        """Sizes before and after the time of a change, or at the ends of its line."""
        values = self.described(self.design(found)).values
        return float(values[0]), float(values[1])

    def design(self, found: Alternative) -> Array:
        """(W, K) combinations of numbers that describe a change, sizes before and after it first."""
        shares = self._ends(found.recording) if found.line else self._shares(found.recording, found.time)
        return np.concatenate([shares, self._other_than(found.recording)], axis=1)

    def best(self) -> Alternative | None:
        """The change with the most evidence; None where no recording has enough windows."""
        found = [item for number in self.recordings for item in (self._step(number), self._line(number)) if item]
        # a step has its time free besides: a line that says as much is the simpler description
        return max(found, key=lambda item: (item.evidence, item.line)) if found else None

    def _other_than(self, number: int) -> Array:
        """(W, K) constants of all other recordings."""
        own = self.sizes.recording == number
        return np.asarray(self._constant[:, ~self._constant[own].any(axis=0)])

    def _shares(self, number: int, time: float) -> Array:
        """(W, 2) share of each window of a recording before and after a time."""
        sizes, own = self.sizes, self.sizes.recording == number
        after = np.clip((sizes.end - time) / (sizes.end - sizes.start), 0.0, 1.0)
        return np.stack([own * (1.0 - after), own * after], axis=1)

    def _times(self, number: int) -> Array:
        """Times that leave enough windows on both sides."""
        own = self.sizes.recording == number
        start, end = np.sort(self.sizes.start[own]), np.sort(self.sizes.end[own])
        inside = start[:, None] + (end - start)[:, None] * np.arange(INSIDE + 1) / INSIDE
        times = np.unique(inside.ravel())
        return np.asarray(times[(times >= end[FEWEST_ASIDE - 1]) & (times <= start[-FEWEST_ASIDE])])

    def _step(self, number: int) -> Alternative | None:
        times = self._times(number)
        if not times.size:
            return None
        others = self._other_than(number)
        found = [self.described(np.concatenate([self._shares(number, t), others], axis=1)) for t in times.tolist()]
        evidence = np.array([self.evidence(item) for item in found])
        best = int(np.argmax(evidence))
        inside = times[evidence >= evidence[best] - 0.5 * CRITICAL]
        chosen = found[best]
        return Alternative(
            number, False, float(times[best]), self._to_windows(number, float(inside[0]), float(inside[-1])),
            float(evidence[best]), float(chosen.values[0]), float(chosen.values[1]),
            (float(chosen.deviation[0]), float(chosen.deviation[1])),
        )  # fmt: skip

    def _line(self, number: int) -> Alternative:
        own = self.sizes.recording == number
        first, last = float(self.sizes.start[own].min()), float(self.sizes.end[own].max())
        found = self.described(np.concatenate([self._ends(number), self._other_than(number)], axis=1))
        return Alternative(
            number, True, 0.5 * (first + last), (first, last), self.evidence(found), float(found.values[0]),
            float(found.values[1]), (float(found.deviation[0]), float(found.deviation[1])),
        )  # fmt: skip

    def _ends(self, number: int) -> Array:
        """(W, 2) shares of the sizes at the start and at the end of a recording in that of each window on a line."""
        own = self.sizes.recording == number
        middle = 0.5 * (self.sizes.start + self.sizes.end)
        first, last = float(self.sizes.start[own].min()), float(self.sizes.end[own].max())
        share = (middle - first) / (last - first)
        return np.stack([own * (1.0 - share), own * share], axis=1)

    def _to_windows(self, number: int, low: float, high: float) -> tuple[float, float]:
        """An interval widened to the windows that its ends lie in, at an edge to both, and to the gaps beside these."""
        own = self.sizes.recording == number
        start, end = np.sort(self.sizes.start[own]), np.sort(self.sizes.end[own])
        before, after = start[start < low], end[end > high]
        low, high = float(before[-1]) if before.size else low, float(after[0]) if after.size else high
        # between windows nothing is known of when it was
        earlier, later = end[end <= low + _SAME], start[start >= high - _SAME]
        return float(earlier[-1]) if earlier.size else low, float(later[0]) if later.size else high


def _scatter(sizes: WindowSizes, found: Alternative) -> float:
    """Variance of the sizes by window with which what a change leaves is what is expected; 0 where less is left."""

    def excess(scatter: float) -> float:
        regression = TimeRegression(sizes, scatter)
        design = regression.design(found)
        return float(regression.described(design).left - (sizes.count - design.shape[1]))

    low, high = 0.0, 1.0 / max(float(np.median(np.diag(sizes.information))), _SMALLEST)
    if excess(0.0) <= 0.0:
        return 0.0
    while excess(high) > 0.0 and high < 1.0 / _SMALLEST:
        low, high = high, 4.0 * high
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) > 0.0 else (low, middle)
    return high
