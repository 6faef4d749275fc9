"""`ddagr null-bank` keeps every null drive, goes on after a stop, and writes thresholds that load."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from ddagr_gym.cli import main
from ddagr_gym.diagnosis import null_bank
from ddagr_gym.diagnosis.thresholds import NullRun, load_thresholds
from ddagr_gym.replay.windows import CHANNELS


@pytest.fixture
def quick_nulls(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Null runs that are drawn instead of simulated; the list grows by the number of each."""
    made: list[int] = []

    def null_run(robot, soil, template, kind, setting, seed, *more, **options):  # type: ignore[no-untyped-def]
        made.append(seed[-1])
        rng = np.random.default_rng(list(seed))
        gains = {"slope": float(rng.exponential(300.0)), "payload": float(rng.exponential(100.0))}
        misfit = {name: float(rng.uniform(0.9, 1.1)) for name in CHANNELS}
        return NullRun(kind, gains, dict.fromkeys(gains, 1.0), dict.fromkeys(gains, 0.5), misfit)

    monkeypatch.setattr(null_bank, "null_run", null_run)
    return made


def words(folder: Path, count: int = 20) -> list[str]:
    return ["null-bank", "--output", str(folder / "thresholds.json"), "--count", str(count), "--processes", "1"]


def test_thresholds_of_a_bank_load(quick_nulls: list[int], tmp_path: Path) -> None:
    assert main(words(tmp_path)) == 0
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
    assert "20" in capsys.readouterr().err
    assert not (tmp_path / "thresholds.json").exists()


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
