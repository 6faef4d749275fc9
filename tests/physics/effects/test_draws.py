"""Sizes drawn from their intervals: one normal number for each, cut off as asked for."""

import numpy as np
import pytest

from ddagr_gym.physics.effects.draws import draw_sizes
from ddagr_gym.physics.effects.slope import Slope

FOUND = Slope(0.06, 0.5)
ANGLE, DIRECTION = (0.05, 0.07), (0.0, 1.0)


def drawn(count: int, *, most: float = np.inf, inside: bool = False, angle: tuple[float, float] = ANGLE) -> np.ndarray:
    rng = np.random.default_rng(1)
    return np.array([draw_sizes(FOUND, {"angle": angle}, rng, most, inside).angle for _ in range(count)])


def test_numbers_are_drawn_in_the_order_of_the_parameters_whatever_that_of_the_intervals():
    first, second = np.random.default_rng(3).standard_normal(2)
    made = draw_sizes(FOUND, {"direction": DIRECTION, "angle": ANGLE}, np.random.default_rng(3))
    assert made.angle == FOUND.angle + (ANGLE[1] - ANGLE[0]) / 3.29 * first
    assert made.direction == FOUND.direction + (DIRECTION[1] - DIRECTION[0]) / 3.29 * second


def test_what_was_not_estimated_stays():
    rng = np.random.default_rng(3)
    assert draw_sizes(FOUND, {}, rng) == FOUND
    assert rng.standard_normal() == np.random.default_rng(3).standard_normal()


def test_nine_of_ten_lie_in_the_interval():
    values = drawn(2000)
    assert np.mean((values > ANGLE[0]) & (values < ANGLE[1])) == pytest.approx(0.9, abs=0.02)


def test_draws_are_cut_off_at_deviations_or_at_the_ends_of_the_interval():
    deviation = (ANGLE[1] - ANGLE[0]) / 3.29
    assert np.max(np.abs(drawn(200, most=1.0) - FOUND.angle)) == pytest.approx(deviation)
    values = drawn(200, inside=True)
    assert (values.min(), values.max()) == ANGLE


def test_draws_stay_inside_the_bounds_of_the_parameter():
    high = Slope.parameter("angle").metadata["high"]
    for inside in (False, True):
        values = drawn(50, inside=inside, angle=(-50.0, 50.0))
        assert values.max() == high
