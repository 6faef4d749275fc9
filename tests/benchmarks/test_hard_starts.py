"""Starts without standing: a start, the table and the files; what the kept result says."""

import json

import pytest

from benchmarks import hard_starts
from benchmarks.hard_starts import ESTIMATORS, LOST, STARTS, final_errors, main, table


def test_a_hard_start_is_lost_by_the_law_alone():
    """Seed 5 on level ground, a step to 0.32 m/s."""
    errors = final_errors("fast", 0.0, 5)
    assert errors["inertial, law alone"] > LOST
    assert errors["inertial"] < 0.02
    assert errors["learned"] < 0.02


def test_files_and_table(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(hard_starts, "STEPS", 2)
    assert main(["--episodes", "2", "--slopes", "3", "--output", str(tmp_path / "starts.json")]) == 0
    found = json.loads((tmp_path / "starts.json").read_text())
    assert set(found["slopes"]["3"]) == set(STARTS)
    assert (tmp_path / "starts.png").stat().st_size > 10_000
    assert table(found) in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "says"),
    [(["--slopes", "steep"], "'steep'"), (["--slopes", "20"], "0 to 15"), (["--episodes", "0"], "episodes is 0")],
)
def test_bad_input_is_one_sentence(arguments, says, capsys):
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2
    assert says in capsys.readouterr().err


def test_the_result_is_of_all_starts():
    found = json.loads(hard_starts.RESULT.read_text())
    assert {start for slope in found["slopes"].values() for start in slope} == set(STARTS)
    for start in STARTS:
        own = found["slopes"]["0"][start]
        assert set(own) == set(ESTIMATORS)
        assert own["inertial"]["lost"] <= own["inertial, law alone"]["lost"]
