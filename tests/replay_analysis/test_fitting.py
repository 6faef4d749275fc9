from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.identification.noise import ChannelNoise
from ddagr_gym.identification.recording_noise import RecordingNoise
from ddagr_gym.identification.residual_weights import ROBUST, UNKNOWN_GYRO_BIAS, misfit_weights, noise_weights
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.replay_analysis.fitting import LATEST_CLOCK, drive_mode_parameters, motor_start
from ddagr_gym.replay_analysis.kinematic import Motor

GYRO = CHANNELS.index("yaw_rate")


def noise(sigma=0.1, correlation=0.0, bias=None):
    return RecordingNoise({c: ChannelNoise(sigma, correlation=correlation) for c in CHANNELS}, 0.0, 0.0, bias)


def test_correlated_samples_count_for_less(make_windows):
    windows = make_windows(np.zeros((2, 40, 2)), recording=np.array([0, 1]))
    weights = noise_weights([noise(), noise(0.2, 0.6)], windows, imposed=False, dead=())
    # (1 + 0.6)/(1 - 0.6) = 4 samples are worth one
    assert weights.sigma[:, 0, GYRO] == pytest.approx([0.1, 0.4])
    assert weights.robust[GYRO] == pytest.approx(ROBUST / 2.0)


def test_what_drives_or_says_nothing_does_not_judge(make_windows):
    windows = make_windows(np.zeros((1, 40, 2)))
    weights = noise_weights([noise()], windows, imposed=True, dead=("yaw_rate",))
    judged = [name for k, name in enumerate(CHANNELS) if np.isfinite(weights.sigma[0, 0, k])]
    assert judged == ["pose_x", "pose_y", "pose_yaw"]


def test_what_a_fit_leaves_unexplained_widens_its_weights(make_windows):
    rng = np.random.default_rng(0)
    windows = make_windows(np.zeros((30, 60, 2)))
    prediction = np.zeros((30, 40, 8))
    measured = np.zeros_like(prediction)
    measured[..., GYRO] = rng.normal(0.0, 0.5, (30, 40))
    windows = replace(windows, measured=measured)
    before = noise_weights([noise()], windows, imposed=False, dead=())
    after = misfit_weights(windows, prediction, before)
    assert after.sigma[0, 0, GYRO] == pytest.approx(0.5, rel=0.15)
    assert after.sigma[0, 0, 3] == before.sigma[0, 0, 3]
    assert np.isinf(after.sigma[..., 0]).all()


def test_a_handful_of_samples_changes_no_weight(make_windows):
    windows = make_windows(np.zeros((1, 30, 2)))
    windows.measured[0, :3, GYRO] = 5.0
    before = noise_weights([noise()], windows, imposed=False, dead=())
    assert misfit_weights(windows, np.zeros((1, 10, 8)), before).sigma[0, 0, GYRO] == before.sigma[0, 0, GYRO]


def test_motors_do_not_matter_where_wheel_speeds_drive():
    robot, soil = get_robot("warthog"), get_soil("lete_sand_wong")
    commands = {p.name for p in drive_mode_parameters(robot, soil, [noise()], 0.05, imposed=False)}
    imposed = {p.name for p in drive_mode_parameters(robot, soil, [noise()], 0.05, imposed=True)}
    assert commands - imposed == {"motor_rate", "maximum_wheel_speed", "command_shift"}
    assert imposed - commands == {"wheel_speed_shift"}


def test_the_clocks_shift_stays_within_what_windows_keep():
    made = drive_mode_parameters(get_robot("warthog"), get_soil("lete_sand_wong"), [noise()], 0.05, imposed=True)
    shift = next(p for p in made if p.shift)
    assert -shift.low == shift.high == pytest.approx(LATEST_CLOCK - 0.05)


@pytest.mark.parametrize(
    ("biases", "expected"),
    [([(0.003, 0.004)], 0.005), ([None], UNKNOWN_GYRO_BIAS), ([(0.0, 0.0)], 2e-4), ([(0.1, 0.0), None], 0.005)],
)
def test_a_gyro_bias_is_as_sure_as_the_rest_that_showed_it(biases, expected):
    items = [noise(bias=bias) for bias in biases]
    made = drive_mode_parameters(get_robot("ddagr"), get_soil("thesis_a1"), items, 0.02, imposed=False)
    assert [p.prior for p in made if p.name.startswith("gyro_bias")] == pytest.approx([expected] * len(biases))


def test_the_commands_fit_starts_at_the_motor_of_the_baseline():
    robot = get_robot("warthog")
    start = motor_start(robot, Motor(3.0, 8.35, 0.2))
    assert np.exp(start["motor_rate"]) * robot.motor_rate == pytest.approx(3.0)
    assert np.exp(start["maximum_wheel_speed"]) * robot.maximum_wheel_speed == pytest.approx(8.35)
    assert start["command_shift"] == 0.2
