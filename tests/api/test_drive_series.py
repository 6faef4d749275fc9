"""`diagnose_drives` and its command: one answer per drive, kept by content, whatever is wrong with others."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import ddagr_gym
from ddagr_gym.api import drive_series, drive_tasks
from ddagr_gym.api.drive_tasks import FAULT, tasks_of
from ddagr_gym.cli import main
from ddagr_gym.diagnosis.series.files import load
from ddagr_gym.errors import InputError
from tests.diagnosis.series.made_points import answer

ORDINARY = SimpleNamespace(
    robot=SimpleNamespace(name="ddagr"), source="cal", references=(SimpleNamespace(drive="a"),), soils={"field": None}
)


@pytest.fixture
def drives(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of six drives, and a calibration; a drive's content is what its first size is shifted by."""
    folder, calibration = tmp_path / "drives", tmp_path / "cal"
    for path in (folder, calibration):
        path.mkdir()
    for name in ("calibration.json", "robot.yaml", "bank.json"):
        (calibration / name).write_text("made")
    for number in range(1, 7):
        (folder / f"run_{number}.csv").write_text(f"{14 * (number >= 4)} {number}")
    monkeypatch.setattr(drive_series, "load_calibrated", lambda folder: (ORDINARY, {}))
    return folder


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the drives that are worked on; "stop" and "fault" as contents do what they say."""
    names: list[str] = []

    def made(task, setting, calibrated, file, column_map):
        content = file.read_text().split()
        if content[0] == "stop":
            raise KeyboardInterrupt
        names.append(task.name)
        if content[0] == "bad":
            return f"{task.name} holds no drive."
        shifts = 0.2 * np.random.default_rng(int(content[1])).normal(size=6)
        shifts[0] += float(content[0])
        return answer(shifts, *(("gyro_bias",) if float(content[0]) else ()))

    monkeypatch.setattr(drive_tasks, "answer_of", made)
    return names


def test_a_bad_file_is_a_row_and_the_rest_goes_on(drives, asked, tmp_path):
    (drives / "run_2.csv").write_text("bad 2")
    result = ddagr_gym.diagnose_drives(drives, tmp_path / "cal")
    assert [row.refused for row in result.drives] == [False, True, False, False, False, False]
    assert result.refused[0].sentence == "run_2.csv holds no drive."
    assert [event.drive for event in result.events] == [3]
    assert result.headline.startswith("From drive 4 of 6 (run_4.csv) on something changed")


def test_what_is_answered_is_not_asked_again(drives, asked, tmp_path):
    said: list[str] = []
    for _ in range(2):
        ddagr_gym.diagnose_drives(drives, tmp_path / "cal", cache=tmp_path / "kept", progress=said.append)
    assert len(asked) == 6
    assert said[-1] == "6 of 6 drives have an answer already"
    (drives / "run_3.csv").write_text("0 30")
    (drives / "run_7.csv").write_text("14 7")
    ddagr_gym.diagnose_drives(drives, tmp_path / "cal", cache=tmp_path / "kept")
    assert asked[6:] == ["run_3.csv", "run_7.csv"]
    (tmp_path / "cal" / "bank.json").write_text("another")
    ddagr_gym.diagnose_drives(drives, tmp_path / "cal", cache=tmp_path / "kept")
    assert len(asked) == 8 + 7
    ddagr_gym.diagnose_drives(drives, tmp_path / "cal", "field", cache=tmp_path / "kept")
    assert len(asked) == 15 + 7


def test_a_damaged_answer_is_asked_again_and_said(drives, asked, tmp_path):
    said: list[str] = []
    ddagr_gym.diagnose_drives(drives, tmp_path / "cal", cache=tmp_path / "kept")
    damaged = sorted((tmp_path / "kept").glob("*/answer.json"))[2]
    damaged.write_text(damaged.read_text()[:99])
    again = ddagr_gym.diagnose_drives(drives, tmp_path / "cal", cache=tmp_path / "kept", progress=said.append)
    assert len(asked) == 7
    assert said[0].startswith(f"{damaged}, a finished step, is damaged (")
    assert said[1] == "5 of 6 drives have an answer already"
    assert [row.refused for row in again.drives] == [False] * 6


def test_a_drive_that_is_there_twice_counts_once(drives, asked, tmp_path):
    (drives / "run_9.csv").write_text((drives / "run_1.csv").read_text())
    result = ddagr_gym.diagnose_drives(drives, tmp_path / "cal")
    assert result.refused[0].sentence == "run_9.csv has the content of run_1.csv: it counts once."
    assert len(asked) == 6


def test_drives_of_one_name_are_told_apart(drives, tmp_path):
    other = tmp_path / "other"
    other.mkdir()
    (other / "run_1.csv").write_text("else")
    names = [task.name for task in tasks_of([drives, other])]
    assert {"drives/run_1.csv", "other/run_1.csv", "run_2.csv"} <= set(names)
    with pytest.raises(InputError, match="holds no recording"):
        tasks_of(tmp_path / "cal")


def test_drives_of_one_name_and_folder_name_get_their_own_answers(drives, asked, tmp_path):
    for place, content in (("a", "0 1"), ("b", "14 2")):
        (tmp_path / place / "day1").mkdir(parents=True)
        (tmp_path / place / "day1" / "drive.csv").write_text(content)
    given = [tmp_path / place / "day1" / "drive.csv" for place in "ab"]
    for _ in range(2):
        result = ddagr_gym.diagnose_drives(given, tmp_path / "cal", cache=tmp_path / "kept")
        assert [(row.drive, row.verdict) for row in result.drives] == [
            ("a/day1/drive.csv", ("none",)),
            ("b/day1/drive.csv", ("gyro_bias",)),
        ]
    assert len(asked) == 2


def test_a_file_that_is_given_twice_counts_once(drives, asked, tmp_path):
    run = drives / "run_1.csv"
    result = ddagr_gym.diagnose_drives([drives, run, str(run)], tmp_path / "cal", cache=tmp_path / "kept")
    assert [row.sentence for row in result.refused] == [
        f"run_1.csv ({number}) has the content of run_1.csv: it counts once." for number in (2, 3)
    ]
    assert len(asked) == len(set(result.kept)) == len(result.kept) == 6


def test_names_are_told_apart_whatever_they_are():
    given = ["a/x.csv", "b/a/x.csv", "a/x.csv", "c/a/x.csv", "y.csv", "c/y.csv"]
    here = Path.cwd().name
    assert [task.name for task in tasks_of(given)] == [
        f"{here}/a/x.csv", "b/a/x.csv", f"{here}/a/x.csv (2)", "c/a/x.csv", f"{here}/y.csv", "c/y.csv",
    ]  # fmt: skip


def test_a_calibration_and_drives_in_the_home_folder_are_found(drives, asked, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    for _ in range(2):
        assert len(ddagr_gym.diagnose_drives("~/drives", "~/cal", cache="~/kept").drives) == 6
    assert len(asked) == len(list((tmp_path / "kept").iterdir())) == 6


def test_an_unknown_ground_is_refused_before_any_work(drives, asked, tmp_path):
    with pytest.raises(InputError, match="unknown ground 'mud'"):
        ddagr_gym.diagnose_drives(drives, tmp_path / "cal", "mud")
    assert not asked


def test_a_fault_of_the_program_costs_one_drive(drives, tmp_path, monkeypatch):
    def faulty(*arguments):
        raise ZeroDivisionError("by nothing")

    monkeypatch.setattr(drive_tasks, "recordings_from", faulty)
    result = ddagr_gym.diagnose_drives(drives, tmp_path / "cal")
    assert all(row.refused for row in result.drives)
    assert result.drives[0].sentence.startswith(f"{FAULT} (ZeroDivisionError in test_drive_series.py, line ")


def test_drives_side_by_side_are_each_a_row(drives, tmp_path):
    result = ddagr_gym.diagnose_drives(drives, tmp_path / "cal", processes=2)
    assert len(result.refused) == 6
    assert {row.drive for row in result.drives} == {path.name for path in drives.iterdir()}
    assert all(row.drive in row.sentence for row in result.drives)


def test_recordings_are_taken_as_they_are():
    made = [ddagr_gym.simulate("arcs", rate=20.0, seed=seed) for seed in (1, 2, 1)]
    first, second, again = tasks_of(made)
    assert first.sha256 == again.sha256 != second.sha256
    assert len({task.name for task in (first, second, again)}) == 3


def words(drives: Path, *more: str) -> list[str]:
    folder = drives.parent
    return ["diagnose", str(drives), "--calibration", str(folder / "cal"), "--output", str(folder / "over"), *more]


def test_the_command_goes_on_after_a_stop_and_after_an_output(drives, asked, tmp_path, capsys):
    pytest.importorskip("matplotlib", reason="needs the extra report")
    pytest.importorskip("jinja2", reason="needs the extra report")
    (drives / "run_5.csv").write_text("stop")
    assert main(words(drives)) == 130
    assert "interrupted; the same command goes on from" in capsys.readouterr().err
    assert not (tmp_path / "over").exists()
    (drives / "run_5.csv").write_text("14 5")
    assert main(words(drives)) == 0
    assert sorted(asked) == [f"run_{number}.csv" for number in range(1, 7)]
    assert not (tmp_path / "over.part").exists()
    assert "From drive 4 of 6 (run_4.csv) on something changed" in capsys.readouterr().out
    (drives / "run_8.csv").write_text("bad 8")
    assert main(words(drives)) == 2
    assert "add --overwrite" in capsys.readouterr().err
    assert main([*words(drives), "--overwrite"]) == 1
    assert asked[6:] == ["run_8.csv"]
    series = load(tmp_path / "over" / "drives.json")
    assert [row.drive for row in series.rows][-1] == "run_8.csv"
    assert (tmp_path / "over" / "drive_4" / "diagnosis.json").is_file()
    assert (tmp_path / "over" / "index.html").is_file()
    assert (tmp_path / "over" / "drives.csv").read_text().count("\n") == 1 + 7


def test_the_command_says_when_no_drive_has_an_answer(drives, asked):
    for path in drives.iterdir():
        path.write_text(f"bad {path.name}")
    assert main(words(drives)) == 2


def test_options_that_a_calibration_has_are_refused(drives, asked, capsys):
    assert main([*words(drives), "--window", "3"]) == 2
    assert "--window is given with a folder of drives and a calibration: leave it out" in capsys.readouterr().err
    assert not asked


def test_processes_are_for_folders_of_drives(drives, asked, tmp_path, capsys):
    line = ["diagnose", str(drives / "run_1.csv"), "--output", str(tmp_path / "one"), "--processes", "2"]
    for more in ([], ["--calibration", str(tmp_path / "cal")]):
        assert main([*line, *more]) == 2
        assert "--processes is for a folder of drives with --calibration: leave it out" in capsys.readouterr().err


def test_a_cluster_is_for_folders_of_drives_and_needs_its_extra(drives, asked, tmp_path, monkeypatch, capsys):
    assert main(["diagnose", str(drives / "run_1.csv"), "--output", str(tmp_path / "one"), "--cluster", "local"]) == 2
    assert "--cluster is for a folder of drives with --calibration: leave it out" in capsys.readouterr().err
    monkeypatch.setattr("ddagr_gym.extras.find_spec", lambda name: None if name == "ray" else True)
    assert main([*words(drives), "--cluster", "local"]) == 2
    assert ".[cluster]" in capsys.readouterr().err
    assert not asked
    assert not (tmp_path / "over").exists()
