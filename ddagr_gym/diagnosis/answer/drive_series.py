"""Many drives of one robot, each against its calibration.

``docs/drive_series_schema.md`` is made of these classes' docstrings.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ddagr_gym.diagnosis.answer.verdict import Diagnosis, Finding

SERIES_SCHEMA = "ddagr-drives/1"
"""Name and version: raised whenever an entry is renamed, removed or changes its meaning."""

BY_TIME = "time"
BY_NAME = "name"

STAYS = "stays"
PASSES = "passes"
SINGLE = "single"
LAST = "last"

PARAMETER = ""
"""Effect of a size that is a parameter of robot or ground."""


@dataclass(frozen=True)
class SizePoint:
    """One size in one drive.

    Attributes:
        effect: that it is a size of; "" for a parameter of robot or ground.
        size: name of the size.
        unit: SI; "-" for a factor, of a parameter for its logarithm.
        value: shift from the mean of ordinary drives, with all other effects at nothing.
        deviation: of the shift, without that of the mean: within the drive and between ordinary drives.
        mean_deviation: of the mean of ordinary drives, which all drives share.
        degrees: of freedom of the scatter between ordinary drives.
        ordinary: the same shift in each ordinary drive.
    """

    effect: str
    size: str
    unit: str
    value: float
    deviation: float
    mean_deviation: float
    degrees: float
    ordinary: tuple[float, ...]


@dataclass(frozen=True)
class DriveAnswer:
    """What is kept of one drive.

    Attributes:
        diagnosis: the whole answer.
        points: of all sizes.
        seconds: of the recording.
        started: clock reading at its first row [s]; 0 where it has none.
        left_out: whether it is one of the ordinary drives, and was compared with the others.
    """

    diagnosis: Diagnosis
    points: tuple[SizePoint, ...]
    seconds: float
    started: float
    left_out: bool


@dataclass(frozen=True)
class DriveRow:
    """One drive of the folder.

    Attributes:
        drive: name of its file.
        sha256: of the file; "" where it could not be read.
        started: date and time (UTC) of the first row; null where the recording has no clock that counts from 1970.
        minutes: length; null for a refused one.
        refused: whether it has no answer.
        verdict: names of effects, or `["none"]`, or `["unknown"]`; empty for a refused one.
        complete: whether nothing else is out of the ordinary; null for a refused one.
        probability: that an ordinary drive shows as much in any effect of the library; null for a refused one.
        findings: one per name, as in `diagnosis.json`.
        sentence: the answer, or why there is none.
        left_out: whether it is one of the ordinary drives, and was compared with the others.
    """

    drive: str
    sha256: str
    started: str | None
    minutes: float | None
    refused: bool
    verdict: tuple[str, ...]
    complete: bool | None
    probability: float | None
    findings: tuple[Finding, ...]
    sentence: str
    left_out: bool = False


@dataclass(frozen=True)
class ChartPoint:
    """One drive in the control chart of a size.

    Attributes:
        drive: number of its row, from 0.
        value: shift from the mean of ordinary drives.
        limit: distance from 0 that ordinary drives exceed in any size and drive of the charts in 5 % of such folders.
        average: exponentially weighted mean of the shifts up to this drive.
        average_limit: the same limit of that mean.
    """

    drive: int
    value: float
    limit: float
    average: float
    average_limit: float

    @property
    def outside(self) -> bool:
        """Whether the drive alone is out of the ordinary."""
        return abs(self.value) > self.limit

    @property
    def average_outside(self) -> bool:
        """Whether the mean is."""
        return abs(self.average) > self.average_limit


@dataclass(frozen=True)
class SizeChart:
    """Control chart of one size.

    Attributes:
        effect: that it is a size of; "" for a parameter of robot or ground.
        size: name of the size.
        unit: of values and limits; "-" for a factor, of a parameter for its logarithm.
        ordinary: values of the ordinary drives.
        points: in the order of the drives.
    """

    effect: str
    size: str
    unit: str
    ordinary: tuple[float, ...]
    points: tuple[ChartPoint, ...]


@dataclass(frozen=True)
class MovedSize:
    """A size that an event moved.

    Attributes:
        effect: that it is a size of; "" for a parameter of robot or ground.
        size: name of the size.
        unit: of the shift.
        shift: of the drives that the event concerns against all others, ordinary ones included.
        deviation: of the shift.
        distance: in deviations.
        probability: that ordinary drives show as much, in any size and at any drive.
    """

    effect: str
    size: str
    unit: str
    shift: float
    deviation: float
    distance: float
    probability: float


@dataclass(frozen=True)
class SeriesEvent:
    """Something changed at a drive.

    Attributes:
        kind: "stays" from this drive on, "passes": it is over after some drives, "single": this drive alone, or "last":
            the last drive, so that nobody knows.
        drive: number of the first row that it concerns, from 0.
        last: number of the last one.
        earliest: number of the first row at which it may as well have begun (90 %).
        latest: of the last.
        probability: that drives in which nothing changed show as much, in any size and at any drive.
        small: whether every shift is within what single ordinary drives differ by: it shows since it stays, and another
            ground or load, or wear, looks alike.
        moved: sizes, the most certain first. One change moves the sizes of several effects.
        drives: how many answered drives it concerns, up to the next event that stays.
        names: of effects, with how many of these drives name them or have them in an equivalence set.
    """

    kind: str
    drive: int
    last: int
    earliest: int
    latest: int
    probability: float
    small: bool
    moved: tuple[MovedSize, ...]
    drives: int
    names: Mapping[str, int]


@dataclass(frozen=True)
class DriveSeries:
    """Many drives of one robot, each against its calibration.

    Attributes:
        sentence: the first drive at which something changed, and what.
        robot: name of the calibrated one.
        calibration: name of its folder.
        ground: that all drives were taken to be on; "" where it was not known.
        ordinary: names of the ordinary drives.
        order: "time" where every drive has a clock, else by file "name".
        level: of false alarms: of each drive over the whole library, of the charts over all sizes and drives, of the
            events over all sizes and all drives at which they could be.
        weight: of the newest drive in the exponentially weighted mean.
        rows: drives in their order.
        charts: sizes, those that moved first.
        events: in the order of the drives.
        version: of the package.
        schema: name and version of the file's form.
    """

    sentence: str
    robot: str
    calibration: str
    ground: str
    ordinary: tuple[str, ...]
    order: str
    level: float
    weight: float
    rows: tuple[DriveRow, ...]
    charts: tuple[SizeChart, ...]
    events: tuple[SeriesEvent, ...]
    version: str
    schema: str = SERIES_SCHEMA
