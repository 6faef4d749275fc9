"""Drives joined to long ones, and what their diagnosis costs."""

import json

import pytest

from benchmarks import long_drives
from benchmarks.long_drives import Cost, cost_of, joined, main, result_of


def test_steps_of_joined_drives_are_counted_on():
    one = {"seq": ["0", "0", "1"], "t": ["0", "0.05", "0"]}
    other = {"seq": ["0", "1"], "t": ["0", "0"]}
    assert joined([one, other, one]) == {
        "seq": ["0", "0", "1", "2", "3", "4", "4", "5"],
        "t": ["0", "0.05", "0", "0", "0", "0", "0.05", "0"],
    }


def test_ratios_are_to_the_shortest_drive():
    rows = result_of([Cost(10, 100.0, 150.0, 0.5), Cost(40, 250.0, 300.0, 0.75)], threads=2)["drives"]
    assert [row["times_first"] for row in rows] == [1.0, 2.5]
    assert [row["memory_times_first"] for row in rows] == [1.0, 1.5]


def test_a_process_is_measured_and_kept(tmp_path, monkeypatch):
    """The command here only shows its help, which takes time and memory too."""
    monkeypatch.setattr(long_drives, "drive_of", lambda minutes, folder: folder / "drive.csv.gz")
    monkeypatch.setattr(long_drives, "COMMAND", ("diagnose", "--help"))
    cost = cost_of(10, tmp_path, threads=1)
    assert cost.seconds > 0.0
    assert cost.processor_seconds > 0.0
    assert 0.01 < cost.gibibytes < 2.0
    assert json.loads((tmp_path / "10_min.json").read_text()) == vars(cost)
    monkeypatch.setattr(long_drives, "COMMAND", ("no such command",))
    assert cost_of(10, tmp_path, threads=1) == cost
    with pytest.raises(RuntimeError, match="exit code 2"):
        cost_of(20, tmp_path, threads=1)


def test_a_length_that_cannot_be_joined_is_refused(tmp_path, capsys):
    with pytest.raises(SystemExit) as stopped:
        main([str(tmp_path), "--minutes", "15"])
    assert stopped.value.code == 2
    assert "--minutes 15: give multiples of 10" in capsys.readouterr().err
