"""First guesses stay inside what an effect allows."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ddagr_gym.diagnosis.candidates import candidates_of
from ddagr_gym.diagnosis.hypotheses import first_guess, slower_loop
from ddagr_gym.diagnosis.problem import Point
from ddagr_gym.physics.effects import load_effects
from ddagr_gym.physics.effects.base import DriveExtent
from ddagr_gym.physics.effects.registry import effect_kinds

EXTENT = DriveExtent(60.0, (-3.0, 3.0), (-2.0, 4.0), 1.2, 3.0)


def test_every_candidate_becomes_an_effect_whatever_its_multiples() -> None:
    for name, kind in effect_kinds().items():
        if name == "sensor_hold":
            continue
        for candidate in candidates_of(kind, EXTENT, 0):
            for size in (0.1, 0.3333333333333333, 1.7, 1e6):
                multiples = [size * (k + 1) / 3.0 for k in range(len(candidate.probes))]
                assert first_guess(candidate, multiples).name == name


def test_reversed_axes_go_all_the_way_together() -> None:
    both = candidates_of(effect_kinds()["accelerometer_sign"], EXTENT, 0)[-1]
    assert first_guess(both, [1.0]).as_mapping()["parameters"] == {"flip_x": 1.0, "flip_y": 1.0}


def loop(value: float, *effects: str) -> Point | None:
    problem: Any = SimpleNamespace(
        nuisances=SimpleNamespace(parameters=(SimpleNamespace(name="mass"), SimpleNamespace(name="motor_rate"))),
        prior=np.array([0.03, 0.0667]),
        robot=SimpleNamespace(motor_rate=4.5),
    )
    return slower_loop(problem, Point(np.array([0.01, value]), np.zeros((1, 8)), load_effects(effects)))


def test_a_slow_loop_is_a_lag_of_the_same_time_constant() -> None:
    told = loop(-0.893, "gyro_scale=1.1")
    assert told is not None
    assert told.values.tolist() == [0.01, 0.0]
    assert [effect.name for effect in told.effects] == ["gyro_scale", "motor_lag"]
    assert 1.0 / 4.5 + told.effects[1].lag == pytest.approx(1.0 / (4.5 * math.exp(-0.893)))


@pytest.mark.parametrize(("value", "effects"), [(-0.2, ()), (0.893, ()), (-0.893, ("motor_lag=0.1",))])
def test_ordinary_loops_fast_ones_and_those_with_a_lag_stay(value: float, effects: tuple[str, ...]) -> None:
    assert loop(value, *effects) is None
