"""Column maps: what the columns of a CSV or Parquet file mean, written in YAML.

A commented example is ``configs/recordings/example.yaml``. A map names columns, units and signs; it holds
no expressions and refers to no other file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from ddagr_gym.config import config_names, find_config, load_config
from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.recordings.channels import CHANNELS, COMMANDS
from ddagr_gym.recordings.units import check_channel_unit, factor

FOLDER = "recordings"
TOPIC_PREFIX = "topics_"


@dataclass(frozen=True)
class ColumnSource:
    """One column of the file.

    Attributes:
        column: its name in the file's header.
        unit: as in :mod:`ddagr_gym.recordings.units`; "" for SI.
        sign: 1, or -1 where the file's axis points the other way.
        optional: whether a file may lack it.
    """

    column: str
    unit: str = ""
    sign: Literal[1, -1] = 1
    optional: bool = False


@dataclass(frozen=True)
class TimeSource:
    """Where time comes from.

    Attributes:
        column: name of the time column.
        unit: of time.
        absolute_column: a clock that runs through the whole file; used instead of ``column`` where a file has it.
    """

    column: str
    unit: str = "s"
    absolute_column: str | None = None

    def __post_init__(self) -> None:
        factor("s", self.unit)


@dataclass(frozen=True)
class BodyCommands:
    """Body-speed command, turned into bank speeds by the robot's wheel radius and track.

    Attributes:
        forward: v [m/s].
        turn: w [rad/s], counter-clockwise.
    """

    forward: ColumnSource
    turn: ColumnSource

    def __post_init__(self) -> None:
        factor("m/s", self.forward.unit or "m/s")
        factor("rad/s", self.turn.unit or "rad/s")


@dataclass(frozen=True)
class Pieces:
    """How rows fall into pieces.

    Attributes:
        span_columns: a new span starts where one of these changes; its clock and pose start anew.
        segment_columns: a new segment starts where one of these changes.
        join_gap: time that the time column leaves out at each join of segments inside a span [s].
        span_gap: time put between spans whose real distance is unknown [s].
    """

    span_columns: tuple[str, ...] = ()
    segment_columns: tuple[str, ...] = ()
    join_gap: float = 0.0
    span_gap: float = 1.0

    def __post_init__(self) -> None:
        if not (0 <= self.join_gap <= 3600 and 0 < self.span_gap <= 1e6):
            raise InputError(
                f"join_gap is {self.join_gap:g} s and span_gap {self.span_gap:g} s: give 0 or more and more than 0."
            )


@dataclass(frozen=True)
class HeldChannels:
    """Channels that the file repeats between updates; repeats become NaN.

    A new sample is a row whose ``flag_column`` is not 0 where one is named, else a row in which any of the
    channels differs from the row before. Limit of the second rule: a sensor that truly reports the same value
    twice looks like a repeat. Where ``zero_period`` is given, an exact zero counts as new again after that time,
    because a wheel at standstill legitimately repeats 0. The first row of a span is never new: its age is unknown.

    Attributes:
        channels: schema names that are updated together.
        flag_column: column that marks new samples.
        period: nominal time between updates [s], 0 where unknown.
        zero_period: time [s] after which a repeated 0 counts as a sample; None for never.
    """

    channels: tuple[str, ...]
    flag_column: str | None = None
    period: float = 0.0
    zero_period: float | None = None

    def __post_init__(self) -> None:
        if self.period < 0 or (self.zero_period is not None and self.zero_period <= 0):
            raise InputError(f"period is {self.period:g} s and zero_period {self.zero_period} s: give seconds above 0.")


@dataclass(frozen=True)
class ValidCommands:
    """Rows in which the commands are what the robot received.

    Attributes:
        column: name of a text or number column.
        values: its values, as text, for which commands are valid.
    """

    column: str
    values: tuple[str, ...]


@dataclass(frozen=True)
class ColumnMap:
    """Meaning of a table's columns.

    Attributes:
        time: time column.
        channels: source column by schema name.
        body_commands: instead of command_right and command_left among the channels.
        pieces: spans and segments.
        held: groups of channels that the file repeats between updates.
        command_valid: where commands count; everywhere if absent.
        robot: robot to assume where none is named.
        delimiter: between the fields of a CSV line; "" for comma, semicolon or tab as its header has them.
        description: for people.
        name: of the map; the file's name where absent.

    Raises:
        InputError: channels or units that do not exist, or entries that contradict one another.
    """

    time: TimeSource
    channels: Mapping[str, ColumnSource]
    body_commands: BodyCommands | None = None
    pieces: Pieces = Pieces()
    held: tuple[HeldChannels, ...] = ()
    command_valid: ValidCommands | None = None
    robot: str = ""
    delimiter: str = ""
    description: str = field(default="", compare=False)
    name: str = ""

    def __post_init__(self) -> None:
        for channel, source in self.channels.items():
            if channel not in CHANNELS:
                raise unknown_name("channel", channel, CHANNELS)
            check_channel_unit(channel, source.unit)
        _check_each_has_its_own(self.channels)
        if self.body_commands and any(command in self.channels for command in COMMANDS):
            raise InputError("body_commands and bank commands are both given: keep one of them.")
        for group in self.held:
            for channel in group.channels:
                if channel not in self.channels:
                    raise unknown_name("channel under held (it must be under channels, too)", channel, self.channels)
        if self.delimiter and (len(self.delimiter) != 1 or self.delimiter in '"\r\n\0' or ord(self.delimiter) > 126):
            raise InputError(f"delimiter is {self.delimiter!r}: give one character such as ',', ';' or a tab.")

    def sources(self) -> tuple[ColumnSource, ...]:
        """Columns that become channels."""
        body = (self.body_commands.forward, self.body_commands.turn) if self.body_commands else ()
        return (*self.channels.values(), *body)

    def number_columns(self) -> tuple[str, ...]:
        """Columns that hold numbers, each once; the absolute clock is not among them."""
        flags = [group.flag_column for group in self.held if group.flag_column]
        return tuple(dict.fromkeys([self.time.column, *(s.column for s in self.sources()), *flags]))

    def label_columns(self) -> tuple[str, ...]:
        """Columns whose values only name pieces or states, each once."""
        state = [self.command_valid.column] if self.command_valid else []
        return tuple(dict.fromkeys([*self.pieces.span_columns, *self.pieces.segment_columns, *state]))

    def needed_columns(self) -> tuple[str, ...]:
        """Columns without which this map does not fit a file."""
        optional = {s.column for s in self.sources() if s.optional}
        return tuple(c for c in dict.fromkeys((*self.number_columns(), *self.label_columns())) if c not in optional)


def _check_each_has_its_own(channels: Mapping[str, ColumnSource]) -> None:
    """Refuse two channels of one column: one of them is the other's, and checks would blame a sensor."""
    read: dict[str, str] = {}
    for channel, source in channels.items():
        other = read.setdefault(source.column, channel)
        if other != channel:
            raise InputError(f"{other} and {channel} both read the column {source.column!r}: give each its own.")


def shipped_column_maps() -> tuple[str, ...]:
    """Names of the column maps that the package carries."""
    return tuple(n for n in config_names(FOLDER) if not n.startswith(TOPIC_PREFIX) and n != "example")


def load_column_map(name: str) -> ColumnMap:
    """Shipped map by name, or a map of one's own by the path of its ``.yaml`` file.

    Raises:
        InputError: no such map, or one that does not parse.
    """
    path = find_config(FOLDER, name)
    column_map = load_config(path, ColumnMap)
    return column_map if column_map.name else replace(column_map, name=path.stem)


def most_specific_map(columns: tuple[str, ...], file_name: str) -> ColumnMap:
    """Shipped map that explains most of a file's columns.

    Args:
        columns: names in the file.
        file_name: for messages.

    Raises:
        InputError: no shipped map fits, or two fit equally well.
    """
    maps = [load_column_map(name) for name in shipped_column_maps()]
    fitting = [m for m in maps if set(m.needed_columns()) <= set(columns)]
    explained = [len(set(columns) & {*m.number_columns(), *m.label_columns()}) for m in fitting]
    if not fitting:
        shown = ", ".join(columns[:12]) + (", ..." if len(columns) > 12 else "")
        raise InputError(
            f"{file_name} has the columns {shown}, which fit none of the shipped maps "
            f"({', '.join(m.name for m in maps)}): give --map with a map of your own."
        )
    if explained.count(max(explained)) > 1:
        raise InputError(
            f"{file_name} fits several maps ({', '.join(m.name for m in fitting)}): choose one with --map."
        )
    return fitting[explained.index(max(explained))]
