"""What is kept of the turns with stressed sensors."""

import json

import pytest

pytest.importorskip("matplotlib", reason="needs the extra report")
pytest.importorskip("pyarrow", reason="needs the extra io")

from benchmarks.noisy_sensors import CONTROLLERS, RESULT, SETS, result_of
from benchmarks.second_sets import for_picture, table, version_of
from ddagr_gym.evaluation.scenarios import set_hash


def test_the_record_is_of_what_ships():
    committed = json.loads(RESULT.read_text())
    assert committed["controllers"] == {name: version_of(name) for name in CONTROLLERS}
    assert committed["scenarios"] == {name: set_hash(name) for name in SETS}


def metric(value):
    return {"value": value, "interval": [0.9 * value, 1.1 * value]}


def test_both_controllers_stand_beside_each_other_on_every_set():
    def summary(error):
        names = ("radius_error_median", "radius_error_p95", "success_rate")
        return {"episodes": 100, "infeasible": 0, "unkept": 1.0, **dict.fromkeys(names, metric(error))}

    summaries = {arm: {name: summary(0.02 * k) for name in SETS} for k, arm in enumerate(CONTROLLERS, start=1)}
    for name in SETS:
        summaries["B6_pose_wide"][name]["improvement_over_B6"] = metric(0.4)
    found = result_of(summaries, SETS)
    assert list(found["sets"]) == list(found["scenarios"]) == list(SETS)
    assert found["sets"]["S5d"]["B6_pose_wide"]["improvement_over_B6"]["value"] == 0.4
    assert "unkept" not in found["sets"]["S5d"]["B6"]
    assert for_picture(found)["S5"]["B6"]["success_rate"]["value"] == 0.02
    assert table(found).count("\n") == 1 + len(SETS)
