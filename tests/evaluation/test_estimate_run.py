"""A recording as a filter saw it: tables, paths, panels; the thesis's runs."""

from __future__ import annotations

import json

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.estimation import CHANNELS, ForceLaw
from ddagr_gym.evaluation.estimate_run import (
    dead_reckoned,
    estimate_recording,
    estimate_thesis_run,
    summary_of,
    table_of,
)
from ddagr_gym.evaluation.estimate_view import estimate_view, path_file
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording


@pytest.fixture(scope="module")
def first():
    return estimate_thesis_run("6.2", "", "ours", ForceLaw.coupled, 0)


@pytest.fixture(scope="module")
def by_thesis():
    return estimate_thesis_run("6.2", "", "thesis", ForceLaw.coupled, 0)


def test_the_thesis_s_first_run(first):
    assert first.recording.t[-1] == pytest.approx(25.0, abs=0.01)
    summary = summary_of(first)
    json.dumps(summary, allow_nan=False)
    assert summary["motor_rate"] == 4.5
    assert abs(summary["errors"]["radius_error"]) < 0.08
    assert summary["errors"]["v_x_rmse"] < 0.01
    assert set(summary["parameters"]) == {
        "traction_limit", "traction_rate", "lateral_stiffness", "motion_resistance"
    }  # fmt: skip
    for item in summary["parameters"].values():
        assert abs(np.log(item["value"] / item["best_fit"])) < 3.0 * item["log_deviation"]
    assert list(summary["nis"]) == list(CHANNELS)


def test_the_thesis_s_filter_is_worse_there(first, by_thesis):
    ours, theirs = summary_of(first), summary_of(by_thesis)
    assert theirs["filter"] == "thesis"
    assert theirs["force_law"] == "thesis"
    assert theirs["errors"]["v_x_rmse"] > 2.0 * ours["errors"]["v_x_rmse"]
    assert len(theirs["parameters"]) == 3
    assert table_of(by_thesis)["a1"].shape == by_thesis.run.t.shape


def test_the_second_run_has_slow_motors_and_sand():
    second = estimate_thesis_run("6.3", "", "ours", ForceLaw.coupled, 0)
    assert second.robot.motor_rate == 1.4
    assert second.recording.t[-1] == pytest.approx(38.0, abs=0.01)
    assert abs(summary_of(second)["errors"]["radius_error"]) < 0.03
    names = [panel.file for panel in estimate_view(second, "6.3").panels]
    assert names[:2] == ["figure_6_11_right_bank_speed", "figure_6_12_left_bank_speed"]


def test_panels_are_in_the_thesis_s_order(first):
    view = estimate_view(first, "6.2")
    names = [panel.file for panel in view.panels]
    assert [name.split("_")[2] for name in names if name.startswith("figure")] == list("23456789")
    assert path_file("6.2") == "figure_6_1_path"
    assert path_file(None) == "path"
    assert list(view.paths) == ["true", "estimated"]
    speed = next(panel for panel in view.panels if "longitudinal" in panel.file).lines[0]
    np.testing.assert_allclose(speed.high - speed.value, 2.0 * first.run.deviations[:, 0])
    limit = next(panel for panel in view.panels if panel.file.endswith("a1")).lines[0]
    np.testing.assert_allclose(np.log(limit.high / limit.value), 2.0 * first.run.deviations[:, 5])
    assert limit.truth == pytest.approx(np.exp(first.law_fit.logs[0]))


def test_the_table_has_slips_radius_and_path(first):
    table = table_of(first)
    middle = len(table["t"]) // 2
    assert table["radius"][middle] == pytest.approx(-0.70, abs=0.05)
    assert {"traction_limit_learned", "innovation_yaw_rate", "gyro_bias_deviation"} <= set(table)
    assert table["slip_ratio_right"][middle] == pytest.approx(-1.0, abs=0.02)
    assert all(values.shape == table["t"].shape for values in table.values())


def test_a_path_starts_at_each_span_s_pose(first):
    columns = {name: values for name, values in first.recording.columns().items() if not name.startswith("true_")}
    extras = first.recording.extras
    columns |= {f"pose_{axis}": 10.0 + extras[f"true_{axis}"] for axis in ("x", "y")} | {"pose_yaw": extras["true_yaw"]}
    recording = Recording.from_columns(columns, get_robot("ddagr"), spans=[(0, 1500), (1500, len(columns["t"]))])
    estimated = estimate_recording(
        recording, get_robot("ddagr"), get_soil("thesis_a1"), "ours", ForceLaw.coupled, False, 0
    )
    paths = dead_reckoned(estimated)
    assert list(paths) == ["measured", "estimated"]
    for row in (0, 1500):
        np.testing.assert_allclose(paths["estimated"][row], paths["measured"][row], atol=0.01)
    summary = summary_of(estimated)
    assert summary["errors"] == {}
    assert summary["parameters"]["traction_limit"]["best_fit"] == pytest.approx(127, rel=0.05)
    with pytest.raises(InputError, match="2 spans"):
        estimate_recording(recording, get_robot("ddagr"), None, "thesis", ForceLaw.coupled, False, 0)
