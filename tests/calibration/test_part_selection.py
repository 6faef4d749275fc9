"""When a part is kept: by the growth of the losses of left-out drives, each with its weight."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.calibration.joint_fit import Standing
from ddagr_gym.calibration.part_selection import Candidate, surely_above, worse_by


def candidate(*losses: float, counts: tuple[int, ...] = ()) -> Candidate:
    standing = Standing({}, np.zeros((0, 8)), True)
    return Candidate(standing, dict(enumerate(losses)), dict(enumerate(counts or (1,) * len(losses))))


def test_equal_drives_have_the_mean_and_its_standard_error():
    growth, error = worse_by(candidate(1.0, 2.0, 4.0), candidate(1.1, 2.4, 4.0))
    values = np.array([0.1, 0.2, 0.0])
    assert growth == pytest.approx(values.mean())
    # sum w^2 (g - m)^2 k/(k - 1) with w = 1/k is the usual variance of a mean
    assert error == pytest.approx(values.std(ddof=1) / np.sqrt(3.0))


def test_a_short_drive_counts_for_less():
    long, short = candidate(1.0, 1.0, counts=(99, 1)), candidate(1.1, 0.2, counts=(99, 1))
    growth, _ = worse_by(long, short)
    assert growth == pytest.approx(0.99 * 0.1 - 0.01 * 0.8)


def test_few_drives_must_show_more():
    assert surely_above(1000) == pytest.approx(1.0, abs=0.01)
    assert surely_above(2) > surely_above(3) > surely_above(6) > 1.0
