"""Thresholds of the gate: what drives with nothing missing reach, by effect and overall.

They come from the null bank (:mod:`ddagr_gym.diagnosis.null_bank.bank`); nothing is set by hand except the levels at
which its quantiles are taken, and margins for simulators that nobody thought of.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.identification.nuisances import LOCAL

LEVEL = 0.05
"""False alarms that a gate lets through, over the whole library (theory: diagnosis, eq. (6); ours)."""

_UPPER = 0.1  # share of the null runs whose mean scales an effect

NOISE_GAIN = 8.0
"""Gain that noise alone reaches in the largest of 28 effects: half the 99.8 percent quantile of chi-square with two to
three degrees of freedom is 6.3 to 7.4."""

MARGIN = 1.5
"""Factor on the gates of effects on commands, motors and sensors for structures that no bank has: what 40 nulls of the
project's own blind generator (which shares no code with the bank) reach with a size that matters stays below the bank's
own gates, the least of the single effects that show stands 3.3 times over them."""

GROUND_MARGIN = 3.5
"""The same for effects that act through wheels and soil, which another soil law imitates: there those nulls reach
2.9 times the bank's own gates (patches, ruts), the next of the effects that show 7.8 times."""

THROUGH_GROUND = ("robot", "ground")
"""Groups of effects with that margin."""

CLEAR = 2.0
"""Gain over the gate above which an effect is named even if it says nothing about windows that were left out: a patch
that a drive crosses once is in none of them."""

UNMISTAKABLE = 3.0
"""Gain over the gate above which an effect is named even below its least meaningful size."""

LOCAL_MARGIN = 4.0
"""The same on the misfit of the local variations: those nulls reach 1.9 times the bank's limits, effects that no
library has and that show there 8 to 200 times."""

MISFIT_MARGIN = 1.7
"""The same on the misfit of the channels: 0.74 times and, where it shows there, 3.9 to 36 times."""

POWER = 1.2816
"""Standard deviations by which a score has to lie above its gate to pass nine times in ten."""

SHORT_WINDOW = 2.0
"""Windows of banks that do not say how long theirs are [s]."""

VERSION = 1
"""Of the file of thresholds: raised when an entry goes or changes its meaning."""

NullKind = Literal["simulated", "ordinary"]
"""What null drives are: simulated ones, or real drives in which nothing is wrong, in pieces and longer."""


class Scores(Protocol):
    """What a scan says by effect."""

    @property
    def held_out(self) -> dict[str, float]: ...  # noqa: D102


@dataclass(frozen=True)
class Gate:
    """Least values for one effect.

    Attributes:
        gain: fall of the cost over the dispersion.
        held_out: gain on left-out windows.
    """

    gain: float
    held_out: float

    @property
    def detectable(self) -> float:
        """Expected gain of a size that passes nine times in ten (theory: diagnosis, eq. (11)).

        A gain is half the square of a score with variance 1: a size whose expected gain just reaches the gate is missed
        every other time.
        """
        return 0.5 * (math.sqrt(2.0 * self.gain) + POWER) ** 2

    @property
    def detectable_below_least(self) -> float:
        """The same of a size below its least meaningful one, which only an unmistakable gain names."""
        return Gate(UNMISTAKABLE * self.gain, self.held_out).detectable


@dataclass(frozen=True)
class Origin:
    """What a bank was made for, and of what.

    Attributes:
        robot: name of the nominal one.
        soil: name of the nominal one.
        soil_uncertainty: factor on how far the soil may be from the nominal one.
        seed: of the bank.
        kind: of its drives.
    """

    robot: str
    soil: str
    soil_uncertainty: float
    seed: int
    kind: NullKind

    def mismatch(self, robot: str, soil: str, soil_uncertainty: float) -> str:
        """Warning that a run is of something else, with the remedy; empty where it is not.

        Args:
            robot: of the run.
            soil: of the run.
            soil_uncertainty: of the run.
        """
        pairs = (
            ("robot", self.robot, robot),
            ("soil", self.soil, soil),
            ("soil uncertainty", f"{self.soil_uncertainty:g}", f"{soil_uncertainty:g}"),
        )
        others = [f"{name} {own} instead of {given}" for name, own, given in pairs if own != given]
        if not others:
            return ""
        options = f"--robot {robot} --soil {soil} --soil-uncertainty {soil_uncertainty:g}"
        return (
            f"the thresholds were made for {', '.join(others)}: make others with `ddagr null-bank RUN... {options} "
            "--output BANK.json` and give them as --thresholds BANK.json."
        )


@dataclass(frozen=True)
class Thresholds:
    """Gates by effect, and where they come from.

    Attributes:
        gates: by name of the effect.
        misfit: mean square of the residuals by channel, above which something is missing.
        nulls: null runs that they were taken from.
        bank: hash of the bank's data.
        level: of false alarms over the whole library.
        maxima: of each null run, the largest gain over its gate, in increasing order.
        windows: that cover as much time as those of a null run (median); 0 where unknown.
        duration: of these windows [s], median over the runs; diagnoses with the thresholds cut recordings in the same
            way.
        origin: of the bank; None where unknown.
    """

    gates: Mapping[str, Gate]
    misfit: Mapping[str, float]
    nulls: int
    bank: str
    level: float = LEVEL
    maxima: tuple[float, ...] = ()
    windows: float = 0.0
    duration: float = SHORT_WINDOW
    origin: Origin | None = None

    @property
    def of_ordinary_drives(self) -> bool:
        """Whether the question is what differs from ordinary drives, not what the simulator lacks."""
        return self.origin is not None and self.origin.kind == "ordinary"

    def for_length(self, seconds: float) -> Thresholds:
        """The same for recordings of another length.

        What a null run reaches beyond noise comes from the structure of the simulator and grows with the time that the
        windows cover; what noise reaches does not.

        Args:
            seconds: that all windows cover together.
        """
        covered = self.windows * self.duration
        if covered <= 0.0:
            return self
        share = seconds / covered
        gates = {
            name: Gate(max(float(gain_at_length(gate.gain, share)), NOISE_GAIN), gate.held_out * share)
            for name, gate in self.gates.items()
        }
        return replace(self, gates=gates, windows=seconds / self.duration)

    def raised(self, by: Mapping[str, float]) -> Thresholds:
        """The same with gates that lie higher by a gain, by name of the effect."""
        gates = {name: replace(self.of(name), gain=self.of(name).gain + more) for name, more in by.items()}
        return replace(self, gates={**self.gates, **gates})

    def p_value(self, name: str, gain: float) -> float | None:
        """Share of null runs in which some effect stands as high over its gate, the run at hand counted with them.

        Theory: diagnosis, eq. (8).

        None without a bank that kept its runs.
        """
        if not self.maxima:
            return None
        above = sum(value >= gain / self.of(name).gain for value in self.maxima)
        return (1 + above) / (1 + len(self.maxima))

    def of(self, name: str) -> Gate:
        """Gate of an effect; one that the bank did not know has the strictest of all."""
        if name in self.gates:
            return self.gates[name]
        every = list(self.gates.values())
        return Gate(max(g.gain for g in every), max(g.held_out for g in every))

    def passes(self, name: str, gain: float, scan: Scores) -> bool:
        """Whether an effect explains more than in drives with nothing missing, on left-out windows too.

        The cluster-robust score is reported but gates nothing: it saturates at the root of the number of windows that
        show an effect, and a limit that is reached in four of them scores less than noise in all (measured: 1.9 for a
        speed limit of gain 1866, 3 for the best of the nulls).
        """
        gate = self.of(name)
        if gain > CLEAR * gate.gain:
            return True
        return gain > gate.gain and scan.held_out.get(name, 0.0) > gate.held_out


def gain_at_length(gain: float | NDArray[np.float64], share: float | NDArray[np.float64]) -> NDArray[np.float64]:
    """Gain that the same structure reaches in drives of another length; what noise alone reaches stays.

    Theory: diagnosis, eq. (7).

    Args:
        gain: any shape.
        share: of the other length in the own one, broadcast against it.
    """
    return np.where(np.asarray(gain) > NOISE_GAIN, NOISE_GAIN + (gain - NOISE_GAIN) * share, gain)


@dataclass(frozen=True)
class NullRun:
    """What one null run reached.

    Attributes:
        kind: of the structural change.
        gains: by effect.
        scores: by effect.
        held_out: by effect.
        misfit: mean square of the residuals by channel.
        windows: of the run.
        meaningless: effects that would be of less than their least meaningful size.
        duration: of its windows as they were cut [s], shorter than asked for where drives are short.
        own: whether it shares no time with another run: only such runs say how often a gate is passed.
    """

    kind: str
    gains: dict[str, float]
    scores: dict[str, float]
    held_out: dict[str, float]
    misfit: dict[str, float]
    windows: int = 0
    meaningless: tuple[str, ...] = ()
    duration: float = SHORT_WINDOW
    own: bool = True

    def evidence(self, name: str) -> float:
        """Gain of an effect that counts against its gate: below its least meaningful size only a multiple passes."""
        gain = max(self.gains.get(name, 0.0), 0.0)
        return gain / UNMISTAKABLE if name in self.meaningless else gain


def false_alarms(runs: Sequence[NullRun], thresholds: Thresholds) -> int:
    """Null runs in which some effect passes thresholds, brought to the length of each run.

    Args:
        runs: of a bank, which may be another one than the thresholds were taken from.
        thresholds: of the gates.
    """

    def passed(run: NullRun) -> bool:
        gates = thresholds.for_length(run.windows * run.duration)
        return any(gates.passes(name, run.evidence(name), run) for name in run.gains)

    return sum(map(passed, runs))


def least_nulls(level: float = LEVEL) -> int:
    """Null runs that a level of false alarms takes at least."""
    return math.ceil(1.0 / level)


def thresholds_from(
    runs: Sequence[NullRun], bank: str, level: float = LEVEL, origin: Origin | None = None
) -> Thresholds:
    """Gates such that the share ``level`` of null runs passes any of them, and strangers' nulls hardly more.

    Theory: diagnosis, eq. (5), (6).

    Gains of an effect are divided by the mean of their largest tenth over the runs, or by what noise alone reaches; the
    quantile of the largest of these ratios over all effects then widens all gates alike (a max-statistic correction for
    the size of the library), and so does the margin for simulators that nobody thought of. Runs of different lengths
    are brought to the median one first, as the gates are for a diagnosis (:meth:`Thresholds.for_length`).

    Args:
        runs: as many as :func:`least_nulls` says, or more.
        bank: hash of what they depend on.
        level: of false alarms over the whole library.
        origin: of the bank.

    Raises:
        InputError: too few runs for the level.
    """
    own = np.array([run.own for run in runs], dtype=bool)
    if own.sum() < least_nulls(level):
        raise InputError(f"{own.sum()} null runs cannot give a level of {level:g}: make at least {least_nulls(level)}.")
    names = sorted({name for run in runs for name in run.gains})
    covered = np.array([run.windows * run.duration for run in runs])
    usual = float(np.median(covered[covered > 0.0])) if covered.any() else 0.0
    share = np.where(covered > 0.0, usual / np.maximum(covered, 1e-9), 1.0)
    table = gain_at_length(np.array([[run.evidence(name) for name in names] for run in runs]), share[:, None])
    scale = np.maximum(_upper_mean(table), NOISE_GAIN)
    widest = max(float(np.quantile((table / scale)[own].max(axis=1), 1.0 - level)), 1.0)
    widening = widest * np.array([_margin(name) for name in names])
    unseen_gains = np.array([[run.held_out.get(name, 0.0) for name in names] for run in runs]) * share[:, None]
    # the gain carries the level; the gain on left-out windows refuses what few of them carry, at the nulls' median
    least = np.maximum(np.median(unseen_gains, axis=0), 0.0)
    gates = {name: Gate(float(widening[k] * scale[k]), float(least[k])) for k, name in enumerate(names)}
    maxima = np.sort((table / (widening * scale))[own].max(axis=1))
    duration = float(np.median([run.duration for run in runs]))
    windows = usual / duration
    limits = _misfit_limits(runs, level)
    return Thresholds(gates, limits, int(own.sum()), bank, level, tuple(maxima.tolist()), windows, duration, origin)


def _upper_mean(table: NDArray[np.float64]) -> NDArray[np.float64]:
    """(K,) mean of the largest tenth of (N, K) runs: steadier than a quantile, which three runs of sixty decide."""
    count = max(math.ceil(_UPPER * len(table)), 1)
    return np.asarray(np.sort(table, axis=0)[-count:].mean(axis=0))


def _margin(name: str) -> float:
    """Margin of an effect; one that is not in the library has the wider."""
    from ddagr_gym.physics.effects.registry import effect_kinds

    kind = effect_kinds().get(name)
    return GROUND_MARGIN if kind is None or kind.group in THROUGH_GROUND else MARGIN


def _misfit_limits(runs: Sequence[NullRun], level: float) -> dict[str, float]:
    """Limits that the share ``level`` of null runs passes in any channel.

    Longer runs count beside the pieces that they share their time with: drives to be diagnosed are as long, and means
    over more windows scatter less.
    """
    channels = sorted({name for run in runs for name in run.misfit})
    # a run without a receiver says nothing about poses
    table = np.array([[run.misfit.get(name, np.nan) for name in channels] for run in runs])
    scale = np.maximum(np.nanquantile(table, 1.0 - level, axis=0), 1e-6)
    widening = float(np.quantile(np.nanmax(table / scale, axis=1), 1.0 - level))
    margin = [LOCAL_MARGIN if name in LOCAL else MISFIT_MARGIN for name in channels]
    return {name: margin[k] * max(widening, 1.0) * float(scale[k]) for k, name in enumerate(channels)}
