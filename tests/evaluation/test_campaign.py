"""Frozen scenarios, the campaign over them, and its summary."""

import json
import math

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.evaluation import scenarios as scenario_module
from ddagr_gym.evaluation.campaign import absolute_errors, plan, read_rows, run_campaign
from ddagr_gym.evaluation.controllers import controller_names, find_controller
from ddagr_gym.evaluation.scenario_sets import PLANS, as_scenario, draw_set
from ddagr_gym.evaluation.scenarios import load_scenarios, save_scenarios, scenario_names
from ddagr_gym.evaluation.summary import improvement, summaries


@pytest.fixture
def frozen(tmp_path, monkeypatch):
    """A folder with three scenarios in range, frozen."""
    monkeypatch.setattr(scenario_module, "scenario_folder", lambda: tmp_path)
    monkeypatch.setitem(PLANS, "V", PLANS["V"].__class__("three", 3, PLANS["V"].draw))
    save_scenarios("V", "three", [(*item, True) for item in draw_set("V")])
    return tmp_path


def test_a_set_reads_back_as_it_was_drawn(frozen):
    assert scenario_names() == ("V",)
    for number, (loaded, drawn) in enumerate(zip(load_scenarios("V"), draw_set("V"), strict=True)):
        seed, episode, recipe = drawn
        expected = as_scenario("V", number, seed, episode, recipe)
        assert loaded.seed == expected.seed
        assert loaded.episode.turn == expected.episode.turn
        assert loaded.episode.robot == expected.episode.robot
        assert loaded.episode.soils == expected.episode.soils
        assert loaded.episode.sensors == expected.episode.sensors
        np.testing.assert_array_equal(loaded.episode.field.values, expected.episode.field.values)


def test_a_changed_set_is_refused(frozen):
    path = frozen / "V.json"
    content = json.loads(path.read_text())
    content["scenarios"][1]["soil"]["cohesion"] *= 1.001
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match="hash"):
        load_scenarios("V")


def test_unknown_set_lists_the_names(frozen):
    with pytest.raises(InputError, match="V"):
        load_scenarios("S9")


@pytest.mark.parametrize("name", PLANS)
def test_every_plan_draws_what_it_says(name):
    plan_ = PLANS[name]
    first = [plan_.draw(np.random.default_rng([1, n]), n) for n in range(4)]
    again = [plan_.draw(np.random.default_rng([1, n]), n) for n in range(4)]
    assert first == again
    for episode, recipe in first:
        assert episode.turn.duration < 25.0
        assert recipe.kind in ("uniform", "random", "step", "patch")


def test_mirrored_pairs_are_mirrors():
    left, right = (PLANS["S7"].draw(np.random.default_rng(n), n)[0] for n in (4, 5))
    assert (left.turn.side, right.turn.side) == ("left", "right")
    assert left.soils == right.soils
    assert left.lateral_offset == -right.lateral_offset


def test_campaign_resumes_where_it_stopped(frozen, tmp_path):
    journal = tmp_path / "episodes.jsonl"
    whole = run_campaign(["B0", "B1"], ["V"], journal, processes=1)
    assert len(whole) == 6
    lines = journal.read_text().splitlines()
    journal.write_text("\n".join(lines[:4]) + "\n" + lines[4][:20])  # cut off in the fifth line
    counted = []
    again = run_campaign(["B0", "B1"], ["V"], journal, processes=1, progress=counted.append)
    assert again == whole
    assert counted[0] == 4
    assert sum(counted) == 6
    assert len(read_rows(journal)) >= 4


def test_plan_leaves_out_what_is_done(frozen):
    tasks = plan(["B0"], ["V"], {("B0", "V", 1)})
    assert [task.numbers for task in tasks] == [(0, 2)]


def rows_of(controller, errors, success=True):
    return [
        {
            "controller": controller, "set": "V", "number": n, "feasible": True, "radius_error": e,
            "radius_consistent": True, "success": success and e is not None, "within_practice": False,
            "headland_depth": 1.0, "duration": 18.0, "slip_energy": None, "wheel_speed_variation": 0.1,
            "radial_error_rms": 0.01,
        }
        for n, e in enumerate(errors)
    ]  # fmt: skip


def test_failures_count_as_worst():
    rows = rows_of("B1", [0.01, -0.02, None, 0.03])
    assert absolute_errors(rows) == [0.01, 0.02, math.inf, 0.03]
    summary = summaries(rows)["B1"]["V"]
    assert summary["undefined_radius"] == 1
    assert summary["radius_error_p95"]["value"] is None  # the worst scenario is a failure
    assert summary["radius_error_median"]["value"] == pytest.approx(0.02)
    assert summary["success_rate"]["value"] == pytest.approx(0.75)


def test_infeasible_scenarios_are_counted_apart():
    rows = rows_of("B1", [0.01, 0.02, 0.5])
    rows[2]["feasible"] = False
    summary = summaries(rows)["B1"]["V"]
    assert (summary["episodes"], summary["infeasible"]) == (2, 1)
    assert summary["radius_error_p95"]["value"] == pytest.approx(0.02)


def test_improvement_is_paired():
    rows = rows_of("B4", [0.01, 0.01, 0.05]) + rows_of("B1", [0.02, 0.03, 0.04])
    found = improvement(rows, "B4", "B1", "V")
    assert found["value"] == pytest.approx(2 / 3)
    assert improvement(rows, "B4", "B9", "V") is None


def test_every_controller_of_the_ladder_acts(frozen):
    from ddagr_gym.evaluation.campaign import drive_scenario

    scenario = load_scenarios("V")[0]
    for name in controller_names():
        run = drive_scenario(name, scenario)
        assert run.ending in (0, 1, 3)
        assert np.abs(run.columns["command_right"]).max() <= 2.0


def test_unknown_controller_lists_the_closest(frozen):
    with pytest.raises(InputError, match="true_curvature"):
        find_controller("true_curve", load_scenarios("V")[0].episode.turn)
