"""A reversed gyro is found in the values, a right one and a dead one are not."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.preprocessing.reversed_gyro import find_reversed_gyro, with_gyro_reversed
from ddagr_gym.recordings.schema import Recording


def test_reversed_gyro_is_found_and_mended(drive: Callable[..., Recording]) -> None:
    right = drive()
    wrong = drive(("gyro_sign=1",))
    assert find_reversed_gyro([right]) is None
    found = find_reversed_gyro([wrong, wrong])
    assert found is not None
    assert found.correlation < -0.8
    assert found.samples == 2 * len(wrong)
    assert find_reversed_gyro([with_gyro_reversed(wrong)]) is None
    np.testing.assert_allclose(with_gyro_reversed(wrong)["yaw_rate"], -wrong["yaw_rate"])


def test_commands_serve_where_there_are_no_encoders(drive: Callable[..., Recording]) -> None:
    wrong = drive(("gyro_sign=1",))
    kept = {name: values for name, values in wrong.channels.items() if not name.startswith("encoder")}
    assert find_reversed_gyro([replace(wrong, channels=kept)]) is not None


@pytest.mark.parametrize(("effects", "reversed_"), [((), False), (("gyro_sign=1",), True)])
def test_banks_that_are_read_in_turn_serve_too(
    drive: Callable[..., Recording], effects: tuple, reversed_: bool
) -> None:
    found = drive(effects)
    rows = np.arange(len(found))
    in_turn = {
        name: np.where(rows % 6 == start, found[name], np.nan)
        for start, name in ((0, "encoder_right"), (3, "encoder_left"))
    }
    given = replace(found, channels={**found.channels, **in_turn})
    assert (find_reversed_gyro([given]) is not None) is reversed_


@pytest.mark.parametrize("level", [0.0, 0.003])
def test_dead_gyro_is_not_a_reversed_one(drive: Callable[..., Recording], level: float) -> None:
    dead = drive()
    noise = level * np.random.default_rng(0).standard_normal(len(dead))
    assert find_reversed_gyro([replace(dead, channels={**dead.channels, "yaw_rate": noise})]) is None


def test_encoders_that_contradict_commands_or_drives_that_contradict_each_other_are_no_reversed_gyro(
    drive: Callable[..., Recording],
) -> None:
    right, wrong = drive(), drive(("gyro_sign=1",))
    swapped = {"encoder_right": right["encoder_left"], "encoder_left": right["encoder_right"]}
    assert find_reversed_gyro([replace(right, channels={**right.channels, **swapped})]) is None
    assert find_reversed_gyro([wrong, wrong]) is not None
    assert find_reversed_gyro([wrong, wrong, wrong, right]) is None
