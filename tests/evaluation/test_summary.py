"""Summaries by hand-made episodes."""

import math

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.report_data import size_of
from ddagr_gym.evaluation.statistics import wilson_interval
from ddagr_gym.evaluation.summary import BASELINES, PROFILE_THRESHOLDS, improvement, summaries


def rows_of(controller, errors, success=True, run=0, set_name="V"):
    """Rows with these e_R; None stands for a turn that failed."""
    return [
        {
            "controller": f"{controller}_{run}" if run else controller, "arm": controller, "run": run,
            "set": set_name, "number": n, "feasible": True, "radius_error": e, "radius_consistent": True,
            "success": success and e is not None, "within_practice": False, "radius_disagreement": 0.004,
            "headland_depth": 1.0, "duration": 18.0, "slip_energy": None, "wheel_speed_variation": 0.1,
            "radial_error_rms": None if e is None else 0.01,
            "radial_error_maximum": None if e is None else 0.02, "fit_residual": 0.001,
            "exit_lateral_error": None if e is None else -0.03 * (n + 1), "exit_heading_error": 0.1,
            "bank_stalls": int(n == 0), "robot_stalls": 0, "estimator_radius": -0.04, "estimator_speed_rms": 0.01,
        }
        for n, e in enumerate(errors)
    ]  # fmt: skip


def test_failures_count_as_worst():
    rows = rows_of("B1", [0.01, -0.02, None, 0.03])
    assert [size_of(row) for row in rows] == [0.01, 0.02, math.inf, 0.03]
    summary = summaries(rows)["B1"]["V"]
    assert summary["undefined_radius"] == 1
    assert summary["radius_error_p95"]["value"] is None  # the worst scenario is a failure
    assert summary["radius_error_median"]["value"] == pytest.approx(0.02)
    assert summary["success_rate"]["value"] == pytest.approx(0.75)
    found = wilson_interval(3, 4)
    assert summary["success_rate"]["interval"] == pytest.approx([found.low, found.high])
    # exits of 3, 6, infinitely many and 12 cm: the lower middle one is 6 cm
    assert summary["exit_lateral_error_median"]["value"] == pytest.approx(0.06)
    assert summary["exit_lateral_error_median"]["interval"][1] is None


def test_every_metric_has_a_value_and_an_interval():
    summary = summaries(rows_of("B1", [0.01, -0.02, 0.03, 0.04, 0.05]))["B1"]["V"]
    counts = {"episodes", "runs", "infeasible", "infeasible_but_made", "undefined_radius", "inconsistent_radius"}
    for key, found in summary.items():
        if key in counts:
            assert isinstance(found, int)
        elif key == "profile":
            assert len(found["thresholds"]) == len(found["share"]) == len(found["low"]) == len(found["high"])
        elif found is not None:
            low, high = found["interval"]
            assert low <= found["value"] <= high
    assert summary["slip_energy_median"] is None  # no episode has one
    assert summary["estimator_radius_median"]["value"] == pytest.approx(0.04)
    assert summary["stall_rate"]["value"] == pytest.approx(0.2)
    assert summary["radius_error_signed_median"]["value"] == pytest.approx(0.03)


def test_profile_is_the_share_below_each_threshold():
    profile = summaries(rows_of("B1", [0.011, 0.022, 0.033, None]))["B1"]["V"]["profile"]
    share = dict(zip(profile["thresholds"], profile["share"], strict=True))
    assert tuple(profile["thresholds"]) == PROFILE_THRESHOLDS
    assert (share[0.01], share[0.015], share[0.025], share[0.2]) == (0.0, 0.25, 0.5, 0.75)


def test_infeasible_scenarios_are_counted_apart():
    rows = rows_of("B1", [0.01, 0.02, 0.5])
    rows[2]["feasible"] = False
    summary = summaries(rows)["B1"]["V"]
    assert (summary["episodes"], summary["infeasible"], summary["infeasible_but_made"]) == (2, 1, 1)
    assert summary["radius_error_p95"]["value"] == pytest.approx(0.02)
    for row in rows:
        row["feasible"] = False
    assert "radius_error_median" not in summaries(rows)["B1"]["V"]


def test_improvement_is_paired():
    rows = rows_of("B4", [0.01, 0.01, 0.05]) + rows_of("B1", [0.02, 0.03, 0.04])
    found = improvement(rows, "B4", "B1", "V")
    expected = wilson_interval(2, 3)
    assert found["value"] == pytest.approx(2 / 3)
    assert found["interval"] == pytest.approx([expected.low, expected.high])
    assert improvement(rows, "B4", "B9", "V") is None
    summary = summaries(rows)
    assert summary["B4"]["V"]["improvement_over_B1"] == found
    assert "improvement_over_B4" not in summary["B4"]["V"]
    assert summary["B1"]["V"]["improvement_over_B4"]["value"] == pytest.approx(1 / 3)
    assert BASELINES == ("B1", "B4")


def test_infeasible_scenarios_do_not_enter_the_improvement():
    rows = rows_of("B4", [0.01, 0.09]) + rows_of("B1", [0.02, 0.03])
    for row in rows:
        row["feasible"] = row["number"] == 0
    assert improvement(rows, "B4", "B1", "V")["value"] == 1.0


def test_seeds_of_one_arm_are_runs():
    rng = np.random.default_rng(3)
    seeds = [rows_of("ppo", list(0.01 * k + 0.001 * rng.random(20)), run=k) for k in (1, 2, 3)]
    rows = [row for seed in seeds for row in seed] + rows_of("B1", [0.025] * 20)
    summary = summaries(rows)["ppo"]["V"]
    assert (summary["runs"], summary["episodes"]) == (3, 60)
    assert 0.02 <= summary["radius_error_median"]["value"] <= 0.021
    # two of three seeds beat 2.5 % everywhere; a seed more or less of them moves the whole share
    found = summary["improvement_over_B1"]
    assert found["value"] == pytest.approx(2 / 3)
    assert found["interval"][0] < 0.35
    assert found["interval"][1] == 1.0
    # success is counted by scenario, not by seed and scenario
    expected = wilson_interval(20, 20)
    assert summary["success_rate"]["interval"] == pytest.approx([expected.low, expected.high])


def test_seeds_must_have_driven_the_same_scenarios():
    rows = rows_of("ppo", [0.01, 0.02], run=1) + rows_of("ppo", [0.01], run=2)
    with pytest.raises(InputError, match="lacks 1 episodes"):
        summaries(rows)


def test_two_controllers_that_are_one_seed_of_one_arm_are_refused():
    twins = rows_of("ppo", [0.01, 0.02], run=1)
    other = [row | {"controller": "elsewhere/seed_1/policy.npz"} for row in twins]
    with pytest.raises(InputError, match=r"'ppo_1' and 'elsewhere/seed_1/policy.npz' are both training seed 1"):
        summaries([*twins, *other])


def test_the_radius_of_a_part_of_a_turn_counts_as_worst():
    rows = rows_of("B1", [0.01, 0.02, 0.03, 0.04])
    rows[1]["status"] = "SHORT_ARC"
    assert [size_of(row) for row in rows] == [0.01, math.inf, 0.03, 0.04]
    summary = summaries(rows)["B1"]["V"]
    assert summary["undefined_radius"] == 1
    assert summary["radius_error_p95"]["value"] is None
    assert summary["radius_error_signed_median"]["value"] == pytest.approx(0.03)
