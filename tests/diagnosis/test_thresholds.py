"""Thresholds let the stated share of null runs pass, over the whole library."""

from pathlib import Path

import numpy as np
import pytest

from ddagr_gym.diagnosis.thresholds import NullRun, load_thresholds, save_thresholds, thresholds_from
from ddagr_gym.errors import InputError

NAMES = ("slope", "payload", "motor_lag", "gyro_bias")


def null_runs(count: int, seed: int) -> list[NullRun]:
    rng = np.random.default_rng(seed)
    runs = []
    for _ in range(count):
        gains = dict(zip(NAMES, rng.chisquare(2, len(NAMES)) * np.array([1.0, 3.0, 1.0, 1.0]), strict=True))
        same = dict.fromkeys(NAMES, 10.0)
        runs.append(NullRun("plain", gains, same, same, {"yaw_rate": float(rng.uniform(0.8, 1.2))}))
    return runs


def test_false_alarms_over_the_library_are_at_the_level() -> None:
    thresholds = thresholds_from(null_runs(2000, 1), "x", level=0.05)
    fresh = null_runs(2000, 2)
    alarms = np.mean([any(run.gains[n] > thresholds.of(n).gain for n in NAMES) for run in fresh])
    assert alarms == pytest.approx(0.05, abs=0.02)
    assert thresholds.of("payload").gain > 2.0 * thresholds.of("slope").gain
    assert 1.15 < thresholds.misfit["yaw_rate"] < 1.25


def test_too_few_runs_are_refused() -> None:
    with pytest.raises(InputError, match="at least 20"):
        thresholds_from(null_runs(19, 1), "x")


def test_file_returns_what_was_saved(tmp_path: Path) -> None:
    thresholds = thresholds_from(null_runs(40, 1), "abc")
    save_thresholds(thresholds, tmp_path / "t.json")
    assert load_thresholds(tmp_path / "t.json") == thresholds
    (tmp_path / "bad.json").write_text("{}")
    with pytest.raises(InputError, match="null-bank"):
        load_thresholds(tmp_path / "bad.json")
