"""Encoders: counts add up to the angle rolled, whatever the rate and the resolution."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ddagr_gym.parameters import Sensors, WheelEncoder
from ddagr_gym.physics import layout
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.sensors.wheel_encoder import read_encoders
from ddagr_gym.simulator import Simulator, build_row, simulate

ROBOT, SOIL = get_robot("ddagr"), get_soil("thesis_a1")
COMMANDS = np.concatenate([np.tile([1.1, -0.4], (150, 1)), np.tile([-0.6, 0.2], (150, 1))])


def _final_angle(commands, encoder, samples):
    simulator = Simulator(1)
    simulator.configure(0, ROBOT, SOIL, Sensors(encoder=encoder))
    simulator.reset()
    readings, record = simulator.step(commands[None, :samples], recorded=[layout.WHEEL_ANGLE, layout.WHEEL_ANGLE + 1])
    return readings[0, :, 3:5], record[0]


@pytest.mark.parametrize("counts", [400.0, 20000.0])
def test_counts_telescope_to_the_angle_rolled(counts):
    period = Sensors().period
    readings, angles = _final_angle(COMMANDS, WheelEncoder(counts_per_revolution=counts), len(COMMANDS))
    rolled = np.cumsum(readings, axis=0) * period
    # never more than one count off, at any time: quantisation does not accumulate
    assert (np.abs(rolled - angles) <= 2 * math.pi / counts * (1 + 1e-9)).all()
    steps = readings * period * counts / (2 * math.pi)
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)


def test_ideal_encoder_reads_the_mean_speed_over_the_sample():
    readings, angles = _final_angle(COMMANDS, WheelEncoder(counts_per_revolution=0.0), len(COMMANDS))
    mean = np.diff(angles, axis=0, prepend=0.0) / Sensors().period
    np.testing.assert_allclose(readings, mean, atol=1e-12)


def test_scale_and_noise():
    readings, angles = _final_angle(COMMANDS, WheelEncoder(counts_per_revolution=0.0, scale=(1.1, 0.5)), 100)
    mean = np.diff(angles, axis=0, prepend=0.0) / Sensors().period
    np.testing.assert_allclose(readings, mean * [1.1, 0.5], atol=1e-12)
    row = build_row(ROBOT, SOIL, Sensors(encoder=WheelEncoder(counts_per_revolution=0.0, speed_noise=0.2)))
    read_encoders(row, np.array([1.0, -2.0]), 0.008)
    np.testing.assert_allclose(row[layout.READING + 3 : layout.READING + 5], [0.2, -0.4])


def test_reset_starts_the_counts_again():
    simulator = Simulator(1)
    simulator.configure(0, ROBOT, SOIL)
    simulator.reset()
    first, _ = simulator.step(COMMANDS[None])
    simulator.reset()
    second, _ = simulator.step(COMMANDS[None])
    np.testing.assert_array_equal(first, second)


@given(st.floats(10.0, 1e5), st.floats(20.0, 1000.0))
@settings(max_examples=20)
def test_error_of_a_reading_is_one_count_per_sample(counts, rate):
    from ddagr_gym.parameters import Imu

    sensors = Sensors(imu=Imu(sample_rate=rate), encoder=WheelEncoder(counts_per_revolution=counts))
    drive = simulate(ROBOT, SOIL, np.tile([0.9, 0.5], (20, 1)), sensors=sensors)
    decay = (1 - np.exp(-ROBOT.motor_rate * drive["t"])) / ROBOT.motor_rate
    angle = 0.9 * (drive["t"] - decay)
    mean = np.diff(angle, prepend=0.0) * rate
    assert (np.abs(drive["encoder_right"] - mean) <= 2 * math.pi / counts * rate * (1 + 1e-9)).all()
