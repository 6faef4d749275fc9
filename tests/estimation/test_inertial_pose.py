"""The inertial filter's pose: its covariance, what it leaves alone, rest, frames, bits."""

import math

import numpy as np
import pytest

from ddagr_gym.envs.options import make_settings
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import (
    CHANNELS,
    DeadReckoning,
    InertialBatch,
    InertialFilter,
    InertialModel,
    chi_square_band,
    normalised_estimation_error,
    run_inertial_filter,
    run_inertial_track,
)
from ddagr_gym.estimation import inertial_layout as layout
from ddagr_gym.estimation.dead_reckoning import integrate_track
from ddagr_gym.estimation.inertial_kernels import predict_inertial
from ddagr_gym.estimation.inertial_update import row_column, use_innovation
from ddagr_gym.estimation.layout import GAIN, MEASUREMENT, PROCESS, READING, ROW, SOIL_RATE, STRIDE, X
from ddagr_gym.evaluation.controllers import find_controller
from ddagr_gym.evaluation.runs import drive_turn
from ddagr_gym.parameters import Sensors
from ddagr_gym.physics.effects.slope import Slope
from ddagr_gym.presets import get_robot

MODEL = InertialModel.of(get_robot("ddagr"), Sensors())
PERIOD = Sensors().period
SIZE, WHOLE = layout.INERTIAL_STATE_SIZE, layout.INERTIAL_STATE_SIZE + layout.POSE_SIZE
SEED = 5_113
"""Of the turns here: of no other study."""


def driven(number, effects=()):
    """A turn of B6, which stands for 0.8 s first, and the filter's known start."""
    settings = make_settings(effects=effects)
    episode = settings.draw(np.random.default_rng([SEED, number]))
    run = drive_turn(find_controller("B6", episode.turn), settings, number, episode)
    return run.columns, (-episode.turn.run_in, episode.lateral_offset, episode.heading_offset)


@pytest.fixture(scope="module")
def level():
    return [driven(number) for number in range(16)]


@pytest.fixture(scope="module")
def sloping():
    return [driven(number, (Slope(math.radians(3.0), 0.7 * number),)) for number in range(6)]


def readings_of(columns):
    commands = np.column_stack([columns["command_right"], columns["command_left"]])
    return commands, np.column_stack([columns[name] for name in CHANNELS])


def true_pose(columns):
    return np.column_stack([columns[f"true_{name}"] for name in ("x", "y", "yaw")])


def test_pose_errors_agree_with_their_covariance(level):
    scores = []
    for columns, start in level:
        poses, covariances = run_inertial_track(MODEL, columns, start)
        scores.append(normalised_estimation_error(true_pose(columns)[-1] - poses[-1], covariances[-1]))
    # the truth is no drive of the filter's own model, so that the band is a wide one
    assert chi_square_band(3, len(scores), 0.999).contains(np.mean(scores))


def test_later_readings_correct_the_past(sloping):
    """On a slope biases and gravity are told apart in the turn, after the velocities had been wrong by them."""
    errors = []
    for columns, start in sloping:
        states, _ = run_inertial_filter(MODEL, columns)
        poses, _ = run_inertial_track(MODEL, columns, start)
        integrated = start[2] + integrate_track(*states[:, :3].T, PERIOD)[-1, 2]
        errors.append([poses[-1, 2] - columns["true_yaw"][-1], integrated - columns["true_yaw"][-1]])
    ours, integrated = np.sqrt(np.mean(np.square(errors), axis=0))
    assert ours < math.radians(0.2)
    assert ours < 0.5 * integrated


def test_the_pose_changes_no_bit_of_the_state(level):
    commands, readings = readings_of(level[0][0])
    alone, disturbed = InertialFilter(MODEL), InertialFilter(MODEL)
    rng = np.random.default_rng(0)
    for block in (slice(layout.POSE, layout.WORK_SIZE), slice(layout.POSE_CROSS, layout.POSE_CROSS + 3 * STRIDE)):
        disturbed._work[block] = 1e-3 * rng.standard_normal(block.stop - block.start)
    for found, same in zip(alone.run(commands, readings), disturbed.run(commands, readings), strict=True):
        np.testing.assert_array_equal(found, same)
    np.testing.assert_array_equal(alone.covariance, disturbed.covariance)
    assert np.abs(alone.pose - disturbed.pose).max() > 1e-6


def test_a_robot_that_stands_does_not_move():
    rng = np.random.default_rng(1)
    readings = np.zeros((250, 5))
    readings[:, :2] = 0.1 + 0.03 * rng.standard_normal((250, 2))  # slope or bias, and noise
    readings[:, 2] = 2e-3 + 7e-4 * rng.standard_normal(250)
    one = InertialFilter(MODEL)
    one.reset((1.0, -2.0, 0.3))
    one.run(np.zeros((1, 2)), readings)
    moved = one.pose - [1.0, -2.0, 0.3]
    assert np.abs(moved[:2]).max() < 2e-4  # two seconds
    assert abs(moved[2]) < 1e-4
    assert np.sqrt(np.diag(one.pose_covariance)).max() < 5e-4


def test_heading_follows_the_gyro_without_delay():
    """A turn that begins within half a second: half a sample of delay would be 1 mrad."""
    rate = 0.25 * np.clip((np.arange(1, 401) * PERIOD - 1.0) / 0.5, 0.0, 1.0)
    readings = np.full((400, 5), np.nan)
    readings[:, 2] = rate
    one = InertialFilter(MODEL)
    one.run(np.full((1, 2), np.nan), readings)
    exact = PERIOD * (rate.sum() - 0.5 * rate[-1])
    assert one.pose[2] == pytest.approx(exact, abs=2e-4)


def test_the_start_turns_and_shifts_the_track(level):
    columns, _ = level[1]
    poses, covariances = run_inertial_track(MODEL, columns)
    x, y, yaw = 0.4, -1.2, 2.1
    cosine, sine = math.cos(yaw), math.sin(yaw)
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    moved, turned = run_inertial_track(MODEL, columns, (x, y, yaw))
    np.testing.assert_allclose(moved, poses @ turn.T + [x, y, yaw], atol=1e-10)
    np.testing.assert_allclose(turned, turn @ covariances @ turn.T, atol=1e-12)


def test_batch_and_dead_reckoning_give_the_bits_of_the_track(level):
    columns, _ = level[2]
    commands, readings = readings_of(columns)
    batch, one = InertialBatch(MODEL, 2), InertialFilter(MODEL)
    reckoning = DeadReckoning(MODEL)
    reckoning.reset(0.0, 0.0, 0.0)
    for first in range(0, 600, 10):
        block = np.ascontiguousarray(readings[first : first + 10])
        one.run(commands[first : first + 1], block)
        batch.step(np.repeat(commands[first : first + 1], 2, axis=0), np.stack([block, block]))
        found = reckoning.update(commands[first], block)
    for n in range(2):
        np.testing.assert_array_equal(batch.poses[n], one.pose)
        np.testing.assert_array_equal(batch.pose_covariances[n], one.pose_covariance)
    assert (found.x, found.y, found.yaw) == tuple(one.pose)
    batch.reset([1])
    np.testing.assert_array_equal(batch.poses, [one.pose, np.zeros(3)])


def test_a_correction_of_the_past_settles():
    """A pose that jumps by 0.1 m while the robot stands."""
    still = np.zeros((10, 5))
    for settling, share in ((0.0, 1.0), (3.0, 1.0 - math.exp(-1.0)), (math.inf, 0.0)):
        reckoning = DeadReckoning(MODEL, settling)
        reckoning.reset(0.0, 0.0, 0.0)
        reckoning._filter.pose[0] += 0.1
        for _ in range(round(3.0 / (10 * PERIOD))):
            found = reckoning.update(np.zeros(2), still)
        assert found.x == pytest.approx(0.1 * share, abs=1e-3)
    with pytest.raises(InputError, match="settling"):
        DeadReckoning(MODEL, -1.0)


def test_without_settling_the_velocities_are_integrated(level):
    columns, _ = level[3]
    commands, readings = readings_of(columns)
    reckoning = DeadReckoning(MODEL, math.inf)
    reckoning.reset(0.0, 0.0, 0.0)
    for first in range(0, 1000, 10):
        found = reckoning.update(commands[first], np.ascontiguousarray(readings[first : first + 10]))
    states, _ = InertialFilter(MODEL).run(np.repeat(commands[0:1000:10], 10, axis=0), readings[:1000])
    np.testing.assert_allclose([found.x, found.y, found.yaw], integrate_track(*states[:, :3].T, PERIOD)[-1], atol=1e-12)


def covariance_of(work):
    """State and pose together (18, 18) in a workspace."""
    whole = np.zeros((WHOLE, WHOLE))
    rows = work[layout.Q : layout.POSE_CROSS + 3 * STRIDE].reshape(-1, STRIDE)
    whole[:SIZE, :SIZE] = rows[:SIZE, :SIZE]
    whole[SIZE:, :SIZE] = rows[STRIDE:, :SIZE]
    whole[:SIZE, SIZE:] = whole[SIZE:, :SIZE].T
    whole[SIZE:, SIZE:] = work[layout.POSE_OWN : layout.POSE_OWN + 9].reshape(3, 3)
    return whole


def workspace(covariance, values):
    """With a covariance (18, 18) and values (18,) of state and pose."""
    work = np.zeros(layout.WORK_SIZE)
    work[X : X + SIZE], work[layout.POSE : layout.POSE + 3] = values[:SIZE], values[SIZE:]
    rows = work[layout.Q : layout.POSE_CROSS + 3 * STRIDE].reshape(-1, STRIDE)
    rows[:SIZE, :SIZE], rows[STRIDE:, :SIZE] = covariance[:SIZE, :SIZE], covariance[SIZE:, :SIZE]
    work[layout.POSE_OWN : layout.POSE_OWN + 9] = covariance[SIZE:, SIZE:].ravel()
    return work


@pytest.fixture
def moving():
    """A covariance (18, 18) with all correlations, and a state in a turn."""
    mixing = np.random.default_rng(2).standard_normal((WHOLE, WHOLE))
    spread = np.concatenate([[2e-3, 4e-3, 1e-3], [0.02] * 2, [0.2] * 4, [1e-3], [3e-3] * 4, [0.02], [1e-3, 1e-3, 5e-4]])
    covariance = spread[:, None] * (mixing @ mixing.T / WHOLE) * spread
    state, _ = MODEL.initial()
    state[:5] = [0.2, -0.03, 0.25, 2.0, 1.0]
    return covariance, np.concatenate([state, [0.5, 0.3, 0.7]])


def predicted(packed, covariance, values):
    work = workspace(covariance, values)
    work[READING : READING + 2] = [0.1, 0.05]
    predict_inertial(packed, work, 2.1, 0.9, PERIOD)
    return work


def test_prediction_is_that_of_all_eighteen_together(moving):
    covariance, values = moving
    packed = MODEL.pack()
    packed[PROCESS : PROCESS + 12] = packed[MEASUREMENT : MEASUREMENT + 5] = 0.0
    packed[[SOIL_RATE, layout.GRAVITY_WALK, layout.PATCH_VARIANCE]] = 0.0
    found = covariance_of(predicted(packed, covariance, values))

    def mean(entries):
        work = predicted(packed, covariance, entries)
        return np.concatenate([work[X : X + SIZE], work[layout.POSE : layout.POSE + 3]])

    steps = 1e-5 * np.eye(WHOLE)
    transition = np.column_stack([(mean(values + step) - mean(values - step)) / 2e-5 for step in steps])
    expected = transition @ covariance @ transition.T
    deviations = np.sqrt(np.diag(expected))
    gained = (found - covariance)[SIZE:] / np.outer(deviations[SIZE:], deviations)
    wanted = (expected - covariance)[SIZE:] / np.outer(deviations[SIZE:], deviations)
    # the kernel takes the velocities' covariance after the step, which differs from its middle by half a step
    np.testing.assert_allclose(gained, wanted, atol=3e-4)
    assert np.abs(wanted).max() > 1e-2


def test_correction_is_josephs_form_of_all_eighteen_together(moving):
    covariance, values = moving
    row = np.zeros(WHOLE)
    row[:SIZE] = np.random.default_rng(3).standard_normal(SIZE)
    work = workspace(covariance, values)
    work[ROW : ROW + SIZE] = row[:SIZE]
    variance, innovation = 0.02, 0.05
    use_innovation(MODEL.pack(), work, innovation, row_column(work), variance, 10.0)
    total = row @ covariance @ row + variance
    gain = np.concatenate([work[GAIN : GAIN + SIZE], covariance[SIZE:] @ row / total])
    kept = np.eye(WHOLE) - np.outer(gain, row)
    expected = kept @ covariance @ kept.T + variance * np.outer(gain, gain)
    np.testing.assert_allclose(covariance_of(work), expected, atol=1e-12)
    np.testing.assert_allclose(work[layout.POSE : layout.POSE + 3], values[SIZE:] + gain[SIZE:] * innovation)
