"""The one form of a drive: real ones, bags and simulated ones alike.

A :class:`Recording` is a structure of arrays with one row per instant of its time base.

Conventions
    Units are SI and radians; axes follow REP 103 (x forward, y left, z up, yaw counter-clockwise).
    Banks are ordered right, left. ``t`` starts at 0 and increases strictly.
    NaN in a channel means "no new sample at this row": a value that a logger merely repeats is NaN here.
    Accelerometers give raw specific force: gravity is in z (+9.8) when the robot stands level.

Index ranges (half open, ``(start, stop)``)
    *segments* hold every sample of the time base; between two of them samples are missing.
    *spans* are one or more segments that share one clock and one pose frame: elapsed time and pose
    differences mean something inside a span and nothing across two.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.parameters import Robot
from ddagr_gym.recordings.channels import CHANNELS
from ddagr_gym.recordings.doubts import doubts
from ddagr_gym.recordings.plausible import check_extent, check_magnitude, check_stamps
from ddagr_gym.recordings.row_times import GAP_IN_PERIODS, longest_period, row_period

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
Ranges = tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class RobotGeometry:
    """What body-speed commands and scale checks need of a robot.

    Attributes:
        name: of the robot.
        wheel_radius: hub to tread [m].
        half_track: body centre to wheel plane [m].
    """

    name: str
    wheel_radius: float
    half_track: float

    def __post_init__(self) -> None:
        for label in ("wheel_radius", "half_track"):
            value = getattr(self, label)
            if not (isinstance(value, int | float) and math.isfinite(value) and 0 < value < 10):
                raise InputError(f"RobotGeometry.{label} is {value!r}: give metres between 0 and 10.")

    @classmethod
    def of(cls, robot: Robot) -> RobotGeometry:
        """Geometry of a robot; the wheel radius is the mean of its four outer radii."""
        return cls(robot.name, robot.outer_radius, robot.half_track)


def bank_speeds(forward: Any, turn: Any, geometry: RobotGeometry) -> tuple[Any, Any]:
    """Bank speeds (right, left) [rad/s] of a body speed command.

    Args:
        forward: v [m/s].
        turn: w [rad/s], counter-clockwise.
        geometry: wheel radius R and half track W; right = (v + w W)/R, left = (v - w W)/R.
    """
    return (
        (forward + turn * geometry.half_track) / geometry.wheel_radius,
        (forward - turn * geometry.half_track) / geometry.wheel_radius,
    )


@dataclass(frozen=True)
class RecordingMeta:
    """Where a recording came from and how to read it.

    Attributes:
        robot: name of the robot, "" where unknown.
        source: name of the file it came from, or "simulation".
        source_sha256: hash of that file, "" for a simulation.
        column_map: name of the map that was applied, "" for none.
        geometry: wheel radius and half track that converted the commands, None where unknown.
        start_time: clock reading at t = 0 [s], 0 where the source counts from 0.
        segments: index ranges without a missing sample.
        spans: index ranges with one clock and one pose frame.
        held: channels that the source repeats between updates, with the nominal update period [s], 0 if unstated.
        duplicates_dropped: rows left out because their time repeated the row before.
        notes: sentences on every conversion and assumption made on the way in.
    """

    robot: str = ""
    source: str = ""
    source_sha256: str = ""
    column_map: str = ""
    geometry: RobotGeometry | None = None
    start_time: float = 0.0
    segments: Ranges = ()
    spans: Ranges = ()
    held: Mapping[str, float] = field(default_factory=dict)
    duplicates_dropped: int = 0
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Recording:
    """One drive in the schema of this module.

    Attributes:
        t: time [s], (n,), strictly increasing.
        channels: arrays (n,) by name of :data:`CHANNELS`; a channel that the source lacks is absent.
        command_valid: (n,), where the commands are what the robot received.
        meta: provenance and index ranges.
        extras: further arrays (n,), such as a simulator's ``true_...`` columns; nothing downstream needs them.

    Raises:
        InputError: arrays of unequal length, a time that does not increase, unknown channels, bad ranges.
    """

    t: FloatArray
    channels: Mapping[str, FloatArray]
    command_valid: BoolArray
    meta: RecordingMeta
    extras: Mapping[str, FloatArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _check_arrays(self)
        for kind in ("segments", "spans"):
            _check_ranges(kind, getattr(self.meta, kind), len(self.t))

    def __len__(self) -> int:
        return len(self.t)

    def __getitem__(self, name: str) -> FloatArray:
        """Channel by name; all NaN where the source lacks it."""
        if name not in CHANNELS:
            raise unknown_name("channel", name, CHANNELS)
        return self.channels[name] if name in self.channels else np.full(len(self), np.nan)

    def has(self, *names: str) -> bool:
        """Whether every one of the channels holds at least two samples."""
        return all(np.count_nonzero(np.isfinite(self[name])) >= 2 for name in names)

    @cached_property
    def period(self) -> float:
        """Median time between rows inside segments [s], the mean where they come in bursts."""
        return row_period(np.concatenate([np.diff(self.t[a:b]) for a, b in self.meta.segments] or [np.empty(0)]))

    def spans(self) -> Iterator[slice]:
        """Slices with one clock and one pose frame."""
        return (slice(a, b) for a, b in self.meta.spans)

    def segments(self) -> Iterator[slice]:
        """Slices without a missing sample."""
        return (slice(a, b) for a, b in self.meta.segments)

    def rates(self) -> dict[str, float]:
        """New samples per second of each channel inside the spans (median) [Hz]."""
        return {name: self.rate(name) for name in self.channels}

    def rate(self, name: str) -> float:
        """New samples per second of one channel inside the spans (median) [Hz]; 0 where it has none."""
        known = np.isfinite(self[name])
        steps = np.concatenate([np.diff(self.t[s][known[s]]) for s in self.spans()] or [np.empty(0)])
        return float(1.0 / row_period(steps)) if steps.size else 0.0

    def columns(self) -> dict[str, FloatArray]:
        """All columns by name, ``t`` first."""
        return {"t": self.t, **self.channels, **self.extras}

    def validate(self) -> tuple[str, ...]:
        """Sentences on values that are missing or implausible; empty for a sound recording."""
        return tuple(doubts(self))

    def held_commands(self, maximum_age: float = math.inf) -> tuple[FloatArray, FloatArray]:
        """Commands (right, left) in force at every row: the last valid sample of the span, NaN before the first.

        Args:
            maximum_age: age [s] beyond which a command counts as lapsed (NaN).
        """
        valid = self.command_valid
        return _hold(self, "command_right", maximum_age, valid), _hold(self, "command_left", maximum_age, valid)

    def held_encoders(self, maximum_age: float = math.inf) -> tuple[FloatArray, FloatArray]:
        """Bank speeds (right, left) as last read at every row, at most ``maximum_age`` [s] ago; else NaN."""
        return _hold(self, "encoder_right", maximum_age), _hold(self, "encoder_left", maximum_age)

    @classmethod
    def from_columns(
        cls,
        columns: Mapping[str, npt.ArrayLike],
        robot: Robot | RobotGeometry | None = None,
        *,
        source: str = "simulation",
        command_valid: npt.ArrayLike | None = None,
        segments: Iterable[tuple[int, int]] | None = None,
        spans: Iterable[tuple[int, int]] | None = None,
        notes: Iterable[str] = (),
    ) -> Recording:
        """Recording from columns that carry the schema's names already, as the simulator returns them.

        Args:
            columns: arrays (n,) by name with ``t``; names outside the schema become extras.
            robot: robot that drove, for its name and geometry.
            source: what meta data name as the source.
            command_valid: (n,) booleans; all true where absent.
            segments: index ranges; found from the gaps in ``t`` where absent.
            spans: index ranges; one span where absent.
            notes: sentences for the meta data.

        Raises:
            InputError: no ``t``, unequal lengths, or a time that does not increase.
        """
        arrays = {name: np.asarray(value, dtype=np.float64) for name, value in columns.items()}
        if "t" not in arrays:
            raise InputError(f"the columns {sorted(arrays)} hold no time: add a column t in seconds.")
        t = arrays.pop("t")
        check_stamps(t)
        geometry = RobotGeometry.of(robot) if isinstance(robot, Robot) else robot
        whole: Ranges = ((0, len(t)),) if len(t) else ()
        span_ranges = whole if spans is None else _whole_numbers(spans)
        meta = RecordingMeta(
            robot=geometry.name if geometry else "",
            source=source,
            geometry=geometry,
            start_time=float(t[0]) if t.size else 0.0,
            segments=split_at_gaps(t, span_ranges) if segments is None else _whole_numbers(segments),
            spans=span_ranges,
            notes=tuple(notes),
        )
        channels = {name: arrays[name] for name in CHANNELS if name in arrays}
        valid = np.ones(len(t), dtype=bool) if command_valid is None else np.asarray(command_valid, dtype=bool)
        extras = {name: value for name, value in arrays.items() if name not in CHANNELS}
        return cls(t - t[0] if t.size else t, channels, valid, meta, extras)

    def with_meta(self, **changes: Any) -> Recording:
        """Copy with some meta data changed."""
        return replace(self, meta=replace(self.meta, **changes))


def split_at_gaps(t: FloatArray, spans: Ranges) -> Ranges:
    """Cut spans wherever more than :data:`GAP_IN_PERIODS` median periods, or times between bursts, lie between rows.

    Args:
        t: time [s], (n,), increasing inside spans.
        spans: index ranges.
    """
    steps = np.concatenate([np.diff(t[a:b]) for a, b in spans] or [np.empty(0)])
    if not steps.size:
        return spans
    return cut_at_gaps(t, spans, GAP_IN_PERIODS * longest_period(steps))


def cut_at_gaps(t: FloatArray, spans: Ranges, longest: float) -> Ranges:
    """Cut spans wherever more than ``longest`` [s] lies between rows.

    Args:
        t: time [s], (n,), increasing inside spans.
        spans: index ranges.
        longest: time between rows that is no gap [s].
    """
    ranges: list[tuple[int, int]] = []
    for start, stop in spans:
        cuts = start + 1 + np.flatnonzero(np.diff(t[start:stop]) > longest)
        edges = [start, *cuts.tolist(), stop]
        ranges.extend(itertools.pairwise(edges))
    return tuple(ranges)


def _check_arrays(recording: Recording) -> None:
    n = len(recording.t)
    if recording.t.ndim != 1 or not np.all(np.isfinite(recording.t)):
        raise InputError("the recording's time holds NaN, infinity or more than one dimension: clean it first.")
    check_stamps(recording.t)
    back = np.flatnonzero(np.diff(recording.t) <= 0)
    if back.size:
        raise InputError(f"the recording's time does not increase at row {back[0] + 1}: sort it or drop repeated rows.")
    check_extent(recording.t)
    for name in recording.channels:
        if name not in CHANNELS:
            raise unknown_name("channel", name, CHANNELS)
    for name, value in {**recording.channels, **recording.extras, "command_valid": recording.command_valid}.items():
        if np.shape(value) != (n,):
            raise InputError(f"column {name} has the shape {np.shape(value)} where t has ({n},): make them equal.")
    for name, value in recording.channels.items():
        check_magnitude(name, value, CHANNELS[name].unit, recording.t)


def _check_ranges(kind: str, ranges: Ranges, n: int) -> None:
    previous = 0
    for start, stop in ranges:
        if not previous <= start < stop <= n:
            raise InputError(
                f"the recording's {kind} hold ({start}, {stop}) after row {previous} of {n}: "
                "give ordered, non-empty, non-overlapping index ranges."
            )
        previous = stop


def _hold(recording: Recording, name: str, maximum_age: float, valid: BoolArray | bool = True) -> FloatArray:
    values = recording[name]
    known = np.isfinite(values) & valid
    carried = np.full(len(recording), np.nan)
    for span in recording.spans():
        rows = np.arange(span.start, span.stop)
        last = np.maximum.accumulate(np.where(known[span], rows, -1))
        fresh = (last >= 0) & (recording.t[span] - recording.t[last] <= maximum_age)
        carried[span] = np.where(fresh, values[last], np.nan)
    return np.where(valid, carried, np.nan)


def _whole_numbers(ranges: Iterable[tuple[int, int]]) -> Ranges:
    return tuple((int(first), int(end)) for first, end in ranges)
