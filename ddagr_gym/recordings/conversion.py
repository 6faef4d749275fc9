"""From the columns of a table to a recording: time, pieces, units, commands, repeated readings.

Every assumption leaves a sentence in the recording's notes.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.column_map import BodyCommands, ColumnMap, HeldChannels
from ddagr_gym.recordings.equal_times import joined_rows
from ddagr_gym.recordings.plausible import check_stamps
from ddagr_gym.recordings.schema import (
    BoolArray,
    FloatArray,
    Ranges,
    Recording,
    RecordingMeta,
    RobotGeometry,
    bank_speeds,
    split_at_gaps,
)
from ddagr_gym.recordings.units import channel_factor, factor

MOST_REPEATED = 0.5
"""Share of rows that repeat the time of the row before, and say nothing new, up to which they are left out (ours): a
log that writes rows twice. With more the clock stands still, or is coarser than the log."""


@dataclass(frozen=True, eq=False)
class RawTable:
    """Columns as they stand in a file.

    Attributes:
        numbers: float arrays (n,) by column name, NaN where a field is empty.
        labels: integer codes (n,) by column name for columns that name pieces or states.
        label_values: text of each code by column name.
    """

    numbers: Mapping[str, FloatArray]
    labels: Mapping[str, npt.NDArray[np.int64]] = field(default_factory=dict)
    label_values: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def rows(self, keep: BoolArray) -> RawTable:
        """Table with some of the rows."""
        return RawTable(
            {name: column[keep] for name, column in self.numbers.items()},
            {name: column[keep] for name, column in self.labels.items()},
            self.label_values,
        )


def build_recording(
    table: RawTable,
    column_map: ColumnMap,
    geometry: RobotGeometry | None,
    *,
    source: str = "",
    source_sha256: str = "",
) -> Recording:
    """Recording from a table and the map that explains it.

    Args:
        table: columns of the file.
        column_map: their meaning.
        geometry: robot's wheel radius and track; needed for body-speed commands and rim speeds.
        source: file name for the meta data.
        source_sha256: hash of the file.

    Raises:
        InputError: no rows, unsorted or missing times, or a conversion that lacks the robot.
    """
    notes: list[str] = []
    table, duplicates = _one_row_a_time(table, column_map, notes)
    t, start_time, spans, segments = _time_base(table, column_map, notes)
    channels = _channels(table, column_map, geometry, notes)
    if not any(np.isfinite(values).any() for values in channels.values()):
        raise InputError(f"no channel of the map {column_map.name} holds a number: correct the map or the file.")
    held = _mark_held(channels, table, column_map, t, spans, notes)
    valid = _command_valid(table, column_map, channels, notes)
    meta = RecordingMeta(
        robot=geometry.name if geometry else "",
        source=source,
        source_sha256=source_sha256,
        column_map=column_map.name,
        geometry=geometry,
        start_time=start_time,
        segments=segments,
        spans=spans,
        held=held,
        duplicates_dropped=duplicates,
        notes=tuple(notes),
    )
    return Recording(t, channels, valid, meta)


def _clock(table: RawTable, column_map: ColumnMap) -> tuple[FloatArray, bool]:
    """Time of every row [s] and whether it runs through the whole file."""
    time = column_map.time
    absolute = time.absolute_column is not None and time.absolute_column in table.numbers
    column = time.absolute_column if absolute and time.absolute_column else time.column
    return table.numbers[column] * factor("s", time.unit), absolute


def _changes(table: RawTable, names: tuple[str, ...]) -> BoolArray:
    """Rows in which any of the label columns differs from the row before; row 0 is not one."""
    n = len(next(iter(table.numbers.values())))
    changed = np.zeros(n, dtype=bool)
    for name in names:
        changed[1:] |= np.diff(table.labels[name]) != 0
    return changed


def _one_row_a_time(table: RawTable, column_map: ColumnMap, notes: list[str]) -> tuple[RawTable, int]:
    """Rows of one time stamp as one, and how many of them said nothing new."""
    clock, absolute = _clock(table, column_map)
    if not clock.size:
        raise InputError("the file has a header but no rows: give a recording with samples.")
    bad = np.flatnonzero(~np.isfinite(clock))
    if bad.size:
        raise InputError(
            f"row {bad[0] + 1} has no valid time in {column_map.time.column}: fill it in or delete the row."
        )
    check_stamps(clock)
    new_span = _changes(table, column_map.pieces.span_columns)
    _check_order(clock, new_span & (not absolute))
    repeated = np.zeros(clock.size, dtype=bool)
    repeated[1:] = (np.diff(clock) == 0) & ~new_span[1:]
    numbers, adding = joined_rows(table.numbers, repeated)
    count = int(np.count_nonzero(repeated & ~adding))
    if count > MOST_REPEATED * clock.size:
        raise InputError(
            f"{count} of {clock.size} rows repeat the time of the row before: {column_map.time.column} stands still or "
            "is too coarse; name a finer column under time in the column map."
        )
    if count:
        notes.append(f"{count} rows that repeated the time of the row before were left out.")
    if adding.any():
        notes.append(f"{np.count_nonzero(adding)} rows with the time of the row before were joined with it.")
    return replace(table.rows(~repeated), numbers=numbers), count


def _check_order(clock: FloatArray, restarts: BoolArray) -> None:
    """Refuse times that go back but where they may restart; InputError."""
    back = np.flatnonzero((np.diff(clock) < 0) & ~restarts[1:])
    if back.size:
        raise InputError(
            f"time goes back from {clock[back[0]]:g} s to {clock[back[0] + 1]:g} s after row {back[0] + 1}: sort the "
            "rows, or name the column that numbers the pieces under span_columns in the map."
        )


def _time_base(table: RawTable, column_map: ColumnMap, notes: list[str]) -> tuple[FloatArray, float, Ranges, Ranges]:
    """Increasing time from 0, the clock at 0, spans and segments."""
    clock, absolute = _clock(table, column_map)
    pieces = column_map.pieces
    new_span = _changes(table, pieces.span_columns)
    spans = _ranges(new_span)
    joined = _changes(table, pieces.segment_columns)
    t = clock - clock[0]
    if pieces.span_columns and not absolute:
        t = _joined_time(clock, spans, joined, pieces.join_gap, pieces.span_gap)
        notes.append(
            f"time restarts in each of {len(spans)} spans; {pieces.span_gap:g} s were put between them and "
            f"{pieces.join_gap:g} s at every join of segments inside them."
        )
    segments = split_at_gaps(t, _ranges(new_span | joined))
    return t, 0.0 if pieces.span_columns and not absolute else float(clock[0]), spans, segments


def _joined_time(clock: FloatArray, spans: Ranges, joined: BoolArray, join_gap: float, span_gap: float) -> FloatArray:
    t = np.empty_like(clock)
    origin = 0.0
    for start, stop in spans:
        inside = joined[start:stop].copy()
        inside[0] = False
        t[start:stop] = origin + clock[start:stop] - clock[start] + join_gap * np.cumsum(inside)
        origin = float(t[stop - 1]) + span_gap
    return t


def _ranges(starts_piece: BoolArray) -> Ranges:
    edges = [0, *np.flatnonzero(starts_piece).tolist(), len(starts_piece)]
    return tuple((a, b) for a, b in itertools.pairwise(edges) if b > a)


def _channels(
    table: RawTable, column_map: ColumnMap, geometry: RobotGeometry | None, notes: list[str]
) -> dict[str, FloatArray]:
    radius = geometry.wheel_radius if geometry else None
    channels = {}
    for name, source in column_map.channels.items():
        if source.column in table.numbers:
            scale = source.sign * channel_factor(name, source.unit, radius)
            channels[name] = (
                table.numbers[source.column] * scale if scale != 1.0 else table.numbers[source.column].copy()
            )
            if scale != 1.0:
                notes.append(f"{name} is the column {source.column} times {scale:.8g}.")
    if column_map.body_commands:
        right, left = _body_commands(table, column_map.body_commands, column_map.name, geometry, notes)
        channels["command_right"], channels["command_left"] = right, left
    for values in channels.values():
        values[np.isinf(values)] = np.nan
    return channels


def _body_commands(
    table: RawTable, commands: BodyCommands, map_name: str, geometry: RobotGeometry | None, notes: list[str]
) -> tuple[FloatArray, FloatArray]:
    if geometry is None:
        raise InputError(
            f"the map {map_name} holds body-speed commands: name the robot (--robot) whose wheel radius and "
            "track turn them into bank speeds."
        )
    forward, turn = commands.forward, commands.turn
    v = table.numbers[forward.column] * (forward.sign * factor("m/s", forward.unit or "m/s"))
    w = table.numbers[turn.column] * (turn.sign * factor("rad/s", turn.unit or "rad/s"))
    notes.append(
        f"bank speed commands are (v +- w W)/R of {forward.column} and {turn.column} with R = "
        f"{geometry.wheel_radius:g} m and W = {geometry.half_track:g} m of {geometry.name}."
    )
    return bank_speeds(v, w, geometry)


def _mark_held(
    channels: dict[str, FloatArray],
    table: RawTable,
    column_map: ColumnMap,
    t: FloatArray,
    spans: Ranges,
    notes: list[str],
) -> dict[str, float]:
    held = {}
    for group in column_map.held:
        names = [name for name in group.channels if name in channels]
        if not names:
            continue
        new = _new_samples(group, [channels[name] for name in names], table, t, spans)
        for name in names:
            channels[name][~new] = np.nan
            held[name] = group.period
        rule = f"{group.flag_column} is not 0" if group.flag_column else "the value changed"
        notes.append(f"The source holds {', '.join(names)} between updates: samples count as new where {rule}.")
    return held


def _new_samples(
    group: HeldChannels, values: list[FloatArray], table: RawTable, t: FloatArray, spans: Ranges
) -> BoolArray:
    """Rows that hold a new sample of a group of channels; the rule is that of :class:`HeldChannels`."""
    if group.flag_column:
        flag = table.numbers[group.flag_column]
        return np.asarray(np.isfinite(flag) & (flag != 0))
    new = np.zeros(len(t), dtype=bool)
    for column in values:
        new[1:] |= (column[1:] != column[:-1]) & np.isfinite(column[1:])
    for start, stop in spans:
        new[start] = False
        if group.zero_period is not None:
            zero = np.all([column[start:stop] == 0 for column in values], axis=0)
            _accept_zeros(new[start:stop], zero, t[start:stop], group.zero_period)
    return new


def _accept_zeros(new: BoolArray, zero: BoolArray, t: FloatArray, period: float) -> None:
    """Mark repeated zeros as new, in place, whenever ``period`` has passed since the last new sample."""
    last = t[0]
    # Half a typical row of slack, so that a period that is a multiple of the row's is met despite jitter.
    slack = 0.5 * float(np.median(np.diff(t))) if len(t) > 1 else 0.0
    for row in np.flatnonzero(new | zero):
        if new[row] or t[row] - last >= period - slack:
            new[row] = True
            last = t[row]


def _command_valid(
    table: RawTable, column_map: ColumnMap, channels: dict[str, FloatArray], notes: list[str]
) -> BoolArray:
    """Where commands count; elsewhere the commands become NaN."""
    commands = [channels[name] for name in ("command_right", "command_left") if name in channels]
    n = len(next(iter(table.numbers.values())))
    valid = np.full(n, len(commands) == 2)
    rule = column_map.command_valid
    if rule is not None:
        wanted = [code for code, text in enumerate(table.label_values[rule.column]) if text in rule.values]
        valid &= np.isin(table.labels[rule.column], wanted)
        notes.append(
            f"commands count in {np.count_nonzero(valid)} of {n} rows, where {rule.column} is "
            f"{' or '.join(rule.values)}."
        )
        for command in commands:
            command[~valid] = np.nan
    return valid
