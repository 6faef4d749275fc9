"""The learned estimators beside the filters: errors, coverage and pose of turns."""

import numpy as np
import pytest

from benchmarks.learned_estimator import CARRIED, ESTIMATORS, TITLES, drive, judge, main, plant_table, table
from ddagr_gym.evaluation.runs import TurnRun


@pytest.fixture(scope="module")
def run() -> TurnRun:
    return drive("level", 0)


def made_up(rng, size: float):
    """What a drive comes to whose estimates are off by ``size`` [m/s]."""
    return {
        "square": (size**2 * np.ones(2)).tolist(),
        "covered": rng.uniform(0.85, 0.95, 2).tolist(),
        "nees": [1.0, 1.0],
        "exit": (0.03**2 * np.ones(3)).tolist(),
    }


def test_every_estimator_is_judged_on_the_same_turn(run):
    found = judge(run)
    assert set(found) == set(ESTIMATORS)
    for own in found.values():
        assert 0.0 < min(own["square"]) < max(own["square"]) < 0.05**2
        assert max(own["exit"]) < 0.5**2
    assert found["correction"]["square"] != found["inertial"]["square"]
    assert {name for name, own in found.items() if "carried" in own} == set(CARRIED)
    assert found["inertial"]["carried"] != found["inertial"]["exit"]
    assert max(found["pose"]["carried"]) < 0.1**2


def test_an_estimator_that_knows_the_truth_has_no_error(run, monkeypatch):
    truth = np.column_stack([run.columns[f"true_{name}"] for name in ("v_x", "v_y", "yaw_rate")])
    known = truth, truth[9::10, :2], np.tile(1e-6 * np.eye(2), (len(truth) // 10, 1, 1))
    monkeypatch.setitem(ESTIMATORS, "flat", ("truth", lambda run: known))
    own = judge(run)["flat"]
    assert own["square"] == [0.0, 0.0]
    assert own["covered"] == [1.0, 1.0]
    assert max(own["exit"]) < 5e-3**2  # the trapezoidal rule's


def test_the_table_has_ratios_to_the_bound():
    rng = np.random.default_rng(0)
    drives = [{name: made_up(rng, 0.004) for name in ESTIMATORS} for _ in range(10)]
    bound = {"v_x_mm_s": {"value": 0.5}, "v_y_mm_s": {"value": 2.0}}
    found = plant_table(drives, bound, 8)
    assert found["alone"]["v_y_mm_s"]["value"] == pytest.approx(4.0)
    assert found["alone"]["v_y_over_bound"]["value"] == pytest.approx(2.0)
    assert found["alone"]["exit_along_mm"]["value"] == pytest.approx(30.0)
    for name in CARRIED:
        assert "carried_along_mm" not in found[name]
    carried = [{name: own | {"carried": own["exit"]} for name, own in item.items()} for item in drives]
    assert plant_table(carried, bound, 8)["pose"]["carried_across_mm"]["value"] == pytest.approx(30.0)
    text = table({"bound_turns": 8, "plants": {"level": {"estimators": found, "bound": bound}}})
    assert len(text.splitlines()) == 2 + len(ESTIMATORS) + 1
    assert TITLES["level"] in text


def test_a_plant_where_no_turn_reaches_the_row_has_no_pose():
    rng = np.random.default_rng(0)
    drives = [{name: made_up(rng, 0.004) | {"exit": None} for name in ESTIMATORS} for _ in range(3)]
    found = plant_table(drives, None, 8)
    assert found["inertial"]["exit_along_mm"] is None
    assert "not reached" in table({"bound_turns": 8, "plants": {"level": {"estimators": found, "bound": None}}})


@pytest.mark.parametrize("words", [["--plants", "moon"], ["--scenarios", "1"], ["--scenarios", "101"]])
def test_bad_arguments_are_one_sentence(words, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(words)
    assert "Traceback" not in capsys.readouterr().err
