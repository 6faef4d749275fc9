"""Settled speeds of a robot whose controller limits the turning, beside one whose banks are slow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ddagr_gym
from benchmarks.drivetrain.stretches import find_stretches
from benchmarks.turning_limit import draw, steady_of, summary_of
from ddagr_gym.parameters import Drivetrain
from ddagr_gym.presets import get_robot

LIMIT = 8.0


def steady(**drivetrain: float):
    """Settled speeds of a Warthog over steps of 6 s, some of them turns on the spot beyond the limit."""
    robot = replace(get_robot("warthog"), maximum_wheel_speed=30.0, drivetrain=Drivetrain(**drivetrain))
    pairs = [(4.0, 2.0), (14.0, -12.0), (-11.0, 15.0), (3.0, -1.0), (13.0, -13.0), (16.0, -8.0)]
    commands = np.concatenate([np.tile(pair, (120, 1)) for pair in pairs])
    made = ddagr_gym.simulate(commands, robot, "lete_sand_wong", rate=20.0, seed=2)
    return steady_of(find_stretches(made.recording))


def test_the_limit_is_seen_and_the_mean_is_kept() -> None:
    found = summary_of(steady(turning_limit=LIMIT))
    assert found["steps_beyond"] == 4
    assert found["turning_beyond"][1] == pytest.approx(LIMIT, abs=0.1)
    assert found["error_of_mean_beyond"] < 0.1


def test_without_it_the_wheels_turn_as_they_are_told(tmp_path) -> None:
    free = steady()
    assert summary_of(free)["turning_beyond"][0] > 11.0
    draw({"sand": free, "sand 2": steady(turning_limit=LIMIT)}, tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 10_000
