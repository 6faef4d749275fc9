"""Ranges of a regime are never empty, whatever the weights."""

import numpy as np
import pytest

from ddagr_gym.diagnosis.regimes import REGIMES, _ordered

NAME = next(name for name in REGIMES if name != "heading")


@pytest.mark.parametrize(
    ("weight", "inside"),
    [((3.0, -1.0, -1.0, -1.0 - 1e-9), 0.25), ((-1.0, -1.0, -1.0, -1.0), 1.0), ((-1.0, -1.0, -1.0, 3.0), 0.25)],
)
def test_a_sum_that_ends_at_its_lowest_has_a_range_all_the_same(weight: tuple[float, ...], inside: float) -> None:
    share, _ = _ordered(NAME, np.array([weight]), np.arange(4.0), np.zeros(4))
    assert share.time_inside == inside
