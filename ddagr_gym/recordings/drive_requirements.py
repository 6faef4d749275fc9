"""What everything that is computed from a drive needs of its rows."""

from __future__ import annotations

import math

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.schema import Recording


def check_rows(recording: Recording, use: str) -> None:
    """Refuse a recording without two rows in one segment: no time passes between its rows.

    Args:
        recording: any.
        use: what needs a drive, for the message ("a replay").

    Raises:
        InputError: fewer than two rows, or each in a segment of its own.
    """
    source, rows = recording.meta.source, len(recording)
    if rows < 2:
        raise InputError(f"{source} has {rows} rows: {use} needs a drive.")
    if not math.isfinite(recording.period):
        raise InputError(
            f"{source} has {rows} rows of which no two are in one segment: correct segment_columns or span_columns in "
            "the map."
        )
