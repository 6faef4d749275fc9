"""Velocity errors against the filters' own variances: by hand, on one turn, and as files."""

import json

import numpy as np
import pytest

from benchmarks import filter_velocities
from benchmarks.filter_velocities import (
    DEVIATIONS,
    VELOCITY_FILTERS,
    judge_velocities,
    main,
    table,
    velocity_drive,
    velocity_table,
)
from ddagr_gym.control.timing import CONTROL_INTERVAL
from ddagr_gym.evaluation.controllers import STANDING


def judged(errors, deviation):
    """Of errors (K, 2) after standing, with one deviation for both velocities."""
    estimates = np.concatenate([np.full((STANDING, 2), 9.0), errors])
    samples = CONTROL_INTERVAL * len(estimates)
    columns = {"true_v_x": np.zeros(samples), "true_v_y": np.zeros(samples)}
    return judge_velocities(estimates, np.tile(deviation**2 * np.eye(2), (len(estimates), 1, 1)), columns)


def test_figures_by_hand():
    errors = np.tile([0.02, 0.0], (24, 1))
    errors[:6, 1] = 0.05
    found = judged(errors, 0.01)
    assert found["square"] == pytest.approx([4e-4, 6.25e-4])
    assert found["covered"] == pytest.approx([0.0, 0.75])
    assert found["nees"] == pytest.approx([2.0, 2.0])  # (2^2 + 0)/2 at either instant
    assert judged(errors, 1.01 * 0.02 / DEVIATIONS)["covered"][0] == 1.0


def test_a_consistent_filter_is_called_so():
    rng = np.random.default_rng(0)
    drives = [{name: judged(rng.normal(0.0, 0.01, (240, 2)), 0.01) for name in VELOCITY_FILTERS} for _ in range(30)]
    found = velocity_table(drives)["inertial_filter"]
    assert found["v_y_covered"]["value"] == pytest.approx(0.9, abs=0.02)
    assert found["nees"]["value"] == pytest.approx(1.0, abs=0.1)
    assert found["nees_share_of_instants_inside"] > 0.8
    assert found["v_x_rmse_mm_s"] == pytest.approx(10.0, rel=0.05)


def test_on_a_slope_the_inertial_filter_knows_its_side_slip_and_the_other_does_not():
    found = velocity_drive("slope_3", 1)
    inertial, flat = found["inertial_filter"], found["filter"]
    assert inertial["square"][1] < 0.25 * flat["square"][1]
    assert inertial["covered"][1] > flat["covered"][1] + 0.3
    assert np.mean(flat["nees"]) > 5.0 * np.mean(inertial["nees"])


def test_files_are_written_and_bad_names_are_one_sentence(tmp_path, capsys):
    out = tmp_path / "velocities.json"
    assert main(["--plants", "late", "--scenarios", "2", "--output", str(out)]) == 0
    assert table(json.loads(out.read_text())) in capsys.readouterr().out
    assert out.with_suffix(".png").stat().st_size > 5000
    with pytest.raises(SystemExit) as ended:
        main(["--plants", "lat"])
    assert ended.value.code == 2


def test_kept_result_is_of_every_plant():
    result = json.loads(filter_velocities.RESULT.read_text())
    assert set(result["plants"]) == set(filter_velocities.PLANTS)
