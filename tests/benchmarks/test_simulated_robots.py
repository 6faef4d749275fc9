"""Simulated robots with known parts: what they have, and how calibrations of them are counted."""

from __future__ import annotations

import pytest

from benchmarks.simulated_robots import CASES, COMMON, WIDER, draw
from ddagr_gym.calibration.parts import PARTS, is_stated
from ddagr_gym.presets import get_robot


def test_every_robot_has_the_parts_that_it_is_said_to_have():
    names = {part.name for part in PARTS}
    sheet = get_robot("ddagr")
    for case in CASES.values():
        assert case.parts <= names
        stated = {name for name in case.drivetrain if getattr(case.robot.drivetrain, name) > 0.0}
        assert stated == set(case.drivetrain)
        assert not any(is_stated(case.sheet, name) for name in case.drivetrain if name != "command_filter")
        assert case.robot.half_track / sheet.half_track == pytest.approx(WIDER if case.wider else 1.0)
        assert ("half_track" in case.sheet.standard_deviations) is case.wider


def test_the_picture_is_drawn(tmp_path):
    pytest.importorskip("matplotlib", reason="needs the extra report")
    rows = [{"robot": name, "kept": sorted(COMMON | {"friction"})} for name in CASES for _ in range(3)]
    draw(rows, tmp_path / "made.png")
    assert (tmp_path / "made.png").stat().st_size > 5000
