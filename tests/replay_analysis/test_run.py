"""The whole replay of a simulated drive, whose soil and motors are known."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.config import config_from
from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Imu, PoseReceiver, Sensors
from ddagr_gym.replay_analysis.drive_mode import STEPS, ReplaySettings
from ddagr_gym.replay_analysis.horizons import METRICS
from ddagr_gym.replay_analysis.report import (
    EFFECTIVE_TRACK,
    NO_SLIP,
    NOMINAL,
    REFITTED,
    SCHEMA_VERSION,
    ReplayReport,
    lead_errors,
    save_report,
    to_json,
)
from ddagr_gym.replay_analysis.run import make_report, replay_run, steps

STRENGTH, MOTOR_RATE = 0.8, 0.85


@pytest.fixture(scope="module")
def told():
    return []


@pytest.fixture(scope="module")
def result(drive, robot, soil, told):
    return replay_run([drive], robot, soil, ReplaySettings(refit=True), told.append)


@pytest.fixture(scope="module")
def report(result):
    return make_report([result], "ddagr", "sandy_loam_lll_15", ReplaySettings(refit=True))


def mode_of(result, drive):
    return next(mode for mode in result.drive_modes if mode.report.drive == drive)


def test_both_arms_are_there_and_all_progress_is_told(result, told):
    assert [mode.report.drive for mode in result.drive_modes] == ["commands", "encoders"]
    assert sum(told) == steps(1) == 2 * STEPS


def test_the_refit_finds_the_soil_and_the_motors(result):
    found = {p.name: p for p in mode_of(result, "commands").report.refit.parameters}
    assert found["motor_rate"].value == pytest.approx(np.log(MOTOR_RATE), abs=0.02)
    strength = found["soil_strength"]
    assert strength.value == pytest.approx(np.log(STRENGTH), abs=max(3.0 * strength.window_deviation, 0.05))
    assert not strength.at_bound
    assert strength.pull == pytest.approx(strength.value / strength.prior)


@pytest.mark.parametrize("drive_by", ["commands", "encoders"])
def test_on_unseen_drives_the_refitted_simulator_beats_the_others(result, drive_by):
    errors = {model: e.error.rms for model, e in lead_errors(mode_of(result, drive_by).report).items()}
    assert errors[REFITTED] < 0.5 * errors[NOMINAL]
    assert errors[REFITTED] < 0.5 * errors[EFFECTIVE_TRACK]
    assert errors[REFITTED] < 0.1 * errors[NO_SLIP]


def test_the_refitted_residuals_are_the_sensors_noise(result):
    mode = mode_of(result, "commands").report
    table = {t.model: {c.channel: c for c in t.channels} for t in mode.residuals}
    assert table[REFITTED]["yaw_rate"].rms == pytest.approx(0.002, rel=0.2)
    assert table[REFITTED]["yaw_rate"].relative < 0.7 * table[NOMINAL]["yaw_rate"].relative
    assert table[REFITTED]["specific_force_x"].rms == pytest.approx(0.05, rel=0.15)
    assert abs(table[REFITTED]["yaw_rate"].correlation) < 0.3 < table[NOMINAL]["yaw_rate"].correlation


def test_wheel_speeds_that_drive_are_not_judged(result):
    mode = mode_of(result, "encoders").report
    assert not any(c.channel.startswith("encoder") for t in mode.residuals for c in t.channels)
    assert not any(e.metric == "wheel_speed" for e in mode.horizons)
    assert all(rollout.errors["wheel_speed"] is None for rollout in mode.rollouts)


def test_residuals_are_drawn_against_everything_asked_for(result):
    bins = mode_of(result, "commands").report.residuals[0].regimes
    assert {r.against for r in bins if r.channel == "yaw_rate"} == {"slip", "yaw_rate", "speed", "heading", "time"}


def test_long_roll_outs_go_over_the_whole_drive(result, drive):
    rollouts = {r.model: r for r in mode_of(result, "commands").report.rollouts}
    assert rollouts[REFITTED].seconds == pytest.approx(drive.t[-1] - drive.t[0], abs=0.05)
    assert rollouts[REFITTED].errors["position"] < 0.3 * rollouts[NO_SLIP].errors["position"]


def test_the_simulator_is_a_hundred_times_faster_than_the_robot(result):
    for mode in result.drive_modes:
        assert mode.report.speed.times_real_time == pytest.approx(
            mode.report.speed.simulated_seconds / mode.report.speed.cpu_seconds
        )
        assert mode.report.speed.times_real_time >= 100.0


def test_what_could_not_be_judged_is_said(result):
    # blocks of 13 s hold no unseen stretch of 30 s
    assert any("lasts 30 s" in note for note in mode_of(result, "commands").report.notes)


def test_windows_are_judged_that_no_fit_has_seen(result):
    mode = mode_of(result, "commands")
    assert 0 < mode.in_training.sum() < mode.windows.count
    assert mode.report.training_windows == mode.in_training.sum()


def test_the_file_holds_the_report_in_its_types(report, tmp_path):
    path = tmp_path / "replay.json"
    save_report(report, path)
    content = json.loads(path.read_text())
    assert to_json(config_from(content, ReplayReport)) == to_json(report)
    assert content["schema"] == "ddagr-gym/replay"
    assert content["schema_version"] == SCHEMA_VERSION
    assert {e["metric"] for e in content["runs"][0]["arms"][0]["horizons"]} <= set(METRICS)


def test_numbers_that_are_not_finite_are_not_written(report, tmp_path):
    broken = replace(report, window=float("nan"))
    with pytest.raises(ValueError, match="JSON"):
        save_report(broken, tmp_path / "replay.json")


@pytest.fixture(scope="module")
def short(make_drive):
    """16 s on the spot, to be replayed without a refit."""
    return make_drive(("spin",), Sensors(imu=Imu(sample_rate=50.0), pose=PoseReceiver(5.0)))


def test_the_same_seed_gives_the_same_report(short, robot, soil):
    first, second = (replay_run([short], robot, soil) for _ in range(2))
    for one, other in zip(first.report.arms, second.report.arms, strict=True):
        assert one.horizons == other.horizons
        assert one.residuals == other.residuals


def test_swapped_parts_judge_each_others_windows(short, robot, soil):
    plain, swapped = (replay_run([short], robot, soil, ReplaySettings(swapped=s)) for s in (False, True))
    assert not (plain.drive_modes[0].in_training & swapped.drive_modes[0].in_training).any()
    assert plain.drive_modes[0].report.training_windows == swapped.drive_modes[0].report.evaluation_windows
    assert plain.drive_modes[0].report.evaluation_windows == swapped.drive_modes[0].report.training_windows
    assert plain.report.split != swapped.report.split


def test_without_encoders_the_commands_arm_is_left(short, robot, soil):
    channels = {k: v for k, v in short.channels.items() if not k.startswith("encoder")}
    result = replay_run([replace(short, channels=channels)], robot, soil)
    assert [mode.report.drive for mode in result.drive_modes] == ["commands"]
    assert any("known encoders" in note for note in result.report.notes)


def test_a_gyro_against_the_wheels_leaves_no_effective_track(short, robot, soil):
    channels = {**short.channels, "yaw_rate": -short["yaw_rate"]}
    result = replay_run([replace(short, channels=channels)], robot, soil)
    mode = mode_of(result, "encoders").report
    assert mode.baselines.track_ratio is None
    assert any(note.startswith("no effective track could be fitted") for note in mode.notes)
    assert {e.model for e in mode.horizons} == {NOMINAL, NO_SLIP}


def test_added_effects_are_in_the_prediction(short, robot, soil):
    from ddagr_gym.physics.effects import load_effects

    biased = ReplaySettings(effects=tuple(load_effects("gyro_bias=0.05")))
    runs = [replay_run([short], robot, soil, settings) for settings in (ReplaySettings(), biased)]
    errors = [lead_errors(mode_of(run, "commands").report, 1.0)[NOMINAL].error.bias for run in runs]
    assert errors[1] - errors[0] == pytest.approx(0.05 * 1.0)
    assert make_report(runs[1:], "ddagr", "x", biased).effects[0]["name"] == "gyro_bias"


@pytest.mark.parametrize("window", [0.1, 100.0, float("nan")])
def test_a_senseless_window_is_refused(short, robot, soil, window):
    with pytest.raises(InputError, match=r"the window is .* s: give 0.2 to 60 s"):
        replay_run([short], robot, soil, ReplaySettings(window=window))


def test_a_recording_shorter_than_the_window_is_refused(short, robot, soil):
    with pytest.raises(InputError, match="no window of 50 s has valid commands or wheel speeds"):
        replay_run([short], robot, soil, ReplaySettings(window=50.0))
