"""Held readings are found in the values, and only there."""

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.preprocessing.repeated_readings import (
    RepeatedReadings,
    channel_groups,
    find_repeated_readings,
    hold_effect,
    readings_left_out,
    without_repeats,
)
from ddagr_gym.recordings.schema import Recording

PERIOD, COUNT = 0.02, 2000


def drive(held: dict[str, int]) -> Recording:
    rng = np.random.default_rng(1)
    t = PERIOD * np.arange(COUNT)
    quantum = 0.0157
    columns = {"t": t, "command_right": np.sin(t), "command_left": np.cos(t)}
    for k, name in enumerate(("encoder_right", "encoder_left")):
        angle = np.cumsum(0.6 + 0.5 * np.sin((5.0 + 0.5 * k) * t)) / quantum
        columns[name] = np.diff(np.floor(angle), prepend=0.0) * quantum
    for name in ("specific_force_x", "specific_force_y", "yaw_rate"):
        columns[name] = 0.1 * np.sin(t) + 0.03 * rng.standard_normal(COUNT)
    for name, samples in held.items():
        columns[name] = columns[name][np.arange(COUNT) // samples * samples]
    return Recording.from_columns(columns)


def test_nothing_is_held_in_a_sound_drive() -> None:
    assert find_repeated_readings([drive({})]) == ()


@pytest.mark.parametrize(
    ("channels", "sensor"),
    [(("specific_force_x", "specific_force_y"), "accelerometer"), (("yaw_rate",), "gyro"),
     (("encoder_right", "encoder_left"), "encoders")],
)  # fmt: skip
def test_a_held_sensor_is_named_with_its_duration(channels: tuple[str, ...], sensor: str) -> None:
    found = find_repeated_readings([drive(dict.fromkeys(channels, 5))])
    assert [item.sensor for item in found] == [sensor]
    assert found[0].duration == pytest.approx(4 * PERIOD, rel=0.15)
    effect = hold_effect(found)
    assert getattr(effect, sensor) == 1.0
    assert sum(getattr(effect, flag) for flag in ("accelerometer", "gyro", "encoders", "pose")) == 1.0


def test_repeats_become_missing_samples() -> None:
    recording = drive({"yaw_rate": 4})
    cleaned = without_repeats(recording, find_repeated_readings([recording]))
    assert np.isfinite(cleaned["yaw_rate"]).mean() == pytest.approx(0.25, abs=0.01)
    assert np.isfinite(cleaned["encoder_right"]).all()


def test_wheels_that_are_read_in_turn_keep_one_new_reading_of_each_hold() -> None:
    recording = drive({"encoder_right": 6, "encoder_left": 6})
    late = recording["encoder_left"].copy()
    late[3:] = late[:-3]
    late[:3] = 0.3
    recording = Recording.from_columns({"t": recording.t, **recording.channels, "encoder_left": late})
    assert channel_groups(recording, "encoders") == (("encoder_right",), ("encoder_left",))
    found = find_repeated_readings([recording])
    assert [item.sensor for item in found] == ["encoders"]
    assert found[0].duration == pytest.approx(5 * PERIOD, rel=0.15)
    cleaned = without_repeats(recording, found)
    for name, first in (("encoder_right", 0), ("encoder_left", 3)):
        rows = np.flatnonzero(np.isfinite(cleaned[name]))
        assert ((rows[2:] - first) % 6 == 0).all()
        assert len(rows) == pytest.approx(COUNT / 6, rel=0.05)


@pytest.mark.parametrize("samples", [2, 14, 24, 50])
def test_long_holds_have_their_duration(samples: int) -> None:
    """Beyond the reach of the samples that tell whether readings are held."""
    found = find_repeated_readings([drive({"yaw_rate": samples})])
    assert [item.sensor for item in found] == ["gyro"]
    assert found[0].duration == pytest.approx((samples - 1) * PERIOD, rel=0.02)


@pytest.mark.parametrize("steady", ["standing", "cruising"])
def test_a_steady_reading_between_changes_is_no_hold(steady: str) -> None:
    """Held encoders of a robot that stops for 2 s in every 4 s, or whose counts are the same for as long."""
    recording = drive({"encoder_right": 5, "encoder_left": 5})
    rows = np.arange(COUNT)
    cruising = np.round(1.5 * np.tanh(4.0 * np.sin(PERIOD * (rows // 5 * 5))) / 0.0157) * 0.0157
    channels = {**recording.channels}
    for name in ("encoder_right", "encoder_left"):
        channels[name] = np.where(rows // 100 % 2, 0.0, channels[name]) if steady == "standing" else cruising
    found = find_repeated_readings([replace(recording, channels=channels)])
    assert [item.sensor for item in found] == ["encoders"]
    assert found[0].duration == pytest.approx(4 * PERIOD, rel=0.15)


def test_a_hold_longer_than_the_effect_knows_is_its_longest() -> None:
    assert hold_effect([RepeatedReadings("gyro", 0.9, 75.0, 100)]).duration == 60.0


@pytest.mark.parametrize("rate", [5, 10])
def test_zeros_of_a_robot_that_often_stops_are_no_repeats(rate: int) -> None:
    """Encoders read seldom and rounded, in a drive of short moves."""
    t = np.arange(60 * rate) / rate
    speed = np.where(t % 3.0 < 1.4, 0.8, 0.0) * (1.0 + 0.2 * np.sin(1.7 * t))
    turned = np.round(speed / 0.02) * 0.02
    columns = {"t": t, "command_right": speed, "command_left": speed, "encoder_right": turned, "encoder_left": turned}
    assert find_repeated_readings([Recording.from_columns(columns)]) == ()


def test_readings_that_the_map_left_out_count_as_held() -> None:
    held = drive({"encoder_right": 5, "encoder_left": 5})
    clean = without_repeats(held, find_repeated_readings([held]))
    by_map = clean.with_meta(held={"encoder_right": 0.0, "encoder_left": 0.0})
    assert find_repeated_readings([by_map]) == ()
    assert readings_left_out([clean]) == ()
    (found,) = readings_left_out([by_map])
    assert found.sensor == "encoders"
    assert found.share == pytest.approx(0.8, abs=0.02)
    assert found.duration == pytest.approx(4 * PERIOD, rel=0.01)


@pytest.mark.parametrize(("stated", "named"), [(0.1, False), (0.08, False), (0.05, True)])
def test_a_sensor_that_keeps_the_period_of_its_map_is_known_to_be_slow(stated: float, named: bool) -> None:
    held = drive({"encoder_right": 5, "encoder_left": 5})
    clean = without_repeats(held, find_repeated_readings([held]))
    by_map = clean.with_meta(held={"encoder_right": stated, "encoder_left": stated})
    assert bool(readings_left_out([by_map])) is named


def test_spans_with_a_single_reading_each_have_no_rate() -> None:
    whole = drive({})
    rows = np.arange(COUNT)
    pose = np.where((rows == 50) | (rows == COUNT - 50), 1.0, np.nan)
    halves = ((0, COUNT // 2), (COUNT // 2, COUNT))
    seldom = Recording.from_columns(
        {"t": whole.t, **whole.channels, **dict.fromkeys(("pose_x", "pose_y", "pose_yaw"), pose)}, spans=halves
    ).with_meta(held=dict.fromkeys(("pose_x", "pose_y", "pose_yaw"), 0.0))
    assert readings_left_out([seldom]) == ()


def test_a_map_that_leaves_out_hardly_anything_holds_nothing() -> None:
    assert readings_left_out([drive({}).with_meta(held={"encoder_right": 0.0, "encoder_left": 0.0})]) == ()
