"""Turns on other plants: same scenarios on each, summaries by hand, files that were written."""

import json

import numpy as np
import pytest

from benchmarks import row_turn_plants
from benchmarks.row_turn_plants import PLANTS, Outcome, compared, drive, main, scenario, summary, table


def test_plants_share_their_scenarios():
    _, level, seed = scenario("level", 3)
    for plant in PLANTS:
        _, episode, own = scenario(plant, 3)
        assert own == seed
        assert (episode.soils, episode.sensors, episode.turn) == (level.soils, level.sensors, level.turn)
    assert scenario("heavy", 3)[1].robot.mass == pytest.approx(1.15 * level.robot.mass)
    assert scenario("late", 3)[1].command_delay == pytest.approx(level.command_delay + 0.1)
    assert scenario("level", 4)[1].soils != level.soils


def test_slopes_lie_in_any_direction():
    directions = [scenario("slope_3", number)[0].effects[0].direction for number in range(12)]
    assert np.ptp(directions) > 3.0
    assert directions == [scenario("slope_5", number)[0].effects[0].direction for number in range(12)]


def test_summary_by_hand():
    found = summary([Outcome(0.01, True), Outcome(-0.03, True), Outcome(0.02, False), Outcome(None, False)])
    assert found["radius_error_median"]["value"] == 0.02
    assert found["radius_error_p95"]["value"] == 1.0
    assert found["success_rate"]["value"] == 0.5


def test_success_is_compared_where_the_bound_makes_it():
    bound = [Outcome(0.01, True), Outcome(0.01, True), Outcome(0.5, False)]
    other = [Outcome(0.01, True), Outcome(0.4, False), Outcome(0.01, True)]
    assert compared({"B6": other, "true_path": bound})["B6"]["success_where_true_path"]["value"] == 0.5


def test_lateral_scale_scales_what_turns_the_robot():
    weak, strong = (drive("B1", plant, 0) for plant in ("lateral_0.8", "lateral_1.2"))
    as_modelled = drive("B1", "level", 0)
    # less lateral force resists the turn less: tighter, more resists it more: wider
    assert weak.error < as_modelled.error < strong.error


def test_files_are_written(tmp_path, capsys):
    out = tmp_path / "plants.json"
    assert main(["--controllers", "B1", "--plants", "level,late", "--scenarios", "2", "--output", str(out)]) == 0
    result = json.loads(out.read_text())
    assert list(result["plants"]) == ["level", "late"]
    assert out.with_suffix(".png").stat().st_size > 5000
    assert table(result) in capsys.readouterr().out


def test_rows_of_others_are_kept_where_the_scenarios_are_the_same(tmp_path, capsys):
    out = tmp_path / "plants.json"
    given = ["--plants", "level", "--output", str(out)]
    main(["--controllers", "B1,B0", "--scenarios", "2", *given])
    before = json.loads(out.read_text())["plants"]["level"]
    assert main(["--controllers", "B0", "--scenarios", "2", "--keep", *given]) == 0
    assert json.loads(out.read_text())["plants"]["level"] == before
    assert list(json.loads(out.read_text())["plants"]["level"]) == ["B1", "B0"]
    for wrong in (["--scenarios", "3", *given], ["--scenarios", "2", "--output", str(tmp_path / "none.json")]):
        with pytest.raises(SystemExit) as ended:
            main(["--controllers", "B0", "--keep", *wrong])
        assert ended.value.code == 2
        assert "--keep" in capsys.readouterr().err


def test_unknown_names_are_one_sentence(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["--plants", "levle"])
    assert ended.value.code == 2
    assert "level" in capsys.readouterr().err


def test_kept_result_is_of_this_form():
    result = json.loads(row_turn_plants.RESULT.read_text())
    assert set(result["plants"]) == set(PLANTS)
    for found in result["plants"].values():
        assert {"B1", "B4", "B6", "B6_flat", "true_path"} <= set(found)
