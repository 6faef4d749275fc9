"""The comparison of models on left-out real drives: what a model may see, and what the learned one can learn."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.real_drives.__main__ import aims_of
from benchmarks.real_drives.compare import CALIBRATED_BY_SPEEDS, LEARNED, Compared, by_wheel_speeds, errors_of, ratio_of
from benchmarks.real_drives.figure import draw
from benchmarks.real_drives.lateness import lateness_of
from benchmarks.real_drives.learned import examples, learned_forecast, scales_of, training_windows
from ddagr_gym.calibration.forecast_errors import Forecasts
from ddagr_gym.calibration.result import CALIBRATED, DATA_SHEET, KINEMATIC
from ddagr_gym.identification.windows import CHANNELS, STATE, WindowSet, cut_windows
from ddagr_gym.parameters import Drivetrain, Imu, PoseReceiver, Sensors
from ddagr_gym.physics.effects.gyro_scale import GyroScale
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.channels import CHANNELS as SCHEMA
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import simulate

ROBOT = replace(get_robot("ddagr"), drivetrain=Drivetrain(command_delay=0.3, load_compliance=0.01, integral_rate=2.0))


@pytest.fixture(scope="module")
def drives() -> list[Recording]:
    """Two of 160 s with steps of 4 s."""
    sensors = Sensors(Imu(sample_rate=20.0), pose=PoseReceiver(rate=4.0))
    drives = []
    for seed in (1, 2):
        steps = np.random.default_rng(seed).uniform(-1.2, 1.2, (40, 2))
        columns = simulate(ROBOT, get_soil("thesis_a1"), np.repeat(steps, 80, axis=0), sensors=sensors, seed=seed)
        kept = {name: values for name, values in columns.items() if name == "t" or name in SCHEMA}
        drives.append(Recording.from_columns(kept, ROBOT))
    return drives


@pytest.fixture(scope="module")
def windows(drives: list[Recording]) -> WindowSet:
    """Of 4 s, every 2 s."""
    return cut_windows(
        drives, 4.0, wheel_radius=ROBOT.outer_radius, half_track=ROBOT.half_track, history=1.2, stride=2.0
    )


def test_training_leaves_out_the_drive_or_its_second_half(windows: WindowSet):
    assert set(training_windows(windows, 0, first_half=False).recording) == {1}
    half = training_windows(windows, 0, first_half=True)
    own = half.recording == 0
    assert own.any()
    assert half.time[own].max() < windows.time[windows.recording == 0].max() / 2 + 4.0


def test_mirrored_examples_are_those_of_mirrored_windows(windows: WindowSet):
    scales = scales_of(windows, ROBOT.outer_radius)
    order = [CHANNELS.index(name) for name in CHANNELS]
    right, left, yaw = (CHANNELS.index(name) for name in ("encoder_right", "encoder_left", "yaw_rate"))
    order[right], order[left] = left, right
    measured = windows.measured[..., order].copy()
    measured[..., yaw] *= -1.0
    states = windows.initial.copy()
    first, second = STATE.index("omega_right"), STATE.index("omega_left")
    states[:, [first, second]] = states[:, [second, first]]
    states[:, STATE.index("yaw_rate")] *= -1.0
    mirrored = replace(windows, commands=windows.commands[..., ::-1], measured=measured, initial=states)
    expected, found = examples(mirrored, scales), examples(windows, scales).mirrored()
    np.testing.assert_allclose(found.inputs, expected.inputs)
    np.testing.assert_allclose(found.targets, expected.targets)


def test_errors_are_drawn_and_held_against_the_aims(windows: WindowSet, tmp_path: Path):
    """A model that is off by a known share shows in rows, aims and picture."""
    judged = windows.subset(windows.recording == 0)
    rng = np.random.default_rng(0)
    truth = np.nan_to_num(judged.measured)
    size = {DATA_SHEET: 4.0, CALIBRATED: 1.0, KINEMATIC: 2.0, LEARNED: 0.5, CALIBRATED_BY_SPEEDS: 1.0}
    noise = 0.1 * rng.standard_normal((judged.count, 1, truth.shape[2]))
    item = Compared("a.csv", "clay", "other drives", judged, {name: truth + k * noise for name, k in size.items()})
    rows = errors_of(item, 0)
    aims = aims_of(item, 0, horizon=1.0)
    assert aims["calibrated over effective track with delay and lag"]["ratio"] == pytest.approx(0.5)
    assert aims["calibrated over effective track with delay and lag"]["met"]
    share = aims["share of the learned model's gain"]
    # every window's errors are in the same ratios, so that nothing is uncertain
    assert [share[key] for key in ("ratio", "low", "high")] == pytest.approx([0.75 / 0.875] * 3)
    draw(rows, tmp_path / "real_drives.png")
    assert (tmp_path / "real_drives.png").stat().st_size > 10_000


def test_forecasts_by_wheel_speeds_use_the_values_without_the_drive(drives: list[Recording], windows: WindowSet):
    """A simulated drive is forecast by its own robot and soil, and badly by others, whatever fits it best with all."""
    data = SimpleNamespace(prepared=SimpleNamespace(recordings=drives, sigma=np.full(len(CHANNELS), 0.01)), robot=ROBOT)
    judged, training = windows.subset(windows.recording == 0), training_windows(windows, 0, first_half=False)
    gyro = judged.measured[..., CHANNELS.index("yaw_rate")]
    sizes = []
    for soil, sensors in (("thesis_a1", ()), ("firm_ground", ()), ("thesis_a1", (GyroScale(1.2),))):
        item = Forecasts("a.csv", "clay", "other drives", judged, {}, ROBOT, get_soil(soil), sensors)
        found = by_wheel_speeds(data, item, training)[CALIBRATED_BY_SPEEDS]
        assert np.isfinite(found).any()
        sizes.append(float(np.sqrt(np.nanmean((found[..., CHANNELS.index("yaw_rate")] - gyro) ** 2))))
    right, other_soil, other_gyro = sizes
    assert right < 0.7 * min(other_soil, other_gyro)


def test_lateness_of_each_command_is_found_by_a_robot_with_another(windows: WindowSet):
    """Commands that act after 0.3 s are told so by a robot of 0.1 s; where nothing moves, nothing is told."""
    early = replace(ROBOT, drivetrain=replace(ROBOT.drivetrain, command_delay=0.1))
    judged = windows.subset(np.flatnonzero(windows.recording == 0)[:12])
    still = judged.measured.copy()
    still[0, :, :] = still[0, :1, :]
    item = Forecasts(
        "a.csv", "clay", "other drives", replace(judged, measured=still), {}, early, get_soil("thesis_a1"), ()
    )
    found = lateness_of(item, threads=1)
    assert np.isnan(found.dead_times[0])
    known = found.dead_times[np.isfinite(found.dead_times)]
    assert len(known) == found.figures["windows"] > 6
    np.testing.assert_allclose(known, 0.3, atol=0.021)
    assert found.figures["quartiles"][1] == pytest.approx(0.3, abs=0.001)
    assert found.figures["calibrated"] == 0.1
    # from where the banks stand, the commands of a window ask for another difference of them
    assert found.turning.shape == (12,)
    assert found.turning.max() > 0.5


def test_learned_model_predicts_a_drive_that_it_has_not_seen(windows: WindowSet):
    """A few epochs beat the guess that the motion of the start goes on, and the same seed gives the same bits."""
    training, judged = training_windows(windows, 0, first_half=False), windows.subset(windows.recording == 0)
    found = [learned_forecast(training, judged, ROBOT.outer_radius, 0, members=1, epochs=12) for _ in range(2)]
    np.testing.assert_array_equal(*found)
    stays = found[0].copy()
    start = judged.initial[:, None]
    for channel, state in (("encoder_right", "omega_right"), ("encoder_left", "omega_left"), ("yaw_rate", "yaw_rate")):
        stays[..., CHANNELS.index(channel)] = start[..., STATE.index(state)]
    item = Compared("drive", "clay", "other drives", judged, {"learned": found[0], "stays": stays})
    rows = {(row["model"], row["metric"], row["horizon"]): row for row in errors_of(item, 0)}
    assert rows["learned", "encoder", None]["rms"] < 0.6 * rows["stays", "encoder", None]["rms"]
    ratio = ratio_of(item, "learned", "stays", 1.0, 0)
    assert ratio is not None
    assert ratio["low"] < ratio["ratio"] < ratio["high"]
    assert ratio_of(item, "learned", "absent", 1.0, 0) is None
