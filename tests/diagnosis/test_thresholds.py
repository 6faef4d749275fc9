"""Thresholds let the stated share of null runs pass, over the whole library."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ddagr_gym.diagnosis.misfit import LOCAL
from ddagr_gym.diagnosis.thresholds import (
    MARGIN,
    MISFIT_MARGIN,
    NOISE_GAIN,
    NullRun,
    default_thresholds,
    load_thresholds,
    save_thresholds,
    thresholds_from,
)
from ddagr_gym.errors import InputError
from ddagr_gym.physics.effects.registry import effect_kinds

NAMES = ("slope", "payload", "motor_lag", "gyro_bias")


def null_runs(count: int, seed: int) -> list[NullRun]:
    rng = np.random.default_rng(seed)
    runs = []
    for _ in range(count):
        gains = dict(zip(NAMES, rng.chisquare(2, len(NAMES)) * np.array([4.0, 12.0, 4.0, 4.0]), strict=True))
        same = dict.fromkeys(NAMES, 10.0)
        runs.append(NullRun("plain", gains, same, same, {"yaw_rate": float(rng.uniform(0.8, 1.2))}))
    return runs


def test_false_alarms_over_the_library_are_at_the_level() -> None:
    thresholds = thresholds_from(null_runs(2000, 1), "x", level=0.05)
    fresh = null_runs(2000, 2)
    alarms = np.mean([any(run.gains[n] * MARGIN > thresholds.of(n).gain for n in NAMES) for run in fresh])
    assert alarms == pytest.approx(0.05, abs=0.02)
    assert thresholds.of("slope").gain >= MARGIN * NOISE_GAIN
    assert thresholds.of("payload").gain > 1.5 * thresholds.of("slope").gain
    assert 1.15 < thresholds.misfit["yaw_rate"] / MISFIT_MARGIN < 1.25


def test_p_value_counts_null_runs_that_stand_as_high() -> None:
    thresholds = thresholds_from(null_runs(99, 1), "x")
    assert thresholds.p_value("slope", 1e9) == pytest.approx(0.01)
    assert thresholds.p_value("slope", 0.0) == pytest.approx(1.0)
    middle = thresholds.p_value("slope", float(np.median(thresholds.maxima)) * thresholds.of("slope").gain)
    assert middle == pytest.approx(0.5, abs=0.03)


def test_gates_grow_with_longer_recordings_only() -> None:
    runs = [replace(run, windows=30) for run in null_runs(40, 1)]
    thresholds = thresholds_from(runs, "x")
    assert thresholds.for_windows(20) == thresholds
    longer = thresholds.for_windows(90)
    assert longer.of("slope").gain == pytest.approx(3.0 * thresholds.of("slope").gain)
    assert longer.misfit == thresholds.misfit


def test_a_bank_ships_for_the_thesis_robot() -> None:
    thresholds = default_thresholds("ddagr")
    assert thresholds.nulls >= 60
    assert set(effect_kinds()) - {"sensor_hold"} <= set(thresholds.gates)
    assert set(LOCAL) <= set(thresholds.misfit)
    with pytest.raises(InputError, match="null-bank"):
        default_thresholds("nobody")


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
