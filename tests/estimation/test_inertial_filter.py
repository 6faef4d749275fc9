"""The inertial filter: gravity on slopes, none on the level, covariance, bits."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.estimation import (
    CHANNELS,
    DeadReckoning,
    FilterModel,
    InertialBatch,
    InertialFilter,
    InertialKnowledge,
    InertialModel,
    run_filter,
    run_inertial_filter,
)
from ddagr_gym.estimation.columns import stack_columns
from ddagr_gym.estimation.inertial_kernels import since_balance
from ddagr_gym.estimation.inertial_layout import GRAVITY, INERTIAL_STATE, PATCH_AHEAD, WORK_SIZE
from ddagr_gym.estimation.layout import COMMANDS
from ddagr_gym.parameters import STANDARD_GRAVITY, Sensors
from ddagr_gym.physics.effects.slope import Slope
from ddagr_gym.presets import get_robot

ROBOT = get_robot("ddagr")
MODEL = InertialModel.of(ROBOT, Sensors())
ANGLE, DIRECTION = math.radians(3.0), 0.7


@pytest.fixture(scope="module")
def sloping(driven):
    return driven((Slope(ANGLE, DIRECTION),))


def body_gravity(yaw):
    """Pull of gravity along the body on the slope, (T, 2) [m/s^2], by wheel model, eq. (23)."""
    pull = STANDARD_GRAVITY * math.sin(ANGLE)
    return pull * np.stack([-np.cos(yaw - DIRECTION), np.sin(yaw - DIRECTION)], axis=-1)


def test_gravity_converges_on_a_slope_and_turns_with_the_body(sloping):
    states, _ = run_inertial_filter(MODEL, sloping.columns)
    error = states[:, GRAVITY : GRAVITY + 2] - body_gravity(sloping.columns["true_yaw"])
    # 0.8 s of standing: 100 samples of 0.031 m/s^2; a bias of 0.05 m/s^2 cannot be told from gravity yet
    assert np.abs(error[100]).max() < 0.02
    assert np.abs(error[100:]).max() < 0.08
    assert np.ptp(states[100:, GRAVITY]) > 0.5


def test_gravity_is_none_on_the_level(level):
    states, _ = run_inertial_filter(MODEL, level.columns)
    # a bias of 0.05 m/s^2 cannot be told from gravity before the robot has turned, as on the slope
    assert np.abs(states[100:, GRAVITY : GRAVITY + 2]).max() < 0.08
    assert np.abs(states[-100:, GRAVITY : GRAVITY + 2]).max() < 0.01


def test_side_slip_on_a_slope_is_that_of_the_robot(sloping):
    truth = sloping.columns["true_v_y"]
    states, _ = run_inertial_filter(MODEL, sloping.columns)
    flat = run_filter(FilterModel.of(ROBOT, Sensors()), sloping.columns).states
    ours, theirs = (np.sqrt(np.mean((found[:, 1] - truth) ** 2)) for found in (states, flat))
    assert ours < 0.008
    assert ours < 0.4 * theirs


def test_speed_on_the_level_is_no_worse_than_the_flat_filters(level):
    truth = level.columns["true_v_x"]
    ours = run_inertial_filter(MODEL, level.columns)[0][:, 0] - truth
    theirs = run_filter(FilterModel.of(ROBOT, Sensors()), level.columns).states[:, 0] - truth
    assert np.sqrt(np.mean(ours**2)) < 1.1 * np.sqrt(np.mean(theirs**2))


def readings_of(columns):
    commands = np.column_stack([columns["command_right"], columns["command_left"]])
    return commands, np.column_stack([columns[name] for name in CHANNELS])


def test_covariance_stays_a_covariance(sloping):
    commands, readings = readings_of(sloping.columns)
    one = InertialFilter(MODEL)
    for first in range(0, len(readings) - 100, 100):
        one.run(commands[first : first + 100], readings[first : first + 100])
        np.testing.assert_array_equal(one.covariance, one.covariance.T)
        assert np.linalg.eigvalsh(one.covariance).min() > -1e-12


def test_pieces_give_the_bits_of_the_whole(sloping):
    commands, readings = readings_of(sloping.columns)
    whole, _ = run_inertial_filter(MODEL, sloping.columns)
    one = InertialFilter(MODEL)
    one.run(commands[:50], readings[:50])
    one.reset()
    pieces = [one.run(commands[k : k + 7], readings[k : k + 7])[0] for k in range(0, len(readings), 7)]
    # run_inertial_filter takes its steps from the column of times, whose last bits differ
    np.testing.assert_allclose(np.concatenate(pieces), whole, rtol=1e-6, atol=1e-9)
    again = InertialFilter(MODEL).run(commands, readings)[0]
    np.testing.assert_array_equal(np.concatenate(pieces), again)


def test_a_batch_gives_the_bits_of_single_filters_and_forgets_alone(sloping, level):
    drives = [readings_of(run.columns) for run in (sloping, level)]
    batch, singles = InertialBatch(MODEL, 2), [InertialFilter(MODEL) for _ in drives]
    for first in range(0, 600, 10):
        commands = np.array([own[first] for own, _ in drives])
        batch.step(commands, np.array([own[first : first + 10] for _, own in drives]))
        for single, (own, readings) in zip(singles, drives, strict=True):
            single.run(own[first : first + 1], np.ascontiguousarray(readings[first : first + 10]))
    for n, single in enumerate(singles):
        np.testing.assert_array_equal(batch.states[n], single.state)
        np.testing.assert_array_equal(batch.covariances[n], single.covariance)
    batch.reset([1])
    np.testing.assert_array_equal(batch.states[0], singles[0].state)
    np.testing.assert_array_equal(batch.states[1], MODEL.initial()[0])
    with pytest.raises(InputError, match="shapes"):
        batch.step(commands, readings[None, :10])
    with pytest.raises(InputError, match="count"):
        InertialBatch(MODEL, 0)


def test_gaps_and_outliers_are_survived(level):
    commands, readings = readings_of(level.columns)
    readings[300:400, :2] = np.nan
    readings[500:510, 2] = np.nan
    readings[600, :] = 1e6
    readings[700, :] = 1e300
    states, standardised = InertialFilter(MODEL).run(commands, readings)
    assert np.isfinite(states).all()
    assert np.isnan(standardised[500:510, 2]).all()
    assert np.abs(states[1200:, 0] - level.columns["true_v_x"][1200:]).max() < 0.03


@pytest.mark.parametrize("durations", [[0.008] * 5, [0.030, 0.001, 0.001, 0.002, 0.006]])
def test_uneven_samples_count_for_as_long_as_they_last(durations):
    """Forces are balanced over the time since the last balance; of even samples it has the bits of five of them."""
    work = np.zeros(WORK_SIZE)
    for _ in range(2):
        passed = [since_balance(work, place, 5, duration) for place, duration in enumerate(durations, 1)]
    assert passed[-1] == pytest.approx(sum(durations), rel=1e-14)
    assert len(set(durations)) > 1 or passed[-1] == 5 * durations[0]


def test_initial_state_and_names():
    state, covariance = MODEL.initial()
    assert len(INERTIAL_STATE) == len(state) == len(covariance) == 15
    assert state[PATCH_AHEAD] == MODEL.knowledge.patch_ahead
    assert covariance[GRAVITY, GRAVITY] == pytest.approx(MODEL.knowledge.gravity_deviation**2)
    with pytest.raises(InputError, match="balance_interval"):
        InertialKnowledge(balance_interval=0)


def test_dead_reckoning_follows_the_true_path(sloping):
    columns = sloping.columns
    reckoning = DeadReckoning(MODEL)
    reckoning.reset(-0.5, 0.0, 0.0)
    commands, readings = readings_of(columns)
    for first in range(0, len(readings), 10):
        found = reckoning.update(commands[first], readings[first : first + 10])
    assert math.hypot(found.x - columns["true_x"][-1], found.y - columns["true_y"][-1]) < 0.12
    assert found.yaw == pytest.approx(columns["true_yaw"][-1], abs=0.03)


def test_a_known_push_is_no_force_of_the_wheels(level):
    """Readings with it, told of it, are readings without it on ground that slopes as much (straight on)."""
    push = np.array([-0.4, 0.1, 0.0])
    columns = {name: values[:300].copy() for name, values in level.columns.items() if len(values) > 300}
    commands, readings = stack_columns(columns, COMMANDS, np.nan), stack_columns(columns, CHANNELS, np.nan)
    told, plain = InertialFilter(MODEL), InertialFilter(MODEL)
    told.known_push[:] = push
    plain.reset(gravity=push[:2])
    without = readings.copy()
    without[:, :2] -= push[:2]
    first, second = told.run(commands, readings)[0], plain.run(commands, without)[0]
    second[:, GRAVITY : GRAVITY + 2] -= push[:2]
    scale = np.abs(first).max(axis=0)
    np.testing.assert_allclose(first / scale, second / scale, atol=0.05)
    told.reset()
    assert not told.known_push.any()


def test_an_accelerometer_that_shakes_with_speed_counts_for_less_on_the_way(level):
    """At rest it tells gravity as well as a still one (wheel model, eq. (35))."""
    imu = replace(Sensors().imu, accelerometer_vibration=0.6)
    models = MODEL, InertialModel.of(ROBOT, replace(Sensors(), imu=imu))
    commands, readings = stack_columns(level.columns, COMMANDS, np.nan), stack_columns(level.columns, CHANNELS, np.nan)
    deviations = []
    for model in models:
        own = InertialFilter(model)
        for part in (slice(0, 80), slice(80, None)):
            own.run(commands[part], readings[part])
            deviations.append(math.sqrt(own.covariance[GRAVITY, GRAVITY]))
    at_rest, driven_off, still_at_rest, shaking = deviations
    assert still_at_rest == pytest.approx(at_rest, rel=0.01)
    assert shaking > 1.5 * driven_off


def test_no_other_filter_takes_a_push():
    with pytest.raises(InputError, match="only the inertial filter"):
        DeadReckoning(FilterModel.of(ROBOT, Sensors())).pushed((0.1, 0.0, 0.0))
