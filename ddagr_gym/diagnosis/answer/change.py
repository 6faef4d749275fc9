"""What changed against a robot's ordinary drives: the part of an answer that a calibration adds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class SizeShift:
    """How far one size of an effect is from what it is in ordinary drives.

    Attributes:
        value: shift of the estimate, with all effects but this one at nothing, in unit.
        deviation: of the shift: within the drive, between ordinary drives, and of their mean.
        unit: SI.
        least_detectable: shift that would be found in 80 % of such drives with 5 % false alarms over the whole library;
            null where none that exists would be.
        before: estimate in ordinary drives, as a distance from neutral; what their simulator has wrong is in it.
    """

    value: float
    deviation: float
    unit: str
    least_detectable: float | None
    before: float = 0.0


@dataclass(frozen=True)
class EffectShift:
    """One effect of the library, compared with ordinary drives.

    Attributes:
        effect: name.
        distance: of its sizes from those of ordinary drives, in standard deviations of all that makes them differ.
        limit: distance that ordinary drives exceed for any effect of the library in 5 % of the cases.
        probability: that an ordinary drive shows such a distance in any effect of the library.
        degrees: of freedom of the scatter between ordinary drives.
        sizes: by field.
    """

    effect: str
    distance: float
    limit: float
    probability: float
    degrees: float
    sizes: Mapping[str, SizeShift]


@dataclass(frozen=True)
class ParameterShift:
    """A parameter of the calibrated robot or of its ground, and its estimate in this drive.

    Attributes:
        name: of the parameter.
        unit: of both; "-" stands for the logarithm of a factor.
        change: from the calibrated value, fitted without any effect.
        with_effects: the same beside the named effects.
        expected_deviation: by which ordinary drives differ from the calibrated value.
    """

    name: str
    unit: str
    change: float
    with_effects: float
    expected_deviation: float


@dataclass(frozen=True)
class ChannelShift:
    """What a fit leaves of a channel, against the same of ordinary drives.

    Attributes:
        channel: its name.
        before: mean square of the weighted residuals in ordinary drives (geometric mean).
        without_effects: the same in this drive, fitted without any effect.
        with_effects: the same beside the named effects.
        limit: that ordinary drives exceed, in any effect, parameter or channel, in 5 % of the cases.
    """

    channel: str
    before: float
    without_effects: float
    with_effects: float
    limit: float

    @property
    def rougher(self) -> bool:
        """Whether more is left than of ordinary drives."""
        return self.with_effects > self.limit

    @property
    def times(self) -> float:
        """Root mean square of what is left, over that of ordinary drives."""
        return math.sqrt(self.with_effects / self.before)


@dataclass(frozen=True)
class SlopeBefore:
    """Slope of the ground in the drives before.

    Attributes:
        angle: of inclination [rad].
        direction: of steepest ascent, from the world's x axis counter-clockwise [rad].
        deviation: by which the angle may be another one in the drives after [rad].
    """

    angle: float
    direction: float
    deviation: float


@dataclass(frozen=True)
class ChangeCertificate:
    """How well the drives are forecast with what changed, beside how well ordinary ones are.

    Windows are forecast from the readings at their start by fits to the other half of the windows. A loss is the mean
    over the samples of a window of half the square of the residual over its usual size, linear for large ones.

    Attributes:
        windows: that were forecast.
        as_well: of them, that are forecast as well as `expected` of the ordinary drives' windows are.
        as_well_without: the same without what changed.
        expected: share of ordinary windows that counts as well.
        ordinary_windows: of ordinary drives, forecast by the same rule.
        limit: largest loss of `expected` of them.
        losses: quartiles with what changed.
        losses_without: the same without it.
        losses_of_ordinary: the same of ordinary drives.
    """

    windows: int
    as_well: int
    as_well_without: int
    expected: float
    ordinary_windows: int
    limit: float
    losses: tuple[float, float, float]
    losses_without: tuple[float, float, float]
    losses_of_ordinary: tuple[float, float, float]


CALIBRATION = "calibration"
BEFORE = "before"


@dataclass(frozen=True)
class Change:
    """What changed against the ordinary drives of a calibrated robot, or against drives from before.

    Attributes:
        ground: of the calibration that the drive was taken to be on, or "same" as before; "" where it was not known.
        ordinary: names of the ordinary drives that it was compared with.
        level: of false alarms over the whole library.
        power: with which a least detectable shift is found.
        windows: that were compared.
        shifts: of every effect, the most conspicuous first.
        parameters: of robot and ground.
        hidden: effects of which no size that exists would have been found in such drives.
        not_compared: effects that were not looked for, with the reason.
        against: "calibration", or "before" for drives that were given with `--before`.
        certificate: whether the drives are forecast as well with what changed as ordinary ones are; null where the
            calibration was made before that was kept.
        channels: what is left of each channel; only where drives from before on the same ground were given.
        slope: of the ground in drives from before, taken to be there in the drives after too; a `slope` that is named
            comes on top of it. Null where the poses do not tell it.
    """

    ground: str
    ordinary: tuple[str, ...]
    level: float
    power: float
    windows: int
    shifts: tuple[EffectShift, ...]
    parameters: tuple[ParameterShift, ...]
    hidden: tuple[str, ...]
    not_compared: Mapping[str, str]
    against: str = CALIBRATION
    certificate: ChangeCertificate | None = None
    channels: tuple[ChannelShift, ...] = ()
    slope: SlopeBefore | None = None
