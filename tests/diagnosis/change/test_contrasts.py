"""What is said of effects that begin in a drive, by readings that are drawn."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ddagr_gym.diagnosis.change.contrasts import (
    TIMES_AS_TESTS,
    _surest,
    begun_in_drive,
    contrast_of,
    contrast_sizes,
    looks_of,
    places_tried,
)
from ddagr_gym.diagnosis.change.drive_scan import DriveScan, _compared, _of_any_drive
from ddagr_gym.diagnosis.change.shifts import family_probability
from ddagr_gym.diagnosis.search.candidates import candidates_of
from ddagr_gym.diagnosis.search.inner_products import InnerProducts
from ddagr_gym.physics.effects import DriveExtent
from ddagr_gym.physics.effects.registry import effect_kinds

COUNT, ROWS = 30, 40
"""Windows, and readings of each."""

WINDOWS = SimpleNamespace(recording=np.zeros(COUNT, dtype=int), time=4.0 * np.arange(COUNT), count=COUNT)
LATER = np.arange(COUNT) >= 18


def candidate(name: str):
    kind = effect_kinds()[name]
    found = _compared(candidates_of(kind, DriveExtent(), 0)[0], 0, _of_any_drive(kind))
    assert found is not None
    return found


SCALE = 0.01
"""Of the effects' columns, so that what is not noise hardly counts beside it."""

BIAS, DRAG = candidate("gyro_bias"), candidate("viscous_drag")
BOTH = {BIAS.name, DRAG.name}


def scan_of(rng: np.random.Generator, later: float = 0.0, always: float = 0.0, rough=1.0, overall=0.3) -> DriveScan:
    """A scan of two effects in a drive of which a parameter of the robot is off.

    Args:
        rng: of columns and readings.
        later: of the first effect in later windows, in deviations of a reading.
        always: the same in all of them.
        rough: (W,) or number, deviation of the readings.
        overall: multiple of the parameter, in deviations of its prior.
    """
    columns = np.array([1.0, SCALE, SCALE]) * rng.standard_normal((COUNT, ROWS, 3))
    noise = np.broadcast_to(rough, COUNT)[:, None] * rng.standard_normal((COUNT, ROWS))
    size = (always + later * LATER) / SCALE
    residual = overall * columns[..., 0] + size[:, None] * columns[..., 1] + noise
    raw = np.concatenate([residual[..., None], columns], axis=2)
    products = InnerProducts(np.matmul(raw.transpose(0, 2, 1), raw), np.ones(1), np.zeros(1))
    return DriveScan((BIAS, DRAG), (*BIAS.keys, *DRAG.keys), products, np.zeros(1, dtype=np.int64))


def probability(scan: DriveScan, present=LATER) -> float:
    found = contrast_of(BIAS, scan.parted(present).scores(), 1)
    return 1.0 if found is None else found.probability


def test_a_size_after_a_time_is_taken_against_that_before_it():
    rng = np.random.default_rng(1)
    found = contrast_of(BIAS, scan_of(rng, later=0.8, always=3.0).parted(LATER).scores(), 1)
    assert found is not None
    assert found.apart
    assert abs(SCALE * found.value[0] - 0.8) < 3.0 * SCALE * np.sqrt(found.covariance[0, 0])
    assert SCALE * np.sqrt(found.covariance[0, 0]) < 0.1
    assert found.probability < 1e-6


def test_what_is_there_all_along_is_no_change_however_large():
    rng = np.random.default_rng(2)
    assert np.mean([probability(scan_of(rng, always=5.0)) < 0.05 for _ in range(100)]) < 0.1


@pytest.mark.parametrize("present", [LATER, np.arange(COUNT) >= COUNT - 3])
def test_ordinary_drives_rarely_show_as_much(present):
    """Of probabilities that hold 5 in 100 are below 0.05: of 300 drives 15, with a deviation of 3.8."""
    rng = np.random.default_rng(3)
    rough = np.where(np.arange(COUNT) % 5 == 0, 4.0, 1.0)
    low = sum(probability(scan_of(rng, rough=rough), present) < 0.05 for _ in range(300))
    assert low < 30


def test_times_that_share_windows_count_as_three_tests():
    """Of 300 drives with two effects 5 in 100 may have any time as improbable: 30, with a deviation of 5.3."""
    rng = np.random.default_rng(9)
    rough = np.where(np.arange(COUNT) % 5 == 0, 4.0, 1.0)
    found = [_surest(scan_of(rng, rough=rough), WINDOWS, BOTH) for _ in range(300)]
    low = sum(family_probability(item.probability, TIMES_AS_TESTS) < 0.05 for best in found for item in best.values())
    assert low < 40


def test_few_windows_on_one_side_are_few_degrees_of_freedom():
    scan = scan_of(np.random.default_rng(4))
    middle, end = (
        contrast_sizes(scan.parted(np.arange(COUNT) >= first).scores(), BIAS.keys, BIAS.ridge, ())
        for first in (COUNT // 2, COUNT - 3)
    )
    assert middle is not None
    assert end is not None
    assert middle.degrees == pytest.approx(COUNT - 2, abs=2.0)
    # three windows of one side are nearly all of the variance
    assert 1.0 < end.degrees < 3.0


def test_an_effect_that_hardly_shows_in_one_part_does_not_seem_to_be_absent_there():
    """The prior of its size draws it to nothing where the drive says nothing of it, and not where it shows."""
    rng = np.random.default_rng(10)
    columns = rng.standard_normal((COUNT, ROWS, 3))
    information = float(DRAG.ridge[0])
    visible = np.where(LATER, 1e-4 * information, 1e4 * information) / (ROWS * COUNT / 2)
    columns[..., 2] *= np.sqrt(visible)[:, None]
    size = 2.0 / np.sqrt(information)
    residual = size * columns[..., 2] + rng.standard_normal((COUNT, ROWS))
    raw = np.concatenate([residual[..., None], columns], axis=2)
    products = InnerProducts(np.matmul(raw.transpose(0, 2, 1), raw), np.ones(1), np.zeros(1))
    scan = DriveScan((BIAS, DRAG), (*BIAS.keys, *DRAG.keys), products, np.zeros(1, dtype=np.int64))
    found = contrast_of(DRAG, scan.parted(LATER).scores(), 1)
    assert found is None or found.probability > 0.01


def test_several_drives_are_not_asked():
    two = SimpleNamespace(recording=np.repeat([0, 1], COUNT // 2), time=WINDOWS.time, count=COUNT)
    assert not begun_in_drive(scan_of(np.random.default_rng(11), later=9.0), two, 2, BOTH)


@pytest.mark.parametrize("ends", [False, True])
def test_an_effect_that_begins_or_ends_is_found_with_its_time(ends):
    rng = np.random.default_rng(5)
    later, always = (-0.8, 0.8) if ends else (0.8, 0.0)
    (found,) = begun_in_drive(scan_of(rng, later, always), WINDOWS, 2, BOTH).items()
    assert found[0] == "gyro_bias"
    assert found[1].ends == ends
    assert abs(found[1].time - WINDOWS.time[LATER][0]) <= 4.0


def test_nothing_begins_in_ordinary_drives_nor_what_may_not_be_named():
    rng = np.random.default_rng(6)
    assert not any(begun_in_drive(scan_of(rng), WINDOWS, 2, BOTH) for _ in range(20))
    assert not begun_in_drive(scan_of(rng, later=0.8), WINDOWS, 2, {"viscous_drag"})


def test_short_drives_are_not_asked():
    short = SimpleNamespace(recording=np.zeros(7, dtype=int), time=4.0 * np.arange(7), count=7)
    assert places_tried(short) == []
    assert looks_of(short) == 1
    assert not begun_in_drive(scan_of(np.random.default_rng(7), later=9.0), short, 2, BOTH)


def test_times_leave_three_windows_on_either_side():
    assert (places_tried(WINDOWS)[0], places_tried(WINDOWS)[-1]) == (3, COUNT - 3)


def test_a_scan_in_parts_holds_what_the_whole_does():
    scan = scan_of(np.random.default_rng(8))
    parted = scan.parted(LATER)
    first = 1 + scan.products.nuisances
    own, elsewhere = (first + parted.keys.index(key) for key in (BIAS.keys[0], BIAS.elsewhere[0]))
    normals = parted.products.normals
    np.testing.assert_array_equal(normals[~LATER][:, own], 0.0)
    np.testing.assert_array_equal(normals[LATER][:, elsewhere], 0.0)
    np.testing.assert_allclose(
        normals[:, own, own] + normals[:, elsewhere, elsewhere], scan.products.normals[:, first, first]
    )
    assert replace(parted, keys=scan.keys).free is scan.free
