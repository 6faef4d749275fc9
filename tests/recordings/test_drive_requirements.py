"""A recording in which no time passes between rows is refused, with what is wrong with it."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.drive_requirements import check_rows
from ddagr_gym.recordings.schema import Recording

SINGLE = tuple((row, row + 1) for row in range(5))


def rows(count, **ranges):
    return Recording.from_columns({"t": np.arange(float(count))}, source="a.csv", **ranges)


@pytest.mark.parametrize(
    ("recording", "said"),
    [
        (rows(0), "a.csv has 0 rows: a replay needs a drive"),
        (rows(1), "a.csv has 1 rows: a replay needs a drive"),
        (rows(5, spans=SINGLE), "a.csv has 5 rows of which no two are in one segment: correct segment_columns or span"),
        (rows(5, segments=SINGLE), "no two are in one segment"),
    ],
)
def test_what_is_no_drive_is_refused(recording, said):
    with pytest.raises(InputError, match=said):
        check_rows(recording, "a replay")


def test_two_rows_in_one_segment_pass():
    check_rows(rows(2), "a replay")
