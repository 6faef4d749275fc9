"""Named open-loop drives: bank speed commands over time."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.files import read_named_text

LARGEST_SPEED = 100.0
"""Commands beyond this are a mistake of units [rad/s]."""
LONGEST_DRIVE = 36_000.0
"""[s], ten hours: more is a mistake of units (ours)."""
LARGEST_FILE = 500_000_000
"""Size of a file of commands that is read, at most [bytes] (ours): ten hours at 125 Hz have a third of it."""

COLUMNS = ("t", "command_right", "command_left")
"""Of a file of commands [s, rad/s]."""


@dataclass(frozen=True)
class Manoeuvre:
    """Piecewise constant commands.

    Attributes:
        name: identifier.
        segments: (duration [s], right [rad/s], left [rad/s]) in order.
        description: one line.
    """

    name: str
    segments: tuple[tuple[float, float, float], ...]
    description: str = ""

    def __post_init__(self) -> None:
        if not self.segments:
            raise InputError(f"manoeuvre {self.name!r} has no segments: give (duration, right, left) at least once.")
        for number, segment in enumerate(self.segments, 1):
            duration, right, left = segment
            if not all(math.isfinite(v) for v in segment) or duration <= 0.0:
                raise InputError(f"manoeuvre {self.name!r}, segment {number}: {segment} needs a positive duration.")
            if max(abs(right), abs(left)) > LARGEST_SPEED:
                raise InputError(
                    f"manoeuvre {self.name!r}, segment {number}: {max(abs(right), abs(left)):g} is beyond "
                    f"{LARGEST_SPEED:g} rad/s; are the commands in rad/s?"
                )
        if self.duration > LONGEST_DRIVE:
            raise InputError(f"manoeuvre {self.name!r} lasts {self.duration:g} s: at most {LONGEST_DRIVE:g} s.")

    @property
    def duration(self) -> float:
        """[s]"""
        return math.fsum(segment[0] for segment in self.segments)

    def commands(self, rate: float) -> NDArray[np.float64]:
        """(T, 2) right and left commands [rad/s] at ``rate`` [Hz]; a switch takes effect at the nearest sample."""
        edges = np.cumsum([segment[0] for segment in self.segments])
        t = (np.arange(max(round(self.duration * rate), 1)) + 0.5) / rate
        index = np.minimum(np.searchsorted(edges, t), len(self.segments) - 1)
        return np.array([segment[1:] for segment in self.segments], dtype=float)[index]


def _weave() -> tuple[tuple[float, float, float], ...]:
    """A sampled S-weave: mean speed 0.9 rad/s, difference +-0.5 rad/s with a period of 10 s, 30 s long."""
    step = 0.2
    t = np.arange(0.0, 30.0, step) + step / 2
    swing = 0.5 * np.sin(2 * math.pi * t / 10.0)
    return tuple((step, round(float(0.9 + d), 6), round(float(0.9 - d), 6)) for d in swing)


def _ramps() -> tuple[tuple[float, float, float], ...]:
    """Sampled ramps of both banks: up to 1.3 rad/s and down, then the same backwards to -0.8 rad/s, 26 s long."""
    step = 0.2
    t = np.arange(0.0, 26.0, step) + step / 2
    speed = np.interp(t, [0.0, 8.0, 14.0, 20.0, 26.0], [0.0, 1.3, 0.0, -0.8, 0.0])
    return tuple((step, round(float(v), 6), round(float(v), 6)) for v in speed)


MANOEUVRES = {
    item.name: item
    for item in (
        Manoeuvre(
            "table_6_2",
            ((5.0, 0.701, 0.701), (17.5, 0.0, 1.195), (2.5, 0.701, 0.701)),
            "thesis Table 6.2: straight, right turn with one bank locked, straight",
        ),
        Manoeuvre(
            "table_6_3",
            ((2.0, 0.0, 0.0), (16.0, 0.716, 0.716), (20.0, 0.36, 1.074)),
            "thesis Table 6.3: straight, then a gentle right turn",
        ),
        Manoeuvre("straight", ((20.0, 0.9, 0.9),), "straight at one speed"),
        Manoeuvre(
            "stops",
            tuple(s for v in (0.5, 0.9, 1.3, -0.7) for s in ((5.0, v, v), (2.0, 0.0, 0.0))),
            "straights at four speeds with stops, one in reverse",
        ),
        Manoeuvre(
            "arcs",
            tuple((6.0, 0.9 + d, 0.9 - d) for d in (0.2, -0.2, 0.4, -0.4, 0.6, -0.6)),
            "arcs of three curvatures to both sides",
        ),
        Manoeuvre("s_weave", _weave(), "sinusoidal weave, 10 s period"),
        Manoeuvre("spin", ((8.0, 0.8, -0.8), (8.0, -0.8, 0.8)), "turning on the spot to both sides"),
        Manoeuvre(
            "two_speeds", ((10.0, 0.4, 0.4), (10.0, 1.2, 1.2)), "straight at a low and at three times that speed"
        ),
        Manoeuvre("ramps", _ramps(), "straight with slowly rising and falling speed, also backwards"),
        Manoeuvre(
            "reversing",
            tuple(s for v in (0.8, -0.8) for s in ((5.0, v, v), (5.0, 0.5 * v, 1.3 * v), (5.0, 1.3 * v, 0.5 * v))),
            "straight and arcs, forwards and then backwards",
        ),
        Manoeuvre(
            "two_headings",
            ((9.0, 0.8, 0.8), (8.0, 0.8, -0.8), (9.0, 0.8, 0.8)),
            "straight, a turn on the spot of about a right angle, straight",
        ),
        Manoeuvre(
            "four_headings",
            tuple(s for _ in range(4) for s in ((6.0, 0.8, 0.8), (8.0, 0.8, -0.8))),
            "straights in four headings with turns on the spot between them",
        ),
        Manoeuvre(
            "two_radii",
            tuple((8.0, 0.8 + d, 0.8 - d) for d in (0.15, 0.5, -0.15, -0.5)),
            "a wide and a narrow arc to both sides",
        ),
        Manoeuvre("figure_eight", ((22.0, 1.15, 0.55), (22.0, 0.55, 1.15)), "a circle to either side at one speed"),
        Manoeuvre(
            "row_turn",
            ((6.0, 0.8, 0.8), (16.0, 1.1, 0.1), (6.0, 0.8, 0.8)),
            "along a row, around its end, back along the next",
        ),
        Manoeuvre(
            "steps",
            tuple(
                (1.5, r, q) for r, q in ((0.9, 0.9), (0.3, 0.9), (0.9, 0.3), (0.0, 0.0), (-0.6, 0.6), (1.1, 1.1)) * 3
            ),
            "a new command every 1.5 s",
        ),
    )
}
"""The built-in drives by name."""


def find_manoeuvre(name_or_path: str) -> Manoeuvre:
    """Built-in manoeuvre by name, or one from a CSV file of commands.

    Raises:
        InputError: unknown name, or a file that does not hold commands.
    """
    if name_or_path in MANOEUVRES:
        return MANOEUVRES[name_or_path]
    path = Path(name_or_path)
    if path.suffix.lower() == ".csv" or path.exists():
        return read_manoeuvre(path)
    raise unknown_name("manoeuvre", name_or_path, MANOEUVRES)


def read_manoeuvre(path: Path) -> Manoeuvre:
    """Manoeuvre from a CSV with columns ``t, command_right, command_left`` [s, rad/s]; each row holds until the next.

    The last row's command lasts as long as the one before it.

    Raises:
        InputError: absent file, a pipe or a device, one beyond :data:`LARGEST_FILE`, missing column, or values that are
            not numbers in increasing time.
    """
    text = read_named_text(path, LARGEST_FILE, f"give a CSV with columns {', '.join(COLUMNS)}")
    try:
        rows = list(csv.DictReader(io.StringIO(text)))
    except csv.Error as error:
        raise InputError(f"{path} is not a CSV file: {error}.") from None
    missing = [name for name in COLUMNS if not rows or name not in rows[0]]
    if missing:
        raise InputError(f"{path} has no column {missing[0]!r}: give {', '.join(COLUMNS)} and a row at least.")
    try:
        table = np.array([[float(row[name]) for name in COLUMNS] for row in rows])
    except (TypeError, ValueError) as error:
        raise InputError(f"{path} holds a value that is no number: {error}.") from None
    return _from_table(path, table)


def _from_table(path: Path, table: NDArray[np.float64]) -> Manoeuvre:
    steps = np.diff(table[:, 0])
    if len(table) < 2 or not np.isfinite(table).all() or (steps <= 0).any():
        raise InputError(f"{path}: give at least two rows of finite numbers with increasing t.")
    durations = [*steps.tolist(), float(steps[-1])]
    segments = tuple((d, float(r[1]), float(r[2])) for d, r in zip(durations, table, strict=True))
    return Manoeuvre(path.stem, segments, f"commands of {path.name}")
