from __future__ import annotations

import json
import math

import numpy as np
import pytest

from ddagr_gym.recordings.checks.across import across_runs, pooled_value
from ddagr_gym.recordings.checks.findings import CheckFinding, CheckReport, Status, judge, not_testable
from ddagr_gym.recordings.checks.run import check_recording
from ddagr_gym.recordings.schema import Recording


def judged(value, half, expected=(0.9, 1.1)):
    return judge("c", "x", value, (value - half, value + half), expected, "-", meaning="m", remedy="r", suspects=("s",))


@pytest.mark.parametrize(
    ("value", "half", "status"),
    [
        (1.0, 0.01, Status.PASS),
        (1.2, 0.2, Status.PASS),
        (1.2, 0.05, Status.SUSPICIOUS),
        (0.7, 0.1, Status.SUSPICIOUS),
        (5.0, math.inf, Status.PASS),
    ],
)
def test_only_a_whole_interval_outside_the_range_is_suspicious(value, half, status):
    finding = judged(value, half)
    assert finding.status is status
    assert bool(finding.remedy) == bool(finding.suspects) == (status is Status.SUSPICIOUS)


def test_the_report_is_strict_json_with_the_documented_keys(make_drive):
    report = check_recording(make_drive(seconds=30), np.random.default_rng(0))
    content = json.loads(json.dumps(report.to_json(), allow_nan=False))
    assert content["schema_version"] == 1
    assert content["verdict"] == "pass"
    assert set(content["findings"][0]) == {
        "check",
        "channel",
        "status",
        "value",
        "interval",
        "expected",
        "unit",
        "meaning",
        "remedy",
        "suspects",
    }
    assert {f["status"] for f in content["findings"]} <= {"pass", "suspicious", "not_testable"}


def test_values_that_are_not_finite_become_null():
    finding = CheckFinding("c", "x", Status.PASS, "m", value=math.nan, interval=(-math.inf, 1.0))
    assert finding.to_json()["value"] is None
    assert finding.to_json()["interval"] == [None, 1.0]


def test_doubts_of_the_schema_make_the_verdict_suspicious(make_drive):
    drive = make_drive(seconds=20)
    wrong = Recording.from_columns({**drive.columns(), "yaw_rate": 57.3 * drive["yaw_rate"]}, drive.meta.geometry)
    report = CheckReport.of(wrong, [not_testable("c", "x", "why", "do")])
    assert report.to_json()["verdict"] == "suspicious"
    assert any("deg/s" in sentence for sentence in report.sentences)


@pytest.mark.parametrize("rows", [0, 1, 2, 5])
def test_tiny_recordings_are_checked_without_an_error(rows):
    report = check_recording(Recording.from_columns({"t": np.arange(float(rows))}), np.random.default_rng(0))
    assert report.sentences
    assert not report.suspicious


def test_the_same_seed_gives_the_same_report(make_drive):
    reports = [check_recording(make_drive(), np.random.default_rng(3)).to_json() for _ in range(2)]
    assert reports[0] == reports[1]


def test_pooling_equal_runs_shrinks_the_interval_by_the_root_of_their_number():
    mean, (low, high) = pooled_value([1.0] * 9, [(0.7, 1.3)] * 9)
    assert mean == pytest.approx(1.0)
    assert high - low == pytest.approx(0.6 / 3)


def test_runs_that_contradict_each_other_widen_the_interval():
    _, (low, high) = pooled_value([0.5, 1.5], [(0.45, 0.55), (1.45, 1.55)])
    assert low < 0.5
    assert high > 1.5


def test_a_precise_run_weighs_more():
    mean, _ = pooled_value([1.0, 2.0], [(0.9, 1.1), (1.0, 3.0)])
    assert mean == pytest.approx(1.0 + 1 / 101, rel=1e-3)


def test_several_runs_see_what_one_cannot(make_drive):
    """A gyro scale just outside its range: no single short run is sure, four together are."""
    drives = [make_drive(seed=s, seconds=20, gyro_scale=1.058) for s in range(6)]
    reports = [check_recording(d, np.random.default_rng(0)) for d in drives]
    key = ("sign_and_scale", "yaw_rate to pose_yaw")
    single = [f for r in reports for f in r.suspicious if (f.check, f.channel) == key]
    together = {(f.check, f.channel): f for f in across_runs(drives, reports)}
    assert together[key].status is Status.SUSPICIOUS
    assert len(single) < 6
    assert across_runs(drives[:1], reports[:1]) == []
