"""Drives with a part of a drivetrain, and how answers about them are counted."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.drivetrain_form_drives import PARTS, SECONDS, Part, commands, drives_of, robot_with, true_soil
from benchmarks.drivetrain_forms import draw, summary_of
from ddagr_gym.physics.effects.registry import effect_kinds
from ddagr_gym.presets import get_robot, get_soil

PART = "limit of the turning"


def answer(*names: str, left: float = 0.5) -> dict:
    return {"names": list(names), "left": {"nominal": 8.0, "corrected": left}}


@pytest.mark.parametrize("name", PARTS)
def test_every_part_is_missing_in_the_nominal_robot_and_has_a_name(name):
    part = PARTS[name]
    assert robot_with(part.robot) != robot_with(part.nominal)
    assert dict(part.nominal).items() <= dict(part.robot).items()
    assert set(part.names) <= set(effect_kinds())


def test_soils_and_commands_follow_the_seed():
    first, again, other = (np.random.default_rng(seed) for seed in (0, 0, 1))
    assert true_soil(first) == true_soil(again) != true_soil(other)
    assert true_soil(other) != get_soil("thesis_a1")
    driven = commands(first)
    np.testing.assert_array_equal(driven, commands(again))
    assert len(driven) == SECONDS * 50.0
    turning = 0.5 * np.abs(driven[:, 0] - driven[:, 1])
    assert turning.max() > 1.2 * PARTS[PART].robot["turning_limit"]


def test_a_part_shows_in_the_encoders_of_its_drives():
    plain, limited = (drives_of(part, 3)[0].channels for part in (Part({}), PARTS[PART]))
    for bank in ("right", "left"):
        assert np.abs(plain[f"encoder_{bank}"] - limited[f"encoder_{bank}"]).max() > 0.05
    assert get_robot("ddagr") == robot_with({})


def test_names_and_what_is_left_are_counted_by_library(tmp_path):
    found = {"0": answer("motor_saturation"), "1": answer("motor_saturation", "gyro_bias"), "2": answer("motor_lag")}
    summary = summary_of({"before": {PART: {"0": answer("motor_droop", left=3.5)}}, "after": {PART: found}})
    expected = {"drives": 3, "right": 2, "right_and_nothing_else": 1, "left": 0.5, "left_of_nominal": 8.0}
    assert summary["after"][PART] == expected
    assert summary["before"][PART]["right"] == 0
    assert summary["before"][PART]["left"] == 3.5
    draw(summary, tmp_path / "forms.png")
    assert (tmp_path / "forms.png").read_bytes().startswith(b"\x89PNG")
