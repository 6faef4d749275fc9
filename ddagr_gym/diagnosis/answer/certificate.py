"""What a diagnosis says about drives that its sizes were not fitted to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Folds = Literal["by recording", "by time"]
"""What is left out of the fit and predicted in turn: recordings, or halves of the only one."""


@dataclass(frozen=True)
class Measured:
    """A number that was measured on drives, with its doubt.

    Attributes:
        value: over all predictions.
        interval: 90 %, by resampling stretches of the drives; null with a single stretch.
    """

    value: float
    interval: tuple[float, float] | None = None


@dataclass(frozen=True)
class ModelErrors:
    """Errors of one quantity at one horizon, root mean squares over the predictions.

    Attributes:
        raw: of the nominal simulator as it stands.
        refitted: of the nominal simulator with its soil and robot refitted.
        corrected: of the simulator with the named effects; the refitted one where there are none.
        black_box: of a ridge regression and a forest on top of the refitted simulator.
        ceiling: of the best of these, the raw one apart, and of the same regression on top of the corrected simulator.
            It is chosen on the drives that judge, so that shares of it are rather too small than too large.
        unit: of the errors.
        count: how many predictions.
    """

    raw: Measured
    refitted: Measured
    corrected: Measured
    black_box: Measured
    ceiling: Measured
    unit: str
    count: int


@dataclass(frozen=True)
class Gains:
    """Share of the refitted model's error that a model saves; negative where it predicts worse.

    Attributes:
        corrected: with the named effects.
        black_box: the regression on top of the refitted simulator.
        ceiling: the best of all.
    """

    corrected: Measured
    black_box: Measured
    ceiling: Measured


@dataclass(frozen=True)
class Certificate:
    """Errors on drives that the models were not fitted to.

    Every recording is predicted by models whose sizes and nominal parameters were fitted to the others; a single one by
    its halves. A prediction starts from the state that a fit to the 2 s before it gives, with the recorded commands,
    and is compared 1, 5 and 30 s later: channels as means over the last half second, `position` and `speed` by the
    poses, `heading_by_gyro` as the integral of the gyro. Biases of a recording that a fit has not seen are zero. Where
    the gain of the corrected model is certainly negative at some horizon and certainly positive at none, `complete` is
    false and the sentence says so.

    Attributes:
        folds: "by recording", or "by time" where there is only one, which is weaker: place, day and biases are the
            same.
        note: that, and which horizons no drive was long enough for, in words.
        horizons: [s].
        level: of the intervals.
        channels: errors by quantity and horizon ("1").
        gain: by horizon, as a mean over position, speed, heading and yaw rate, each error relative to the refitted
            model's; null where none of them was measured.
        gain_readings: the same over the eight channels.
        gain_share: by horizon, share of what the ceiling gains over the refitted model that the named effects gain,
            over the same quantities as `gain`. It can be negative. Null where not even the ceiling gains 3 %, where its
            gain is not certain, or where all names were seen in the values and mended before any model (repeats, a
            reversed gyro).
        gain_share_readings: the same over the eight channels.
    """

    folds: Folds
    note: str
    horizons: tuple[float, ...]
    level: float
    channels: Mapping[str, Mapping[str, ModelErrors]]
    gain: Mapping[str, Gains | None]
    gain_readings: Mapping[str, Gains | None]
    gain_share: Mapping[str, Measured | None]
    gain_share_readings: Mapping[str, Measured | None]
