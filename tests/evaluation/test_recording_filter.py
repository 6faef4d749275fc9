"""The filter over recordings with spans, unknown motors and no commands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.estimation import FilterModel, run_filter
from ddagr_gym.evaluation.recording_filter import FilterSetUp, filter_recording, set_up_filter
from ddagr_gym.identification.recording_noise import recording_noise
from ddagr_gym.parameters import Imu, Sensors
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import simulate

RATE = 50.0


def simulated(motor_rate=4.5, effects=()):
    robot = replace(get_robot("ddagr"), motor_rate=motor_rate)
    t = np.arange(0.0, 30.0, 1.0 / RATE)
    commands = np.full((t.size, 2), 0.7)
    for start, pair in ((4, (1.1, 0.3)), (12, (0.3, 1.1)), (20, (1.0, 0.5)), (26, (0.7, 0.7))):
        commands[t >= start] = pair
    return simulate(robot, get_soil("thesis_a1"), commands, sensors=Sensors(Imu(sample_rate=RATE)), seed=1)


@pytest.fixture(scope="module")
def robot():
    return get_robot("ddagr")


@pytest.fixture(scope="module")
def columns():
    return simulated()


@pytest.fixture(scope="module")
def model(robot):
    return FilterModel.of(robot, Sensors(Imu(sample_rate=RATE)))


def recorded(columns, robot, **others):
    return Recording.from_columns(columns, robot, **others)


def test_one_span_from_rest_is_the_plain_filter(columns, robot, model):
    ours = filter_recording(FilterSetUp(model), recorded(columns, robot))
    plain = run_filter(model, columns)
    late = slice(300, None)
    np.testing.assert_allclose(ours.states[late, :3], plain.states[late, :3], atol=2e-3)


def test_soil_stays_and_motion_starts_anew_at_a_span(columns, robot, model):
    count = len(columns["t"])
    parted = recorded(columns, robot, spans=[(0, 900), (900, count)])
    run = filter_recording(FilterSetUp(model), parted)
    np.testing.assert_allclose(run.states[900, 5:9], run.states[899, 5:9], atol=0.05)
    assert run.deviations[900, 0] > 2.0 * run.deviations[899, 0]
    assert abs(run.states[900, 0] - columns["true_v_x"][900]) < 0.06
    late = slice(1000, None)
    np.testing.assert_allclose(run.states[late, 0], columns["true_v_x"][late], atol=0.02)


def test_noise_comes_from_the_recording(columns, robot):
    recording = recorded(columns, robot)
    noise = recording_noise(recording, np.random.default_rng(0))
    set_up = set_up_filter(robot, [recording], [noise])
    assert set_up.use_commands
    assert set_up.model.noise.gyro == noise.channels["yaw_rate"].sigma
    assert set_up.model.sample_period == pytest.approx(1.0 / RATE)
    run = filter_recording(set_up, recording)
    assert np.sqrt(np.mean((run.states[200:, 0] - columns["true_v_x"][200:]) ** 2)) < 0.01


def test_motors_that_do_not_follow_are_noticed():
    columns = simulated(motor_rate=1.0)
    believed = replace(get_robot("ddagr"), motor_rate=20.0, standard_deviations={})
    recording = recorded(columns, believed)
    noise = recording_noise(recording, np.random.default_rng(0))
    set_up = set_up_filter(believed, [recording], [noise], motor_uncertainty=0.0)
    assert not set_up.use_commands
    run = filter_recording(set_up, recording)
    assert np.sqrt(np.mean((run.states[200:, 3] - columns["true_omega_right"][200:]) ** 2)) < 0.05


def test_recorded_attitude_explains_a_slope(columns, robot, model):
    tilted = {**columns, "pitch": np.full(len(columns["t"]), 0.05), "roll": np.zeros(len(columns["t"]))}
    recording = recorded(tilted, robot)
    level = filter_recording(FilterSetUp(model), recording)
    sloping = filter_recording(FilterSetUp(model, attitude=True), recording)
    # on a slope downhill the filter expects the robot to be faster than on the flat
    assert sloping.states[150, 0] > level.states[150, 0] + 1e-3


def test_nothing_to_filter(robot, model):
    recording = recorded({"t": np.arange(10.0), "command_right": np.zeros(10)}, robot)
    with pytest.raises(InputError, match="the filter needs one"):
        filter_recording(FilterSetUp(model), recording)
