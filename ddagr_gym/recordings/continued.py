"""Stretches of a recording that go on where the one before ended, though their clocks begin anew.

Protocols that drive in steps write each step with a clock and a pose frame of its own. What the drivetrain remembers at
the start of a step (past commands, the integral parts of its loops) is then in the step before.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
Booleans = NDArray[np.bool_]

LARGEST_CHANGE = 0.12
"""Change of both bank speeds over a break below which the drive went on, as a share of the fast ones of the recording
(ours): readings of a steady speed scatter by half of it on sand, a stop in between changes most of them by more."""

_FAST = 95.0  # percentile of bank speeds that counts as fast (ours)


@dataclass(frozen=True, eq=False)
class RowsOfSegment:
    """Rows of a segment, and those before it as far back as the drive went on.

    Attributes:
        segment: rows without a missing sample.
        before: (B,) rows before it, the latest first; the last one of a step stands twice, once for the sample that is
            missing between it and the next step.
    """

    segment: slice
    before: Rows

    def at(self, rows: Rows) -> tuple[Rows, Booleans]:
        """Rows of the recording, and which of them are known, for rows that are counted on from the segment's.

        Behind the segment its last row stands for the others, before all that is known the earliest.

        Args:
            rows: (n,) counted as if what is before the segment had no break.
        """
        back = self.segment.start - 1 - rows
        known = back < len(self.before)
        inside = np.clip(rows, self.segment.start, self.segment.stop - 1)
        if not len(self.before):
            return inside, known
        return np.where(back >= 0, self.before[np.clip(back, 0, len(self.before) - 1)], inside), known


def rows_by_segment(recording: Recording, most: int) -> Iterator[RowsOfSegment]:
    """All segments with the rows before them.

    Args:
        recording: with wheel speeds, or none is known to go on.
        most: rows before a segment that are looked for.
    """
    restarts = {span.start for span in recording.spans()}
    commands = np.stack(recording.held_commands(), axis=1)
    speeds = np.stack([recording["encoder_right"], recording["encoder_left"]], axis=1)
    change = _largest_change(speeds)
    before = np.zeros(0, dtype=np.int64)
    last: slice | None = None
    for segment in recording.segments():
        if (
            last is None
            or segment.start not in restarts
            or not goes_on((commands[last], commands[segment]), (speeds[last], speeds[segment]), change)
        ):
            before = before[:0]
        else:
            earlier = np.arange(last.stop - 1, last.start - 1, -1)
            before = np.concatenate([earlier[:1], earlier, before])[:most]
        yield RowsOfSegment(segment, before)
        last = segment


def _largest_change(speeds: Array) -> float:
    known = np.abs(speeds[np.isfinite(speeds)])
    return LARGEST_CHANGE * float(np.percentile(known, _FAST)) if known.size else 0.0


def goes_on(commands: tuple[Array, Array], speeds: tuple[Array, Array], change: float) -> bool:
    """Whether both wheel speeds go on over a break, and the commands do or are new after it and stay.

    Args:
        commands: of both banks before and after it, (n, 2) and (m, 2) [rad/s].
        speeds: likewise, NaN where there is no reading [rad/s].
        change: largest one of a speed that goes on [rad/s].
    """
    given = commands[1]
    same = np.array_equal(given[0], commands[0][-1])
    stays = bool((given == given[0]).all())
    jump = first_and_last(speeds[1])[0] - first_and_last(speeds[0])[1]
    return bool((np.abs(jump) < change).all()) and (same or stays)


def first_and_last(speeds: Array) -> tuple[Array, Array]:
    """First and last known speed of both banks (2,) each; NaN where there is none.

    Args:
        speeds: (n, 2), NaN where there is no reading [rad/s].
    """
    known = [column[np.isfinite(column)] for column in speeds.T]
    first, last = ([column[at] if len(column) else np.nan for column in known] for at in (0, -1))
    return np.array(first), np.array(last)
