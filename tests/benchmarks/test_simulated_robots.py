"""Simulated robots with known parts: what they have, and how calibrations of them are counted."""

from __future__ import annotations

import json
from types import SimpleNamespace

import pytest

from benchmarks import simulated_robots
from benchmarks.simulated_robots import CASES, COMMON, WIDER, draw
from ddagr_gym.calibration.parts import part_of
from ddagr_gym.calibration.result import PartDecision


def test_every_robot_has_the_parts_that_it_is_said_to_have():
    besides = {
        "slower motors, late": set(), "limit of turning": {"turning_limit"}, "ramp of each bank": {"command_ramp"},
        "ramps of mean and turning": {"mean_ramp", "turning_ramp"}, "filter of commands": {"command_filter"},
        "wider track": {"geometry"},
    }  # fmt: skip
    assert {name: case.parts - COMMON for name, case in CASES.items()} == besides
    for name, case in CASES.items():
        sheet, robot = case.sheet.drivetrain, case.robot.drivetrain
        differs = {key for key in case.drivetrain if getattr(robot, key) != getattr(sheet, key)}
        assert differs == set(case.drivetrain)
        geometry = {"geometry"} if case.robot.half_track != case.sheet.half_track else set()
        assert {part_of(key).name for key in differs} | geometry == besides[name]
        assert ("half_track" in case.sheet.standard_deviations) is case.wider
    assert CASES["wider track"].robot.half_track == pytest.approx(WIDER * CASES["wider track"].sheet.half_track)


def test_false_and_lacking_parts_are_those_beside_the_truth(monkeypatch):
    parts = [
        PartDecision(name, name != "speed_loop", 0.1, 0.01) for name in ("speed_loop", "command_delay", "friction")
    ]
    outcome = SimpleNamespace(
        robot=CASES["limit of turning"].robot, calibration=SimpleNamespace(parts=parts, seconds=1.0)
    )
    monkeypatch.setattr(simulated_robots, "case_drives", lambda case, seed: [])
    monkeypatch.setattr(simulated_robots, "calibrate_drives", lambda *given: outcome)
    row = simulated_robots.row_of("limit of turning", 0)
    assert (row["false"], row["lacking"]) == (["friction"], ["speed_loop", "turning_limit"])
    assert row["relative_errors"]["turning_limit"] == 0.0
    assert row["relative_errors"]["command_delay"] == -1.0


def test_finished_calibrations_are_not_done_again_but_by_other_code(monkeypatch, tmp_path):
    done = {"robot": "wider track", "seed": 0, "kept": [], "false": [], "lacking": [], "relative_errors": {"a": 0.1}}
    asked = []
    monkeypatch.setattr(simulated_robots, "row_of", lambda name, seed: asked.append(seed) or {**done, "seed": seed})
    words = ["--robots", "wider track", "--processes", "1", "--output", str(tmp_path / "made.json"), "--seeds"]
    assert simulated_robots.main([*words, "0", "10"]) == 0
    assert simulated_robots.main([*words, "0", "10", "20"]) == 0
    assert asked == [0, 10, 20]
    assert [row["seed"] for row in json.loads((tmp_path / "made.json").read_text())["rows"]] == [0, 10, 20]
    monkeypatch.setattr(simulated_robots, "calibration_digest", lambda: "of other code")
    assert simulated_robots.main([*words, "0"]) == 0
    assert asked == [0, 10, 20, 0]


def test_the_picture_is_drawn(tmp_path):
    pytest.importorskip("matplotlib", reason="needs the extra report")
    rows = [{"robot": name, "kept": sorted(COMMON | {"friction"})} for name in CASES for _ in range(3)]
    draw(rows, tmp_path / "made.png")
    assert (tmp_path / "made.png").stat().st_size > 5000
