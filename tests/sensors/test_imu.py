"""Accelerometer and gyro: specific force at the sensor's place and axes, then what the device does to it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddagr_gym.parameters import STANDARD_GRAVITY, Imu, Numerics, Sensors
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects.soil_patch import SoilPatch
from ddagr_gym.physics.effects.soil_split import SoilSplit
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.sensors.imu import digitise, read_imu
from ddagr_gym.simulator import build_row, simulate

IDEAL = Imu(accelerometer_noise=0.0, gyro_noise=0.0, accelerometer_resolution=0.0, gyro_resolution=0.0)


def _read(imu, force=(0.0, 0.0), yaw_rate=0.0, yaw_acceleration=0.0, velocity=(0.0, 0.0), noise=(0.0, 0.0, 0.0)):
    row = build_row(get_robot("ddagr"), get_soil("thesis_a1"), Sensors(imu=imu))
    row[layout.MEAN_SPECIFIC_FORCE : layout.MEAN_SPECIFIC_FORCE + 2] = force
    row[layout.MEAN_YAW_ACCELERATION] = yaw_acceleration
    row[layout.V_X], row[layout.V_Y], row[layout.YAW_RATE] = *velocity, yaw_rate
    read_imu(row, np.array(noise, dtype=float))
    return row[layout.READING : layout.READING + 3].copy()


def _with(**changes):
    return IDEAL.with_values(**changes)


def test_ideal_sensor_at_the_origin_reads_the_truth():
    np.testing.assert_array_equal(_read(IDEAL, (0.3, -0.2), 0.4), [0.3, -0.2, 0.4])


ARMS = st.tuples(st.floats(-1, 1), st.floats(-1, 1))


@given(ARMS, st.floats(-4, 4), st.floats(-4, 4), st.floats(-5, 5), st.floats(-5, 5))
def test_lever_arm_adds_euler_and_centripetal_acceleration(arm, rate, turn, force_x, force_y):
    reading = _read(_with(position=arm), (force_x, force_y), rate, turn)
    r, spin, alpha = np.array([*arm, 0.0]), np.array([0.0, 0.0, rate]), np.array([0.0, 0.0, turn])
    expected = np.array([force_x, force_y, 0.0]) + np.cross(alpha, r) + np.cross(spin, np.cross(spin, r))
    limited = np.clip(expected[:2], -IDEAL.accelerometer_range, IDEAL.accelerometer_range)
    np.testing.assert_allclose(reading[:2], limited, atol=1e-12)


@given(st.floats(-math.pi, math.pi), st.floats(-5, 5), st.floats(-5, 5))
def test_mounting_angle_turns_the_reading_the_other_way(angle, force_x, force_y):
    reading = _read(_with(mounting_yaw=angle), (force_x, force_y))
    assert complex(*reading[:2]) == pytest.approx((force_x + 1j * force_y) * np.exp(-1j * angle), abs=1e-12)


def test_bias_and_scale_act_in_the_sensors_axes():
    imu = _with(
        mounting_yaw=math.pi / 2, accelerometer_bias=(0.1, -0.2), accelerometer_scale=(1.1, 0.9), gyro_bias=0.05,
        gyro_scale=1.02,
    )  # fmt: skip
    np.testing.assert_allclose(_read(imu, (1.0, 2.0), 0.5), [1.1 * 2.0 + 0.1, -0.9 * 1.0 - 0.2, 1.02 * 0.5 + 0.05])


def test_noise_is_a_standard_deviation_and_grows_with_travel():
    imu = _with(accelerometer_noise=0.03, accelerometer_vibration=0.5, gyro_noise=0.002)
    np.testing.assert_allclose(_read(imu, noise=(1.0, -2.0, 3.0)), [0.03, -0.06, 0.006])
    moving = _read(imu, velocity=(0.3, 0.4), noise=(1.0, -2.0, 3.0))
    np.testing.assert_allclose(moving, [0.03 + 0.25, -2 * (0.03 + 0.25), 0.006])


@given(st.floats(-30, 30), st.floats(1e-4, 1.0))
def test_quantisation_rounds_to_the_nearest_step_inside_the_range(value, step):
    reading = digitise(value, step, 19.6)
    if abs(value) < 19.0:
        assert abs(reading - value) <= 0.5 * step * (1 + 1e-9)
        assert reading / step == pytest.approx(round(reading / step), abs=1e-6)
    assert abs(reading) <= 19.6


def test_saturation_at_the_ranges():
    reading = _read(_with(accelerometer_range=2.0, gyro_range=1.0), (5.0, -7.0), 3.0)
    np.testing.assert_array_equal(reading, [2.0, -2.0, 1.0])


def _second_difference(path, period):
    return (path[2:] - 2 * path[1:-1] + path[:-2]) / period**2


@pytest.mark.parametrize("arm", [(0.0, 0.0), (0.4, -0.25)])
def test_reading_is_the_second_derivative_of_the_sensors_path(arm):
    """Independent of the simulator's own bookkeeping: differentiate the true path of the sensor twice."""
    robot, sensors = get_robot("ddagr"), Sensors(imu=_with(position=arm, sample_rate=500.0))
    t = np.arange(1500) / 500.0
    commands = np.stack([1.0 + 0.6 * np.sin(2.0 * t), 0.9 - 0.5 * np.sin(1.3 * t)], axis=-1)
    drive = simulate(
        robot, get_soil("thesis_a1"), commands, sensors=sensors, numerics=Numerics(substeps=4, contact_nodes=8)
    )
    heading = np.exp(1j * drive["true_yaw"])
    path = drive["true_x"] + 1j * drive["true_y"] + heading * complex(*arm)
    felt = _second_difference(path, sensors.period) / heading[1:-1]
    # a reading is the mean over the sample that ends with it: the second difference is the mean of two of them
    reading = drive["specific_force_x"] + 1j * drive["specific_force_y"]
    mean = 0.5 * (reading[1:-1] + reading[2:])
    moving = slice(500, None)
    assert np.abs(felt[moving]).max() > 0.1
    assert np.abs(mean - felt)[moving].max() < 5e-3


def test_gravity_is_felt_through_tilt_only_and_turns_with_heading():
    robot, soil, still = get_robot("ddagr"), get_soil("thesis_a1"), np.zeros((250, 2))
    for yaw in (0.0, 1.0, 2.5, -2.0):
        flat = simulate(robot, soil, still, sensors=Sensors(imu=IDEAL), initial_state={"yaw": yaw})
        hill = simulate(
            robot, soil, still, sensors=Sensors(imu=IDEAL), initial_state={"yaw": yaw}, effects=["slope=0.08"]
        )
        np.testing.assert_allclose(flat["specific_force_x"], 0.0, atol=1e-12)
        along = STANDARD_GRAVITY * math.sin(0.08)
        felt = (hill["specific_force_x"] + 1j * hill["specific_force_y"])[-50:]
        np.testing.assert_allclose(felt, along * np.exp(-1j * yaw), atol=1e-5)


def test_default_noise_is_the_data_sheets():
    drive = simulate(get_robot("ddagr"), get_soil("thesis_a1"), np.zeros((5000, 2)), seed=3)
    imu = Imu()
    for name, noise, step in (
        ("specific_force_x", imu.accelerometer_noise, imu.accelerometer_resolution),
        ("specific_force_y", imu.accelerometer_noise, imu.accelerometer_resolution),
        ("yaw_rate", imu.gyro_noise, imu.gyro_resolution),
    ):
        assert drive[name].std() == pytest.approx(math.sqrt(noise**2 + step**2 / 12), rel=0.05)
        assert abs(drive[name].mean()) < 4 * noise / math.sqrt(5000)
        np.testing.assert_allclose(drive[name] / step, np.round(drive[name] / step), atol=1e-6)


def _leaning(sinkage, share=1.0):
    row = build_row(replace(get_robot("ddagr"), sinkage_tilt=share), get_soil("thesis_a1"), Sensors(imu=IDEAL))
    row[layout.SINKAGE : layout.SINKAGE + 4] = sinkage
    row[layout.FELT_DEPTH : layout.FELT_DEPTH + 4] = 1.0
    read_imu(row, np.zeros(3))
    return row[layout.READING : layout.READING + 3].copy()


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_a_robot_that_sinks_unevenly_feels_gravity(share):
    """Front deeper: nose down, the x axis points down and reads -g sin; left deeper: the same of y."""
    robot, deeper = get_robot("ddagr"), 0.01
    nose_down = deeper / (2 * robot.half_wheelbase)
    left_down = deeper / (2 * robot.half_track)
    expected = -share * STANDARD_GRAVITY * np.array([nose_down, left_down])
    np.testing.assert_allclose(_leaning((0.02, 0.02, 0.01, 0.01), share), [expected[0], 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(_leaning((0.01, 0.02, 0.01, 0.02), share), [0.0, expected[1], 0.0], atol=1e-12)
    np.testing.assert_array_equal(_leaning((0.02, 0.02, 0.02, 0.02), share), 0.0)


def test_a_patch_under_the_left_wheels_is_left_out_of_the_tilt():
    """It is felt no longer than relief; what its stiffness adds to the depth is taken back."""
    robot = replace(get_robot("ddagr"), sinkage_tilt=1.0)
    ideal = {"sensors": Sensors(imu=IDEAL), "initial_state": {"y": 0.0}}
    beside = SoilPatch(1.0, 0.5, centre_y=1.0, radius=1.0, edge=0.05, half_length=100.0)
    columns = [
        simulate(robot, get_soil("thesis_a1"), np.full((250, 2), 0.7), effects=effects, **ideal)
        for effects in ([], [beside], [SoilSplit(1.0, 0.5)])
    ]
    felt = [abs(drive["specific_force_y"][-20:].mean()) for drive in columns]
    assert columns[1]["true_sinkage_2"][-1] > 1.2 * columns[1]["true_sinkage_1"][-1]
    assert max(felt[:2]) < 0.2 * felt[2]


def test_softer_soil_under_the_left_wheels_is_felt_in_a_drive():
    robot = replace(get_robot("ddagr"), sinkage_tilt=1.0)
    commands = np.full((250, 2), 0.7)
    drive = simulate(robot, get_soil("thesis_a1"), commands, sensors=Sensors(imu=IDEAL), effects=[SoilSplit(1.0, 0.5)])
    left, right = (np.mean([drive[f"true_sinkage_{wheel}"][-1] for wheel in bank]) for bank in ((2, 4), (1, 3)))
    roll = (left - right) / (2 * robot.half_track)
    assert roll > 3e-3
    assert drive["specific_force_y"][-20:].mean() == pytest.approx(-STANDARD_GRAVITY * roll, rel=0.02, abs=2e-3)
