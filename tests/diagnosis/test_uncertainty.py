"""Intervals are as wide as resampling and the forms of simulators say, and stay within what exists."""

import pytest

from ddagr_gym.diagnosis.uncertainty import STRUCTURE, STRUCTURE_OF_LIMIT, with_structure
from ddagr_gym.physics.effects import parse_effect


def test_intervals_have_a_width_however_many_windows_there_are() -> None:
    delay = parse_effect("command_delay=0.2")
    low, high = with_structure((0.2, 0.2), delay, "delay")
    assert (high - low) / 2.0 == pytest.approx(STRUCTURE * 0.02)
    low, high = with_structure((0.1, 0.3), delay, "delay")
    assert (low, high) == (pytest.approx(0.1, abs=1e-3), pytest.approx(0.3, abs=1e-3))


def test_a_limit_is_uncertain_by_a_share_of_itself() -> None:
    low, high = with_structure((0.8, 0.8), parse_effect("motor_saturation=0.8"), "speed_limit")
    assert (high - low) / 2.0 == pytest.approx(STRUCTURE_OF_LIMIT * 0.8)


def test_shapes_keep_their_intervals_and_bounds_hold() -> None:
    assert with_structure((0.2, 0.4), parse_effect("command_delay=0.2,imbalance=0.3"), "imbalance") == pytest.approx(
        (0.2, 0.4)
    )
    assert with_structure((0.0, 0.001), parse_effect("command_delay=0.0005"), "delay")[0] == 0.0
