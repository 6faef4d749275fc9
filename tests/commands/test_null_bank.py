"""`ddagr null-bank` keeps every null drive, goes on after a stop, and writes thresholds that load."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ddagr_gym.api.diagnose import _gates
from ddagr_gym.api.nominal import nominal_from
from ddagr_gym.cli import main, warnings_as_lines
from ddagr_gym.diagnosis.gates.threshold_files import load_thresholds
from ddagr_gym.diagnosis.gates.thresholds import NullRun, Origin, Thresholds
from ddagr_gym.diagnosis.null_bank.bank import NullBank
from ddagr_gym.diagnosis.null_bank.fitted_nominal import FittedNominal
from ddagr_gym.diagnosis.null_bank.structural_variants import KINDS
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.recordings.storage import save_parquet


@pytest.fixture
def quick_nulls(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Null runs that are drawn instead of simulated; the list grows by the number of each."""
    made: list[int] = []

    def run(bank: NullBank, number: int) -> NullRun:
        made.append(number)
        return drawn(KINDS[number % len(KINDS)], [bank.seed, number], bank.setting.duration)

    monkeypatch.setattr(NullBank, "run", run)
    return made


def drawn(kind: str, seed: list[int], duration: float = 6.0) -> NullRun:
    rng = np.random.default_rng(seed)
    gains = {"slope": float(rng.exponential(300.0)), "payload": float(rng.exponential(100.0))}
    misfit = {name: float(rng.uniform(0.9, 1.1)) for name in CHANNELS}
    return NullRun(kind, gains, dict.fromkeys(gains, 1.0), dict.fromkeys(gains, 0.5), misfit, 10, (), duration)


def words(folder: Path, count: int = 20) -> list[str]:
    return ["null-bank", "--output", str(folder / "thresholds.json"), "--count", str(count), "--processes", "1"]


def test_thresholds_of_a_bank_load(quick_nulls: list[int], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words(tmp_path)) == 0
    said = capsys.readouterr().out
    assert "passes these thresholds in 0 of 20 null drives, those shipped for the ddagr in " in said
    assert quick_nulls == list(range(20))
    found = load_thresholds(tmp_path / "thresholds.json")
    assert found.nulls == 20
    assert found.of("slope").gain > found.of("payload").gain


def test_a_stopped_bank_goes_on(quick_nulls: list[int], tmp_path: Path) -> None:
    assert main(words(tmp_path)) == 0
    before = json.loads((tmp_path / "thresholds.json").read_text())
    parts = sorted((tmp_path / "thresholds.bank").iterdir())
    for part in parts[5:8]:
        part.unlink()
    quick_nulls.clear()
    assert main(words(tmp_path)) == 0
    assert quick_nulls == [5, 6, 7]
    assert json.loads((tmp_path / "thresholds.json").read_text()) == before


def test_too_few_drives_for_the_level(
    quick_nulls: list[int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words(tmp_path, count=5)) == 2
    assert "--count is 5: give at least 20" in capsys.readouterr().err
    assert quick_nulls == []
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("option", ["--window", "--stride"])
def test_windows_and_strides_that_are_too_short_are_refused(
    option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*words(tmp_path), option, "0.05"]) == 2
    assert f"{option} is 0.05" in capsys.readouterr().err
    assert not (tmp_path / "thresholds.bank").exists()


def test_thresholds_know_their_windows(quick_nulls: list[int], tmp_path: Path) -> None:
    assert main([*words(tmp_path), "--window", "4"]) == 0
    assert load_thresholds(tmp_path / "thresholds.json").duration == 4.0


def test_three_pieces_must_hold_the_windows_of_a_run(
    quick_nulls: list[int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = save_drive(tmp_path / "run.parquet", 400.0)
    assert main([*words(tmp_path), run, "--piece", "20", "--window", "9"]) == 2
    assert "--piece is 20: give a finite time of at least 24 s" in capsys.readouterr().err
    assert main([*words(tmp_path), "--piece", "20", "--window", "9"]) == 0


def test_windows_that_were_cut_shorter_are_those_that_are_kept(
    quick_nulls: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(NullBank, "run", lambda bank, number: drawn("plain", [number], 5.0))
    assert main([*words(tmp_path), "--window", "6"]) == 0
    found = load_thresholds(tmp_path / "thresholds.json")
    assert (found.duration, found.windows) == (5.0, 10.0)


@pytest.mark.parametrize(
    ("option", "value", "remedy"),
    [
        ("--piece", "0", "at least 16 s"),
        ("--piece", "inf", "a finite time"),
        ("--seed", "-1", "at least 0"),
        ("--processes", "0", "at least 1"),
    ],
)
def test_options_without_a_meaning_are_refused(
    option: str, value: str, remedy: str, quick_nulls: list[int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*words(tmp_path), option, value]) == 2
    error = capsys.readouterr().err
    assert f"{option} is {value}: give " in error
    assert remedy in error
    assert not any(tmp_path.iterdir())


def test_help_says_how_many_pieces_ordinary_drives_must_give(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["null-bank", "--help"]) == 0
    assert "at least 20 are needed" in " ".join(capsys.readouterr().out.replace("│", " ").split())


def save_drive(path: Path, seconds: float, period: float = 0.05, yaw_rate: float = 1.0) -> str:
    """A drive with commands and a gyro; its path."""
    count = int(seconds / period)
    columns = {name: np.linspace(0.0, 1.0, count) for name in ("command_right", "command_left")}
    columns |= {"yaw_rate": np.full(count, yaw_rate), "t": period * np.arange(1, count + 1)}
    save_parquet(Recording.from_columns(columns, get_robot("ddagr"), source=path.name), path)
    return str(path)


@pytest.mark.parametrize(
    ("seconds", "ordinary", "said"),
    [
        (0.05, True, "1 rows"),
        (0.05, False, "1 rows"),
        (10.0, True, "too few"),
        (20.0, True, "0 pieces with commands of 60 s and the level of 0.05 takes at least 20"),
        (120.0, True, "2 pieces with commands"),
    ],
)
def test_recordings_that_are_too_short_are_refused_before_any_work(
    seconds: float, ordinary: bool, said: str, quick_nulls: list[int], tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    run = save_drive(tmp_path / "run.parquet", seconds)
    assert main([*words(tmp_path), run, *(["--ordinary"] if ordinary else [])]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert quick_nulls == []
    assert not (tmp_path / "thresholds.bank").exists()


def test_other_readings_make_another_bank(quick_nulls: list[int], tmp_path: Path) -> None:
    """A corrected map changes what was read, not what was commanded."""
    for yaw_rate in (1.0, 1.0, -1.0):
        ordinary = [save_drive(tmp_path / "run.parquet", 400.0, yaw_rate=yaw_rate), "--ordinary", "--piece", "20"]
        assert main([*words(tmp_path), *ordinary]) == 0
    assert len(quick_nulls) == 62
    assert len(list((tmp_path / "thresholds.bank").iterdir())) == 62


def test_thresholds_know_their_origin(quick_nulls: list[int], tmp_path: Path) -> None:
    options = ["--robot", "husky", "--soil", "firm_ground", "--soil-uncertainty", "2.5", "--seed", "7"]
    assert main([*words(tmp_path), *options]) == 0
    origin = load_thresholds(tmp_path / "thresholds.json").origin
    assert origin == Origin("husky", "firm_ground", 2.5, 7, "simulated")


def test_thresholds_of_ordinary_drives_say_so(quick_nulls: list[int], tmp_path: Path) -> None:
    ordinary = [save_drive(tmp_path / "run.parquet", 400.0), "--ordinary", "--piece", "20"]
    assert main([*words(tmp_path), *ordinary]) == 0
    assert len(quick_nulls) == 31
    assert load_thresholds(tmp_path / "thresholds.json").origin == Origin("ddagr", "thesis_a1", 1.0, 0, "ordinary")


@warnings_as_lines()
def gates_of(
    path: Path | None, robot: str = "ddagr", soil: str = "thesis_a1", soil_uncertainty: float = 1.0
) -> Thresholds:
    """Thresholds that a diagnosis takes, its warnings printed as the command prints them."""
    return _gates(path, nominal_from(robot, soil), soil_uncertainty)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, ""),
        ({"robot": "husky"}, "robot ddagr instead of husky"),
        ({"soil": "firm_ground"}, "soil thesis_a1 instead of firm_ground"),
        ({"soil_uncertainty": 4.0}, "soil uncertainty 1 instead of 4"),
    ],
)
def test_a_diagnosis_of_something_else_is_warned(
    changes: dict[str, Any], said: str, quick_nulls: list[int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words(tmp_path)) == 0
    path = tmp_path / "thresholds.json"
    capsys.readouterr()
    given = gates_of(path, **changes)
    assert given == load_thresholds(path)
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == bool(said)
    assert error.startswith("ddagr: warning: " if said else "")


def test_a_diagnosis_with_the_shipped_thresholds_is_warned_too(capsys: pytest.CaptureFixture[str]) -> None:
    gates_of(None, robot="husky", soil="firm_ground", soil_uncertainty=4.0)
    said = capsys.readouterr().err
    assert "robot ddagr instead of husky" in said
    assert "soil uncertainty 1 instead of 4" in said
    gates_of(None)
    assert gates_of(None, robot="warthog", soil="firm_ground", soil_uncertainty=4.0).origin.robot == "warthog"
    assert capsys.readouterr().err == ""


def test_ordinary_drives_are_asked_for(tmp_path, capsys):
    assert main(["null-bank", "--ordinary", "--output", str(tmp_path / "thresholds.json")]) == 2
    assert "--ordinary takes recordings" in capsys.readouterr().err
    assert not any(tmp_path.iterdir())


def test_banks_of_given_drives_are_drawn_about_the_nominal_model_that_fits_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    about: list[Any] = []
    centre = (get_robot("ddagr"), get_soil("firm_ground"))
    fits = [FittedNominal(*centre, "mass", 1.0), FittedNominal(*centre, "mass", 9.0)]

    def run(bank: NullBank, number: int) -> NullRun:
        about.append(bank.centre)
        return drawn("plain", [number])

    monkeypatch.setattr(NullBank, "run", run)
    monkeypatch.setattr("ddagr_gym.diagnosis.null_bank.fitted_nominal.fitted_nominal", lambda *given: fits.pop(0))
    columns = {name: np.linspace(0.0, 1.0, 3000) for name in ("command_right", "command_left", "yaw_rate")}
    columns["t"] = 0.01 * np.arange(1, 3001)
    save_parquet(Recording.from_columns(columns, get_robot("ddagr")), tmp_path / "run.parquet")
    given = [*words(tmp_path), str(tmp_path / "run.parquet")]
    assert main(given) == 0
    assert about == [centre] * 20
    about.clear()
    assert main(given) == 0
    assert about == [None] * 20
    assert "only with mass 9 standard deviations off" in capsys.readouterr().err
    about.clear()
    assert main(words(tmp_path)) == 0
    assert about == [None] * 20


def test_a_folder_of_drives_is_taken(quick_nulls: list[int], tmp_path: Path) -> None:
    (tmp_path / "drives").mkdir()
    for name, turn in (("a", 1.0), ("b", 0.5)):
        save_drive(tmp_path / "drives" / f"{name}.parquet", 200.0, yaw_rate=turn)
    assert main([*words(tmp_path), str(tmp_path / "drives"), "--ordinary", "--piece", "20"]) == 0
    assert load_thresholds(tmp_path / "thresholds.json").nulls == 20
