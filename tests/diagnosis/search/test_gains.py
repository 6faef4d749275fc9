"""Windows that are left out: which, and that drives with few windows have them too."""

import numpy as np
import pytest

from ddagr_gym.diagnosis.search.candidates import candidates_of
from ddagr_gym.diagnosis.search.gains import _fold_of, held_out_gains
from ddagr_gym.diagnosis.search.inner_products import Terms
from ddagr_gym.physics.effects import effect_kind
from ddagr_gym.physics.effects.base import DriveExtent

EXTENT = DriveExtent(60.0, (0.0, 8.0), (0.0, 6.0), 1.2, 3.0)


def terms(stride: float, count: int = 16, recordings: int = 1) -> Terms:
    """Windows of a gyro scale whose column is 1 and whose residual is 2 in each."""
    normals = np.tile(np.array([[4.0, 2.0], [2.0, 1.0]]), (count * recordings, 1, 1))
    candidates = tuple(candidates_of(effect_kind("gyro_scale"), EXTENT, 0))
    recording, time = np.repeat(np.arange(recordings), count), np.tile(stride * np.arange(count), recordings)
    return Terms(normals, np.zeros(0), np.zeros(0), candidates, recording, time)


@pytest.mark.parametrize("stride", [24.0, 12.0, 24.2, 48.0])
def test_windows_that_are_spread_along_a_drive_are_in_all_folds(stride: float) -> None:
    spread = terms(stride)
    assert np.bincount(_fold_of(spread)).tolist() == [4, 4, 4, 4]
    close = held_out_gains(terms(6.0))
    assert close["gyro_scale"] > 0.0
    assert held_out_gains(spread) == close


@pytest.mark.parametrize("stride", [2.0, 3.0, 6.0])
def test_contiguous_stretches_are_numbered_by_the_clock(stride: float) -> None:
    whole = terms(stride, recordings=2)
    assert (_fold_of(whole) == (whole.time // 6.0 + whole.recording) % 4).all()


def test_two_stretches_predict_each_other_and_a_single_one_nothing() -> None:
    assert held_out_gains(terms(6.0, count=2))["gyro_scale"] > 0.0
    assert held_out_gains(terms(2.0, count=3)) == {}
