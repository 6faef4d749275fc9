"""Rivals share the weight as their costs say, and windows that disagree keep a rival in the set."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ddagr_gym.diagnosis.result.equivalence import FORM, equivalence_weights, equivalents
from ddagr_gym.diagnosis.search.scanned_model import Rival
from ddagr_gym.physics.effects import load_effects


def rival(effect: str, window_cost: np.ndarray, prior: float = 0.0, gain: float = 0.0) -> Rival:
    found = load_effects(effect)
    point = SimpleNamespace(effects=found)
    fitted: Any = SimpleNamespace(window_cost=window_cost, cost=float(window_cost.sum()) + prior, point=point)
    return Rival(found[0].name, fitted, gain)


def weights(*rivals: Rival, dispersion: float = 1.0) -> dict[str, float]:
    return equivalence_weights(rivals, dispersion, np.random.default_rng(1))


def test_equal_costs_share_equally_and_clear_ones_do_not() -> None:
    cost = np.full(30, 10.0)
    # both five times the least meaningful size: equally plausible
    same = weights(rival("gyro_scale=1.05", cost), rival("imu_misalignment=0.1745", cost))
    assert sum(same.values()) == pytest.approx(1.0)
    assert same["gyro_scale"] == pytest.approx(0.5, abs=0.2)
    clear = weights(rival("gyro_scale=1.05", cost), rival("imu_misalignment=0.1745", cost + 1.0))
    assert clear == {"gyro_scale": 1.0}


def test_what_was_chosen_among_many_weighs_as_one_of_them() -> None:
    cost = np.full(30, 10.0)
    rivals = [rival("gyro_scale=1.05", cost), rival("imu_misalignment=0.1745", cost)]
    even = equivalence_weights(rivals, 1.0, np.random.default_rng(1))
    found = equivalence_weights(rivals, 1.0, np.random.default_rng(1), choices={"imu_misalignment": 9})
    odds, before = (w["imu_misalignment"] / w["gyro_scale"] for w in (found, even))
    assert odds == pytest.approx(before / 9.0)


def test_one_window_in_favour_keeps_a_rival_alive() -> None:
    cost = np.full(30, 10.0)
    other = cost.copy()
    other[:1] += 6.0  # in a third of the resamplings this window is missing
    found = weights(rival("gyro_scale=1.05", cost), rival("imu_misalignment=0.1745", other))
    assert 0.1 < found["imu_misalignment"] < 0.4


def test_size_settles_ties() -> None:
    cost = np.full(30, 10.0)
    small = weights(rival("accelerometer_bias=0.1", cost), rival("imu_tilt=0,pitch=0.0102", cost))
    large = weights(rival("accelerometer_bias=0.9", cost), rival("imu_tilt=0,pitch=0.0917", cost))
    assert small["accelerometer_bias"] > 0.6
    assert large["imu_tilt"] > 0.6


def test_sizes_below_the_least_that_matters_are_equally_unusual() -> None:
    """A tenth or a hundredth of it: the one that fits better by half a unit of cost leads."""
    cost = np.full(30, 10.0)
    small, smaller = rival("gyro_scale=1.001", cost + 0.5 / 30.0), rival("imu_misalignment=0.000349", cost)
    assert weights(smaller, small) == pytest.approx({"imu_misalignment": 0.62, "gyro_scale": 0.38}, abs=0.01)


def test_what_a_form_may_cost_keeps_a_rival_of_a_strong_effect() -> None:
    cost, worse = np.full(30, 10.0), np.full(30, 11.0)
    weak = weights(rival("gyro_scale=1.05", cost, gain=60.0), rival("imu_misalignment=0.1745", worse))
    strong = weights(rival("gyro_scale=1.05", cost, gain=30.0 / FORM), rival("imu_misalignment=0.1745", worse))
    assert weak == {"gyro_scale": 1.0}
    # the difference of 30 is what the form may cost
    assert strong["imu_misalignment"] == pytest.approx(1.0 / (1.0 + np.e), abs=0.05)


def test_what_an_effect_made_idle_is_no_rival_of_it() -> None:
    """Uneven encoders came first; beside a droop they explained nothing more and went."""
    cost = np.full(30, 10.0)
    encoders = rival("encoder_scale=1.02", cost)
    droop_alone, droop_beside = rival("motor_droop=0.002", cost + 9.0), rival("motor_droop=0.002", cost - 9.0)
    models = [SimpleNamespace(dispersion=1.0, names=names) for names in ((), ("motor_droop",))]
    found: Any = SimpleNamespace(steps=((encoders, droop_alone), (droop_beside,)), models=models, chosen=models[-1])
    assert equivalents(found, "motor_droop", np.random.default_rng(1)) == {"motor_droop": 1.0}


def test_an_effect_swapped_in_keeps_the_rivals_of_its_step() -> None:
    cost = np.full(30, 10.0)
    tilt, bias = rival("imu_tilt=0,pitch=0.0102", cost), rival("accelerometer_bias=0.1", cost)
    models = [SimpleNamespace(dispersion=1.0, names=names) for names in ((), ("accelerometer_bias", "slope"))]
    found: Any = SimpleNamespace(steps=((tilt, bias),), models=models, chosen=models[-1])
    assert set(equivalents(found, "accelerometer_bias", np.random.default_rng(1))) == {"imu_tilt", "accelerometer_bias"}
    assert equivalents(found, "slope", np.random.default_rng(1)) == {"slope": 1.0}
