"""Where something is, as the answer of a diagnosis says it: stretches, operating conditions, places, missing force."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

CONDITION_LEVEL = 0.05
"""Level of the test over all operating conditions at once, below which one is put in words: the usual five percent."""

CONDITION_EXCESS = 0.25
"""Share of something beyond the share of the time from which an operating condition is put in words (ours: 65 % of it
in 40 % of the time; less is of no use to somebody who looks for the cause)."""


@dataclass(frozen=True)
class Span:
    """A stretch of one recording in which an effect shows.

    Attributes:
        recording: its number, from 0.
        start: time of the recording [s].
        end: the same.
        share: of the effect's whole gain; of held readings, of all repeats.
        size: over the fitted size [-].
        deviation: standard deviation of that.
    """

    recording: int
    start: float
    end: float
    share: float
    size: float
    deviation: float


@dataclass(frozen=True)
class OperatingConditionShare:
    """How a gain or a mismatch lies over one operating condition (speed, slip, command, heading, place ...).

    Attributes:
        name: of :data:`ddagr_gym.diagnosis.localisation.operating_conditions.CONDITIONS`, or "place".
        unit: of the edges.
        edges: of the bins, each with about as much time; of a place its centre and radius (x, y, r).
        time_share: share of the driven time in each bin; of a place the disc's.
        weight_share: share of the gain or the mismatch in each bin.
        low: end of the range that stands out; null where it is open.
        high: the same.
        excess: share of the weight less share of the time in that range.
        weight_inside: share of the weight in it.
        time_inside: share of the time in it.
        p: probability of an excess as large in any operating condition, by shifting the weights along the recordings.
    """

    name: str
    unit: str
    edges: tuple[float, ...]
    time_share: tuple[float, ...]
    weight_share: tuple[float, ...]
    low: float | None
    high: float | None
    excess: float
    weight_inside: float
    time_inside: float
    p: float

    @property
    def clear(self) -> bool:
        """Whether its excess is large and no chance."""
        return self.p < CONDITION_LEVEL and self.excess >= CONDITION_EXCESS

    @property
    def stands_out(self) -> bool:
        """Whether it is worth a phrase: clear, and in a range that is not all of it."""
        bounded = self.name == "place" or self.low is not None or self.high is not None
        return bounded and self.clear


@dataclass(frozen=True)
class Place:
    """A disc or a band in which something acts.

    Attributes:
        x: of its centre, world [m].
        y: the same.
        radius: [m]; of a band half its width.
        share: of the gain in it; null for a place that was fitted.
        time_share: share of the driven time in it; null the same.
        half_length: of the middle line of a band, without its round ends [m]; 0 for a disc.
        bearing: of that line, from the world's x axis counter-clockwise [rad].
    """

    x: float
    y: float
    radius: float
    share: float | None = None
    time_share: float | None = None
    half_length: float = 0.0
    bearing: float = 0.0


@dataclass(frozen=True)
class Unevenness:
    """An operating condition in which the size of an effect differs from that elsewhere.

    Attributes:
        name: of the operating condition.
        unit: of the limits.
        low: end of the range; null where it is open.
        high: the same.
        size_inside: over the fitted size [-].
        size_outside: the same.
        p: probability of a difference as clear in any operating condition.
    """

    name: str
    unit: str
    low: float | None
    high: float | None
    size_inside: float
    size_outside: float
    p: float


@dataclass(frozen=True)
class EffectLocation:
    """Where something acts.

    Attributes:
        spans: stretches of time, of effects only; of held readings the stretches in which they repeat.
        time_share: share of the driven time that the spans cover.
        regimes: how it lies over each operating condition, what stands out first.
        places: where it is bound to a place.
        uneven: operating condition in which its size is not what it is elsewhere; null where none is.
        phrase: in words.
    """

    spans: tuple[Span, ...]
    time_share: float
    regimes: tuple[OperatingConditionShare, ...]
    places: tuple[Place, ...]
    uneven: Unevenness | None
    phrase: str


@dataclass(frozen=True)
class ChannelShare:
    """What is left of one channel.

    Attributes:
        nominal: mean square of the standardised residual of the refitted nominal model.
        corrected: the same of the model with the named effects.
        floor: what noise alone leaves: 1, or less where the windows' unknowns take a share away.
        share: of the channel in the mismatch above the floors.
    """

    nominal: float
    corrected: float
    floor: float
    share: float


@dataclass(frozen=True)
class WrenchSummary:
    """Residual force or moment over all windows, each with the weight of its precision.

    Attributes:
        component: F_x, F_y or M_z, body axes at the body origin.
        unit: of the numbers.
        before: mean that the nominal model lacks as it stands.
        after: the same of the corrected model.
        deviation: standard deviation of both.
        chi_before: root mean square over the standard deviation; about 1 where nothing is missing.
        chi_after: the same of the corrected model.
    """

    component: str
    unit: str
    before: float
    after: float
    deviation: float
    chi_before: float
    chi_after: float


@dataclass(frozen=True)
class Localisation:
    """Where the mismatch is.

    Attributes:
        channels: what is left of each channel, by name.
        explained: share of the mismatch that the names explain: of what stands above three quarters of the null bank's
            limits (the roughest channel of blind drives in which nothing was found reached 0.61 of its limit at most),
            summed over the channels in units of the limits: what is less is taken for noise on both sides. The sentence
            and the page say the same, but nothing where all names were seen in the values; null where there is none.
        mismatch: where the names explain what the nominal model leaves; without a name, where that is.
        remaining: where what is left beside the names is.
        findings: where each named effect acts, by name.
        wrench: residual force and moment.
    """

    channels: Mapping[str, ChannelShare]
    explained: float | None
    mismatch: EffectLocation
    remaining: EffectLocation
    findings: Mapping[str, EffectLocation]
    wrench: tuple[WrenchSummary, ...]
