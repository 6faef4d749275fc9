"""Ranges of a regime are never empty, whatever the weights."""

import numpy as np
import pytest

from ddagr_gym.diagnosis.answer.location import Unevenness
from ddagr_gym.diagnosis.localisation.operating_conditions import CONDITIONS, Pieces, _ordered, uneven

NAME = next(name for name in CONDITIONS if name != "heading")


@pytest.mark.parametrize(
    ("weight", "inside"),
    [((3.0, -1.0, -1.0, -1.0 - 1e-9), 0.25), ((-1.0, -1.0, -1.0, -1.0), 1.0), ((-1.0, -1.0, -1.0, 3.0), 0.25)],
)
def test_a_sum_that_ends_at_its_lowest_has_a_range_all_the_same(weight: tuple[float, ...], inside: float) -> None:
    share, _ = _ordered(NAME, np.array([weight]), np.arange(4.0), np.zeros(4))
    assert share.time_inside == inside


def _tested(drift: float, seed: int) -> Unevenness | None:
    """Of 27 windows in twelve pieces each, with a size that drifts by a share from the first to the last."""
    rng = np.random.default_rng(seed)
    window = np.repeat(np.arange(27), 12)
    time = np.arange(27 * 12) / 12.0
    other = rng.permutation(27)[window] + rng.uniform(0.0, 0.1, len(time))
    information = rng.uniform(10.0, 20.0, len(time))
    size = drift * (time / time[-1] - 0.5) + rng.normal(0.0, 0.2, 27)[window]
    remainder = information * size + rng.normal(0.0, 1.0, len(time)) * np.sqrt(information)
    pieces = Pieces(np.zeros(len(time), int), {"time": time, "speed": other}, time, time)
    return uneven(remainder, information, window, pieces, rng)


def test_a_size_that_drifts_is_found_in_few_windows() -> None:
    found = [_tested(1.4, seed) for seed in range(8)]
    assert all(item is not None and item.name == "time" for item in found)
    sizes = [(item.size_outside, item.size_inside) for item in found if item is not None]
    assert all(abs(outside - inside) > 0.5 for outside, inside in sizes)


def test_a_constant_size_is_seldom_uneven() -> None:
    """At a level of 5 percent, less those whose sizes differ by little."""
    assert sum(_tested(0.0, seed) is not None for seed in range(100)) <= 8


@pytest.mark.parametrize("seed", range(5))
def test_a_range_holds_all_pieces_with_its_values(seed: int) -> None:
    """Most commands do not change: pieces with the same value are inside a range together or not at all."""
    rng = np.random.default_rng(seed)
    values = np.where(rng.random(300) < 0.6, 0.0, rng.exponential(1.0, 300))
    weight = rng.exponential(1.0, 300) * np.where(np.arange(300) < 60, 3.0, 1.0)
    share, _ = _ordered(NAME, weight[None] / weight.sum(), values, np.full(300, 1.0 / 300.0))
    low = -np.inf if share.low is None else share.low
    high = np.inf if share.high is None else share.high
    inside = (values > low) & (values < high)
    assert share.time_inside == pytest.approx(inside.mean(), abs=0.05)
    if share.low is not None and share.high is not None:
        assert share.time_inside == pytest.approx(inside.mean())
