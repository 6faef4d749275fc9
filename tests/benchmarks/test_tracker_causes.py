"""What limits the path tracker: what is told arrives, what failed is named, files are written."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks import tracker_causes
from benchmarks.row_turn_plants import Outcome, drive
from benchmarks.tracker_causes import ARMS, Look, ToldReckoning, details, main, table
from ddagr_gym.evaluation.controllers import inertial_model
from ddagr_gym.parameters import STANDARD_GRAVITY

TRUTH = {
    "true_x": 0.1, "true_y": -0.2, "true_yaw": 0.3, "true_v_x": 0.19, "true_v_y": -0.02, "true_yaw_rate": 0.21,
}  # fmt: skip


def told(arm, slope=(0.0, 0.0)):
    estimator = ToldReckoning(inertial_model(), ARMS[arm].tell, slope)
    estimator.info = TRUTH
    estimator.reset(-0.5, 0.0, 0.0)
    return estimator.present()


def test_arms_are_told_what_they_say():
    assert told("true pose")[:6] == (0.1, -0.2, 0.3, 0.0, 0.0, 0.0)
    assert told("true motion")[:6] == (-0.5, 0.0, 0.0, 0.19, -0.02, 0.21)
    assert told("true pose and motion")[:6] == (0.1, -0.2, 0.3, 0.19, -0.02, 0.21)
    pull = STANDARD_GRAVITY * math.sin(0.05)
    assert told("true gravity", (0.05, 0.3)).gravity == pytest.approx((-pull, 0.0))  # it rises straight ahead
    assert told("true gravity", (0.05, 0.3 - math.pi / 2)).gravity == pytest.approx((0.0, pull))  # and to the right


def test_the_arm_without_changes_is_the_controller():
    ours, theirs = tracker_causes.drive("B6", "slope_3", 0), drive("B6", "slope_3", 0)
    assert ours.outcome == theirs


def test_failures_by_hand():
    fine = Look(Outcome(0.01, True), 0.02, 0.1, 0.2, 0.003, 0.004)
    wide = replace(fine, outcome=Outcome(0.2, False), lateral=0.2)
    nose = replace(fine, outcome=Outcome(0.02, False), heading=0.5)
    away = replace(fine, outcome=Outcome(None, False), lateral=None, heading=None)
    assert [item.failure for item in (fine, wide, nose, away)] == [None, "lateral", "nose", "row not reached"]
    found = details([fine, wide, nose, away])
    assert found["failures"] == {"row not reached": 1, "lateral": 1, "nose": 1}
    assert found["exit_lateral_error_median_mm"] == pytest.approx(20.0)
    assert found["v_y_error_rms_median_mm_s"] == pytest.approx(4.0)


def test_files_are_written(tmp_path, capsys):
    out = tmp_path / "causes.json"
    arms = "B6,not ahead,true pose"
    assert main(["--plants", "late", "--arms", arms, "--scenarios", "2", "--output", str(out)]) == 0
    result = json.loads(out.read_text())
    assert list(result["plants"]["late"]) == arms.split(",")
    assert out.with_suffix(".png").stat().st_size > 5000
    assert table(result) in capsys.readouterr().out
    with pytest.raises(SystemExit) as ended:
        main(["--arms", "true poes"])
    assert ended.value.code == 2
    assert "true pose" in capsys.readouterr().err


def test_kept_result_shows_the_swing_without_looking_ahead():
    found = json.loads(tracker_causes.RESULT.read_text())["plants"]["late"]
    assert set(found) == set(ARMS)
    for name in ("not ahead", "gains by hand"):
        assert found[name]["swing_median"] > 1.5 * found["B6"]["swing_median"]
    assert np.isfinite(found["B6"]["v_y_error_rms_median_mm_s"])
