"""Sensors: each effect against the same error written into the sensor's own parameters, or a closed form."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.parameters import STANDARD_GRAVITY, Imu, PoseReceiver, Sensors
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects import parse_effect

PERIOD = 0.008
IMU_CHANNELS = ("specific_force_x", "specific_force_y", "yaw_rate")


@pytest.fixture(scope="module")
def turns():
    """Commands (250, 2): a start, a left turn and a right one."""
    return np.concatenate([np.tile((0.7, 0.3), (120, 1)), np.tile((0.2, 0.8), (130, 1))])


@pytest.mark.parametrize(
    ("effect", "imu", "encoder"),
    [
        ("gyro_bias=0.03", {"gyro_bias": 0.03}, {}),
        ("gyro_scale=0.9", {"gyro_scale": 0.9}, {}),
        ("gyro_sign", {"gyro_scale": -1.0}, {}),
        ("accelerometer_bias=0.2,y=-0.3", {"accelerometer_bias": (0.2, -0.3)}, {}),
        ("accelerometer_sign", {"accelerometer_scale": (-1.0, 1.0)}, {}),
        ("accelerometer_sign=1,flip_y=1", {"mounting_yaw": math.pi}, {}),
        ("accelerometer_sign=0,flip_y=1", {"accelerometer_scale": (1.0, -1.0)}, {}),
        ("imu_misalignment=0.3", {"mounting_yaw": 0.3}, {}),
        ("imu_lever_arm=0.4,y=-0.2", {"position": (0.4, -0.2)}, {}),
        ("encoder_scale=1.05,left=0.9", {}, {"scale": (1.05, 0.9)}),
    ],
)
def test_effect_equals_the_sensors_own_parameter(drive, ideal_sensors, turns, effect, imu, encoder):
    wrong = replace(
        ideal_sensors, imu=replace(ideal_sensors.imu, **imu), encoder=replace(ideal_sensors.encoder, **encoder)
    )
    expected, columns = drive((), turns, sensors=wrong), drive([effect], turns)
    for channel in (*IMU_CHANNELS, "encoder_right", "encoder_left", "pose_x"):
        np.testing.assert_allclose(columns[channel], expected[channel], atol=1e-12, err_msg=channel)


def test_lever_arm_of_a_mounted_sensor_is_in_body_axes(drive, ideal_sensors, turns):
    turned = replace(ideal_sensors.imu, mounting_yaw=0.7, position=(0.1, 0.3))
    moved = replace(turned, position=(0.35, 0.2))
    columns = drive(["imu_lever_arm=0.25,y=-0.1"], turns, sensors=replace(ideal_sensors, imu=turned))
    expected = drive((), turns, sensors=replace(ideal_sensors, imu=moved))
    for channel in IMU_CHANNELS:
        np.testing.assert_allclose(columns[channel], expected[channel], atol=1e-12)


def test_sensor_effects_do_not_move_the_robot(drive, turns):
    effects = ["gyro_scale=0.5", "imu_tilt=0.2", "encoder_scale=2", "pose_latency=0.3", "sensor_hold=0.2"]
    plain, wrong = drive((), turns), drive(effects, turns)
    for name in plain:
        if name.startswith("true_"):
            np.testing.assert_array_equal(wrong[name], plain[name])


def test_encoders_in_the_speed_loop_agree_with_the_command_and_the_wheels_do_not(drive):
    commands = np.tile((0.7, 0.5), (400, 1))
    plain, looped = drive((), commands), drive(["encoder_scale=1.05,left=0.9,loop=1"], commands)
    for side, scale in (("right", 1.05), ("left", 0.9)):
        np.testing.assert_allclose(looped[f"encoder_{side}"][-50:], plain[f"encoder_{side}"][-50:], atol=1e-6)
        wanted = commands[-50:, ("right", "left").index(side)] / scale
        np.testing.assert_allclose(looped[f"true_omega_{side}"][-50:], wanted, atol=1e-5)


def test_a_loop_with_encoders_of_its_own_moves_as_before(drive, turns):
    separate = parse_effect("encoder_scale=1.05,left=0.9,loop=0")
    assert [point for point, _ in separate.acting] == [layout.POINT_READINGS]
    assert len(parse_effect("encoder_scale=1.05,left=0.9,loop=1").acting) == 2
    plain, wrong = drive((), turns), drive([separate], turns)
    for name in plain:
        if name.startswith("true_"):
            np.testing.assert_array_equal(wrong[name], plain[name])


def test_noise_and_steps_of_the_sensor_stay_as_they_are(drive, turns):
    sensors = Sensors(imu=Imu())
    columns = drive(["accelerometer_bias=0.5"], turns, sensors=sensors, seed=3)
    plain = drive((), turns, sensors=sensors, seed=3)
    np.testing.assert_allclose(columns["specific_force_x"] - plain["specific_force_x"], 0.5, atol=1e-12)


def rotation(roll, pitch):
    """Body axes from sensor axes, R_y(pitch) R_x(roll)."""
    about_y = np.array(
        [[math.cos(pitch), 0, math.sin(pitch)], [0, 1, 0], [-math.sin(pitch), 0, math.cos(pitch)]],
    )
    about_x = np.array([[1, 0, 0], [0, math.cos(roll), -math.sin(roll)], [0, math.sin(roll), math.cos(roll)]])
    return about_y @ about_x


@pytest.mark.parametrize(("roll", "pitch"), [(0.1, 0.0), (0.0, -0.2), (-0.3, 0.25)])
def test_tilt_rotates_the_specific_force_with_gravity(drive, turns, roll, pitch):
    plain, tilted = drive((), turns), drive([f"imu_tilt={roll},pitch={pitch}"], turns)
    felt = np.stack([plain["specific_force_x"], plain["specific_force_y"], np.full(250, STANDARD_GRAVITY)], axis=1)
    expected = felt @ rotation(roll, pitch)
    np.testing.assert_allclose(tilted["specific_force_x"], expected[:, 0], atol=1e-12)
    np.testing.assert_allclose(tilted["specific_force_y"], expected[:, 1], atol=1e-12)
    turn = np.stack([np.zeros(250), np.zeros(250), plain["yaw_rate"]], axis=1) @ rotation(roll, pitch)
    np.testing.assert_allclose(tilted["yaw_rate"], turn[:, 2], atol=1e-12)


def test_nose_down_sensor_feels_gravity_backwards(drive):
    columns = drive(["imu_tilt=0,pitch=0.05"], np.zeros((20, 2)))
    np.testing.assert_allclose(columns["specific_force_x"], -STANDARD_GRAVITY * math.sin(0.05), atol=1e-4)


@pytest.mark.parametrize("latency", [0.02, 0.173, 0.6])
def test_late_pose_is_the_pose_of_then(drive, turns, latency):
    """Against the true path, interpolated; the path starts at rest."""
    columns = drive([f"pose_latency={latency}"], turns)
    fixes = np.isfinite(columns["pose_x"]) & (columns["t"] > latency)
    assert fixes.sum() > 10
    for channel, truth in (("pose_x", "true_x"), ("pose_y", "true_y"), ("pose_yaw", "true_yaw")):
        then = np.interp(columns["t"][fixes] - latency, columns["t"], columns[truth])
        np.testing.assert_allclose(columns[channel][fixes], then, atol=2e-4)
    np.testing.assert_array_equal(np.isnan(columns["pose_x"]), np.isnan(drive((), turns)["pose_x"]))


@pytest.mark.parametrize("sample_rate", [25.0, 125.0, 500.0])
@pytest.mark.parametrize("latency", [0.0, 0.3, 1.0])
def test_latency_of_steady_travel_is_exact_from_the_first_fix_at_every_rate(act, turning_row, sample_rate, latency):
    """Straight at 2 m/s towards 0.4 rad: the past before the first sample continues backwards."""
    row = turning_row.copy()
    row[layout.SAMPLE_PERIOD] = 1 / sample_rate
    row[layout.V_X], row[layout.V_Y], row[layout.YAW_RATE], row[layout.YAW] = 2.0, 0.0, 0.0, 0.4
    memory = np.zeros(layout.EFFECT_MEMORY)
    effect = parse_effect(f"pose_latency={latency}")
    for k in range(int(1.5 * sample_rate)):
        distance = 2.0 * k / sample_rate
        row[layout.X], row[layout.Y] = distance * math.cos(0.4), distance * math.sin(0.4)
        row[layout.READING + 5 : layout.READING + 8] = row[layout.X], row[layout.Y], row[layout.YAW]
        late = act(effect, row, memory)[layout.READING + 5 : layout.READING + 8]
        behind = distance - 2.0 * latency
        np.testing.assert_allclose(late, (behind * math.cos(0.4), behind * math.sin(0.4), 0.4), atol=1e-9)


def test_latency_keeps_the_noise_of_the_fix(drive, turns, ideal_sensors):
    noisy = replace(ideal_sensors, pose=PoseReceiver(rate=10.0, position_noise=0.5))
    late, prompt = drive(["pose_latency=0.2"], turns, sensors=noisy), drive((), turns, sensors=noisy)
    shift = late["pose_x"] - prompt["pose_x"]
    assert np.nanmax(np.abs(shift)) < 0.2


def runs(values):
    """Lengths of the runs of equal values, without the last, which the end cuts."""
    changes = np.flatnonzero(np.diff(values) != 0)
    return np.diff(changes)


@pytest.mark.parametrize("samples", [1, 5, 25])
def test_held_reading_repeats_for_the_duration(drive, turns, samples):
    sensors = Sensors(pose=PoseReceiver(rate=10.0))
    held = drive([f"sensor_hold={samples * PERIOD},accelerometer=0,encoders=0"], turns, sensors=sensors)
    plain = drive((), turns, sensors=sensors)
    lengths = runs(held["yaw_rate"])
    assert np.median(lengths) == samples + 1
    new = np.flatnonzero(np.diff(held["yaw_rate"]) != 0) + 1
    np.testing.assert_array_equal(held["yaw_rate"][new], plain["yaw_rate"][new])
    np.testing.assert_array_equal(held["specific_force_x"], plain["specific_force_x"])
    np.testing.assert_array_equal(held["encoder_left"], plain["encoder_left"])


def test_hold_at_intervals_freezes_and_lets_go(drive, turns):
    effect = "sensor_hold=0.2,interval=0.8,first=0.4,accelerometer=0,gyro=1,encoders=0,pose=0"
    sensors = Sensors()
    held, plain = drive([effect], turns, sensors=sensors)["yaw_rate"], drive((), turns, sensors=sensors)["yaw_rate"]
    index = np.arange(1, 251)
    frozen = ((index - 50) % 100 >= 1) & ((index - 50) % 100 <= 25) & (index >= 50)
    np.testing.assert_array_equal(held[~frozen], plain[~frozen])
    np.testing.assert_array_equal(held[frozen & (index < 80)], plain[49])
    np.testing.assert_array_equal(held[frozen & (index > 140) & (index < 180)], plain[149])


def test_held_pose_repeats_the_last_fix_and_keeps_its_gaps(drive, turns, ideal_sensors):
    held = drive(["sensor_hold=0.45,accelerometer=0,gyro=0,encoders=0"], turns)["pose_x"]
    plain = drive((), turns)["pose_x"]
    np.testing.assert_array_equal(np.isnan(held), np.isnan(plain))
    fixes = held[np.isfinite(held)]
    assert np.unique(fixes).size < 0.6 * fixes.size
    assert set(fixes) <= set(plain[np.isfinite(plain)])


@pytest.mark.parametrize(("share", "passed"), [(0.9, 1), (1.5, 2), (2.5, 3)])
def test_of_a_slow_receiver_every_fix_after_the_hold_is_new(drive, turns, share, passed):
    rate = 10.0
    sensors = Sensors(pose=PoseReceiver(rate=rate))
    effect = f"sensor_hold={share / rate},accelerometer=0,gyro=0,encoders=0"
    held, plain = (drive(effects, turns, sensors=sensors)["pose_x"] for effects in ([effect], ()))
    held, plain = (values[np.isfinite(values)] for values in (held, plain))
    first = np.arange(len(plain)) // passed * passed
    np.testing.assert_array_equal(held, plain[first])
