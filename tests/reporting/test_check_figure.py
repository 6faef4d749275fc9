from __future__ import annotations

import math

import numpy as np
import pytest

from ddagr_gym.recordings.checks.findings import Status, judge
from ddagr_gym.recordings.checks.run import check_recording
from ddagr_gym.recordings.schema import Recording, RobotGeometry
from ddagr_gym.reporting.check_figure import check_figure, position, save_check_figure, shown_findings

PNG = b"\x89PNG\r\n\x1a\n"


def drive(with_pose=True, gyro_sign=1.0):
    t = np.arange(0, 60, 0.05)
    rng = np.random.default_rng(0)
    right, left = 3 + np.sin(0.7 * t), 3 - np.sin(0.9 * t)
    right[:100] = left[:100] = 0.0
    yaw_rate = 0.3 * (right - left) / 1.6
    columns = {"t": t, "encoder_right": right, "encoder_left": left, "command_right": right, "command_left": left}
    columns |= {"yaw_rate": gyro_sign * yaw_rate + 0.003 * rng.normal(size=t.size)}
    columns |= {f"specific_force_{a}": rng.normal(9.81 * (a == "z"), 0.05, t.size) for a in "xyz"}
    if with_pose:
        yaw = np.cumsum(yaw_rate) * 0.05
        columns |= {"pose_x": np.cumsum(np.cos(yaw)), "pose_y": np.cumsum(np.sin(yaw)), "pose_yaw": yaw}
    return Recording.from_columns(columns, RobotGeometry("some", 0.3, 0.5))


@pytest.mark.parametrize(
    ("value", "expected", "place"),
    [(1.0, (0.0, 2.0), 0.0), (0.0, (0.0, 2.0), -1.0), (3.0, (0.0, 2.0), 2.0), (5.0, (1.0, math.inf), 0.5)],
)
def test_values_are_placed_by_the_ends_of_their_range(value, expected, place):
    assert position(value, expected) == pytest.approx(place)


@pytest.mark.parametrize("with_pose", [True, False])
def test_the_figure_is_written_as_png(tmp_path, with_pose):
    recording = drive(with_pose)
    report = check_recording(recording, np.random.default_rng(0))
    path = tmp_path / "figure.png"
    save_check_figure(recording, report, np.random.default_rng(0), path)
    data = path.read_bytes()
    assert data.startswith(PNG)
    assert len(data) > 20_000


def test_the_title_says_how_many_are_suspicious_and_the_panel_shows_them():
    recording = drive(gyro_sign=-1.0)
    report = check_recording(recording, np.random.default_rng(0))
    assert report.suspicious
    figure = check_figure(recording, report, np.random.default_rng(0))
    assert f"{len(report.suspicious)} suspicious" in figure.get_suptitle()
    labels = {label.get_text() for axes in figure.axes for label in axes.get_yticklabels()}
    assert {f"{f.check}: {f.channel}" for f in report.suspicious} <= labels


def test_an_empty_recording_has_a_figure():
    recording = Recording.from_columns({"t": np.empty(0)})
    report = check_recording(recording, np.random.default_rng(0))
    assert check_figure(recording, report, np.random.default_rng(0)).axes


def test_counted_passes_are_left_out_and_suspicious_ones_stay():
    def finding(value):
        return judge("c", f"{value}", value, (value, value), (0, 1), "-", meaning="", remedy="r")

    report = check_recording(drive(), np.random.default_rng(0))
    report = type(report)(**{**report.__dict__, "findings": (finding(0.5), finding(2.0))})
    assert [f.status for f in shown_findings(report)] == [Status.SUSPICIOUS]
