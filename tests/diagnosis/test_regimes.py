"""Ranges of a regime are never empty, whatever the weights."""

import numpy as np
import pytest

from ddagr_gym.diagnosis.regimes import REGIMES, Pieces, Unevenness, _ordered, uneven

NAME = next(name for name in REGIMES if name != "heading")


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
