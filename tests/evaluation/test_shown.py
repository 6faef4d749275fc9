"""Which episodes a page shows, and that driving them again gives what the campaign had."""

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.campaign import drive_scenario, episode_row
from ddagr_gym.evaluation.controllers import estimates_path
from ddagr_gym.evaluation.report_data import Arm, Evaluation, SetNote
from ddagr_gym.evaluation.scenarios import load_scenarios
from ddagr_gym.evaluation.shown import (
    drive_shown,
    estimated_track,
    film_rows,
    infeasible_soils,
    main_arms,
    overlaid_rows,
    parse_replay,
    replayed,
    tracked_rows,
)


def rows_of(controller, errors, infeasible=()):
    return [
        {
            "controller": controller, "set": "V", "number": n, "radius_error": e, "success": e < 0.1,
            "feasible": n not in infeasible,
        }
        for n, e in enumerate(errors)
    ]  # fmt: skip


def metrics(value):
    return {"V": {"radius_error_median": {"value": value, "interval": None}}}


@pytest.fixture
def evaluation():
    names = {"B1": 0.05, "B4": 0.02, "true_path": 0.001}
    rows = [
        row for name, size in names.items() for row in rows_of(name, size + 0.01 * np.arange(10.0), infeasible=(9,))
    ]
    arms = [Arm("B1", ""), Arm("B4", ""), Arm("true_path", "", deployable=False)]
    summary = {name: metrics(value) for name, value in names.items()}
    return Evaluation(rows, summary, arms, [SetNote("V", "", 100, 10, "")])


def test_every_arm_is_shown_on_the_same_feasible_scenarios(evaluation):
    rows = overlaid_rows(evaluation, count=4)
    numbers = {name: [row["number"] for row in rows if row["controller"] == name] for name in ("B1", "B4")}
    assert numbers["B1"] == numbers["B4"] == [0, 2, 5, 8]
    assert len(rows) == 8  # an upper bound is not among them


def test_the_best_arms_come_before_the_rest(evaluation):
    assert main_arms(evaluation, 1) == ["B4"]
    assert main_arms(evaluation, 5) == ["B1", "B4"]


def test_videos_are_of_the_typical_and_the_worst_turn(evaluation):
    shown = [(title, row["controller"], row["number"]) for title, row in film_rows(evaluation)]
    assert shown == [
        ("A typical turn of B4", "B4", 4),
        ("The worst turn of B4", "B4", 8),
        ("The worst turn of B1", "B1", 8),
    ]


def test_only_arms_that_steer_by_the_filter_are_tracked(evaluation):
    assert [(row["controller"], row["number"]) for row in tracked_rows(evaluation)] == [("B4", 4)]


def test_a_drive_is_repeated_to_the_bit_and_its_estimate_agrees_with_the_metric():
    row, run = replayed("B4", "V", 3)
    scenario = load_scenarios("V")[3]
    assert row == episode_row("B4", scenario, drive_scenario("B4", scenario))
    (shown,) = drive_shown([row | {"feasible": True}], with_estimate=True)
    assert shown.radius_error == row["radius_error"]
    assert shown.estimate_error == pytest.approx(row["estimator_dead_reckoning"], rel=0.02)
    assert shown.path[-1] == pytest.approx([run.columns["true_x"][-1], run.columns["true_y"][-1]])
    track = estimated_track(run)
    assert np.hypot(*(track[0, :2] - [run.columns["true_x"][0], run.columns["true_y"][0]])) < 1e-3
    # heading by the gyro: within the filter's own bias of the true half turn
    assert abs(track[-1, 2]) == pytest.approx(abs(run.columns["true_yaw"][-1]), abs=0.05)


def test_the_estimate_of_a_tracker_is_that_of_its_own_filter():
    _, run = replayed("B6", "V", 3)
    true = np.column_stack([run.columns["true_x"], run.columns["true_y"]])
    own, other = (np.hypot(*(estimated_track(run, name)[-1, :2] - true[-1])) for name in ("B6", "B4"))
    assert own < 0.05
    assert own != other
    corrected = estimated_track(run, "B6_pose")
    assert corrected.shape == (len(true), 3)
    assert 0.0 < np.hypot(*(corrected[-1, :2] - true[-1])) < 0.05
    assert np.hypot(*(corrected[-1, :2] - true[-1])) != own
    assert [estimates_path(name) for name in ("B6", "B4", "B1")] == [True, True, False]


def test_infeasible_soils_are_listed_once(evaluation):
    (soil,) = infeasible_soils(evaluation.rows)
    assert soil["scenario"] == "V 9"
    assert soil["cohesion [Pa]"] == load_scenarios("V")[9].episode.soils.cohesion


def test_a_scenario_is_named_by_controller_set_and_number():
    assert parse_replay("B4:V:17") == ("B4", "V", 17)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("B4:V", "controller, set and number"),
        ("B4:V:x", "controller, set and number"),
        ("B4:V:-1", "controller, set and number"),
        ("B4:V:100", "0 to 99"),
        ("B4:Q:1", "unknown scenario set"),
        ("B9:V:1", "unknown controller"),
    ],
)
def test_bad_names_are_one_sentence(text, message):
    with pytest.raises(InputError, match=message):
        parse_replay(text)
