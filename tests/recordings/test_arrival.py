"""Stamps that go back: what is a clock that was set, and what only messages out of order."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.recordings.arrival import step_back

ARRIVAL = np.arange(0.0, 60.0, 0.1)
SET_BACK = ARRIVAL - np.where(ARRIVAL >= 30.0, 5.0, 0.0)
BEGUN_ANEW = np.where(ARRIVAL < 20.0, ARRIVAL, ARRIVAL - 20.0)


@pytest.mark.parametrize(("stamps", "fall", "after"), [(SET_BACK, 4.9, 29.9), (BEGUN_ANEW, 19.9, 19.9)])
def test_a_clock_that_is_set_back(stamps, fall, after):
    for received, too in ((ARRIVAL, False), (stamps, True)):
        step = step_back(stamps, received)
        assert step is not None
        assert (step.fall, step.after, step.received_too) == (pytest.approx(fall), pytest.approx(after), too)
        remedy = "cut the bag there" if too else "set stamps: receive in the topic map, or cut the bag there"
        assert str(step.refusal("run.mcap, /imu")).endswith(f"{remedy}.")


def test_a_file_in_any_order_is_judged_by_its_times_of_receipt():
    order = np.random.default_rng(0).permutation(ARRIVAL.size)
    assert step_back(ARRIVAL[order], ARRIVAL[order]) is None
    assert step_back(SET_BACK[order], ARRIVAL[order]).fall == pytest.approx(4.9)


def test_only_the_recorder_that_is_set_back_hurts_no_header_stamps():
    assert step_back(ARRIVAL, SET_BACK) is None


@pytest.mark.parametrize("edges", [(20, 40, 60), (20, 30, 50)])
def test_blocks_in_another_order_are_no_step_back(edges):
    """The second and fourth block stand behind the first and third."""
    blocks = np.split(ARRIVAL, [10 * edge for edge in edges])
    mixed = np.concatenate([blocks[k] for k in (1, 3, 0, 2)])
    assert step_back(mixed, mixed) is None


def test_small_disorder_is_none():
    late = ARRIVAL.copy()
    late[[100, 105]] = late[[105, 100]]
    assert step_back(late, ARRIVAL) is None
    assert step_back(np.empty(0), np.empty(0)) is None
