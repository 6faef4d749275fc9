"""The filter over batches, single robots and recordings; robustness."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.estimation import (
    CHANNELS,
    BatchFilter,
    Filter,
    FilterModel,
    ForceLaw,
    draw_drive,
    layout,
    predict,
    roll_out,
    run_filter,
)
from ddagr_gym.presets import get_robot

NAN = np.nan


def drive(model, rng, samples=400):
    commands = np.full((samples, 2), 0.7)
    commands[samples // 2 :] = [1.1, 0.2]
    _, readings = draw_drive(model, commands, rng)
    readings[rng.random(readings.shape) < 0.05] = NAN
    return commands, readings


PERIOD = 1.0 / 128.0
"""Times of a recording are then exact, and so are their differences."""


def columns(commands, readings):
    named = dict(zip(CHANNELS, readings.T, strict=True))
    t = 10.0 + PERIOD * np.arange(1, len(commands) + 1)
    return named | {"t": t, "command_right": commands[:, 0], "command_left": commands[:, 1]}


@pytest.mark.parametrize("law", list(ForceLaw))
def test_single_batch_and_recording_agree_to_the_bit(robot, rng, law):
    model = FilterModel(robot, law=law, sample_period=PERIOD)
    drives = [drive(model, rng) for _ in range(3)]
    batch = BatchFilter(model, 3)
    commands = np.stack([c for c, _ in drives])
    readings = np.stack([z for _, z in drives])
    in_batch = np.concatenate(
        [batch.step(commands[:, k : k + 40], readings[:, k : k + 40]) for k in range(0, 400, 40)], 1
    )
    for n, (command, reading) in enumerate(drives):
        one = Filter(model)
        innovations = np.array([one.step(c, z) for c, z in zip(command, reading, strict=True)])
        np.testing.assert_array_equal(one.state, batch.states[n])
        np.testing.assert_array_equal(one.covariance, batch.covariances[n])
        np.testing.assert_array_equal(innovations, in_batch[n])
        run = run_filter(model, columns(command, reading))
        np.testing.assert_array_equal(run.states[-1], one.state)
        np.testing.assert_array_equal(run.covariances[-1], one.covariance)
        np.testing.assert_array_equal(run.standardised, innovations)


def test_one_command_is_held_over_all_samples(model, rng):
    _, readings = drive(model, rng, 20)
    held, each = BatchFilter(model), BatchFilter(model)
    held.step([[0.7, 0.6]], readings[None])
    each.step(np.tile([0.7, 0.6], (1, 20, 1)), readings[None])
    np.testing.assert_array_equal(held.states, each.states)


def test_reset_of_some_robots(model, rng):
    commands, readings = drive(model, rng, 50)
    batch = BatchFilter(model, 4)
    batch.step(np.tile(commands, (4, 1, 1)), np.tile(readings, (4, 1, 1)))
    kept = batch.states[[0, 2]].copy()
    batch.reset(np.array([False, True, False, True]), motion=[[0.1, 0, 0, 0.4, 0.4], [0.2, 0, 0, 0.7, 0.7]])
    np.testing.assert_array_equal(batch.states[[0, 2]], kept)
    np.testing.assert_array_equal(batch.states[[1, 3], 0], [0.1, 0.2])
    np.testing.assert_array_equal(batch.covariances[1], model.initial()[1])
    fresh = BatchFilter(model)
    fresh.reset(motion=[[0.1, 0, 0, 0.4, 0.4]])
    again = np.tile(readings, (4, 1, 1))
    batch.step(np.tile(commands, (4, 1, 1)), again)
    fresh.step(commands[None], readings[None])
    np.testing.assert_array_equal(batch.states[1], fresh.states[0])


def test_accelerometer_is_used_at_its_interval(robot, rng):
    model = FilterModel(robot, accelerometer_interval=4)
    commands, readings = drive(model, rng, 40)
    readings[:] = np.nan_to_num(readings)
    standardised = BatchFilter(model).step(commands[None], readings[None])[0]
    used = np.isfinite(standardised[:, 0])
    np.testing.assert_array_equal(np.flatnonzero(used), np.arange(3, 40, 4))


def test_missing_columns_and_attitude(model, rng):
    commands, readings = drive(model, rng, 200)
    full = columns(commands, readings)
    without = {name: full[name] for name in ("t", "yaw_rate", "encoder_right", "encoder_left")}
    run = run_filter(model, without)
    assert np.isfinite(run.states).all()
    assert np.isnan(run.standardised[:, :2]).all()
    level = run_filter(model, full | {"roll": np.zeros(200), "pitch": np.full(200, NAN)})
    np.testing.assert_array_equal(level.states, run_filter(model, full).states)
    tilted = run_filter(model, full | {"pitch": np.full(200, 0.05)})
    assert tilted.states[-1, 0] > level.states[-1, 0]


def test_mirrored_drives_have_mirrored_estimates(model, rng):
    commands, readings = drive(model, rng)
    right, left = BatchFilter(model), BatchFilter(model)
    right.step(commands[None], readings[None])
    left.step(commands[None, :, ::-1], (readings * [1, -1, -1, 1, 1])[None][:, :, [0, 1, 2, 4, 3]])
    sign = np.array([1, -1, -1, 1, 1, 1, 1, 1, 1, -1, 1, -1])
    order = [0, 1, 2, 4, 3, 5, 6, 7, 8, 9, 10, 11]
    deviations = [np.sqrt(np.diag(b.covariances[0])) for b in (left, right)]
    # the right encoder is used before the left one, and de-weighted corrections do not commute to the last digit
    difference = np.abs(left.states[0] - (right.states[0] * sign)[order])
    assert (difference < 1e-3 * deviations[0]).all()
    np.testing.assert_allclose(deviations[0], deviations[1][order], rtol=1e-3)


def test_rolling_out_is_predicting(model, turning_state):
    state, covariance = turning_state
    rolled = roll_out(model, state, np.tile([1.1, 0.2], (30, 1)), attitude=(0.01, -0.02))
    for _ in range(30):
        state, covariance = predict(model, state, covariance, (1.1, 0.2), attitude=(0.01, -0.02))
    np.testing.assert_allclose(rolled[-1], state, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: BatchFilter(m, 0), "at least one robot"),
        (lambda m: BatchFilter(m, 2).step([[0.0, 0.0]], np.zeros((2, 5))), "commands have shape"),
        (lambda m: BatchFilter(m, 2).step(np.zeros((2, 2)), np.zeros((2, 4))), "readings have shape"),
        (lambda m: BatchFilter(m, 1).step(np.zeros((1, 3, 2)), np.zeros((1, 5, 5))), "give as many, or 1"),
        (lambda m: BatchFilter(m, 1).step(np.zeros((1, 2)), np.zeros((1, 5)), duration=-1.0), "positive time"),
        (lambda m: BatchFilter(m, 2).reset([0], motion=[[NAN] * 5]), "finite values"),
        (lambda m: run_filter(m, {"yaw_rate": [0.0]}), "time column t"),
        (lambda m: run_filter(m, {"t": [0.0, 0.0], "yaw_rate": [0.0, 0.0]}), "increases"),
        (lambda m: run_filter(m, {"t": [0.0, 0.1]}), "nothing to correct by"),
        (lambda m: run_filter(m, {"t": [0.0, 0.1], "yaw_rate": [0.0]}), "one length"),
        (lambda m: roll_out(m, np.zeros(12), np.zeros(4)), r"give \(12,\) and"),
    ],
)
def test_errors_name_the_remedy(model, call, message):
    with pytest.raises(InputError, match=message):
        call(model)


def abuse(rng, count, limit, commands):
    """Readings (count, 20, 5) with stalls, reversals, saturation, stuck and dropped samples and nonsense."""
    readings = np.empty((count, 20, 5))
    spread = rng.choice([0.03, 1.0, 20.0], size=(count, 1, 1))
    readings[..., :2] = rng.standard_normal((count, 20, 2)) * spread
    gyro = rng.choice([1e-3, 0.1, 5.0], size=(count, 1)) * rng.standard_normal((count, 20))
    readings[..., 2] = np.clip(gyro + rng.choice([0.0, 0.2, -4.36], size=(count, 1)), -4.36, 4.36)
    turned = commands[:, None, :] * rng.choice([1.0, 1.0, 0.0, -1.0], size=(count, 1, 2))
    readings[..., 3:] = turned + rng.standard_normal((count, 20, 2)) * rng.choice(
        [0.0, 0.02, limit], size=(count, 1, 1)
    )
    readings = np.where(rng.random((count, 1, 5)) < 0.1, readings[:, :1], readings)
    readings[rng.random(readings.shape) < 0.1] = NAN
    readings = np.where(rng.random((count, 1, 5)) < 0.03, np.inf, readings)
    return np.where(rng.random((count, 1, 5)) < 0.01, 1e300, readings)


def fuzz(model, steps, seed, count=50):
    rng = np.random.default_rng(seed)
    batch, limit = BatchFilter(model, count), model.robot.maximum_wheel_speed
    commands = np.zeros((count, 2))
    for _ in range(steps // (20 * count)):
        changed = rng.random(count) < 0.5
        levels = rng.choice([0.0, 1.0, -1.0, 0.05, 0.5, 1e-6], size=(count, 2)) * limit
        commands[changed] = levels[changed]
        given = np.where(rng.random((count, 2)) < 0.02, NAN, commands)
        attitude = 0.3 * rng.standard_normal((count, 2)) if rng.random() < 0.3 else None
        duration = float(rng.choice([0.008, 0.008, 0.001, 0.05, 0.3]))
        batch.step(given, abuse(rng, count, limit, commands), attitude, duration=duration)
        check_health(batch)
        if rng.random() < 0.05:
            batch.reset(rng.random(count) < 0.1)


def check_health(batch):
    assert np.isfinite(batch.states).all()
    assert np.isfinite(batch.covariances).all()
    assert np.array_equal(batch.covariances, batch.covariances.swapaxes(1, 2))
    deviations = np.sqrt(np.diagonal(batch.covariances, axis1=1, axis2=2))
    correlations = batch.covariances / (deviations[:, :, None] * deviations[:, None, :])
    assert np.linalg.eigvalsh(correlations).min() > 1e-12
    packed = batch.model.pack()
    assert (batch.states >= packed[layout.LOW : layout.LOW + 12]).all()
    assert (batch.states <= packed[layout.HIGH : layout.HIGH + 12]).all()


@pytest.mark.parametrize(("law", "robot_name"), [("coupled", "ddagr"), ("thesis", "ddagr"), ("coupled", "husky")])
def test_survives_50_thousand_steps_of_abuse(law, robot_name):
    fuzz(FilterModel(get_robot(robot_name), law=ForceLaw[law], accelerometer_interval=3), 50_000, seed=1)


@pytest.mark.slow
def test_survives_a_million_steps_of_abuse(robot):
    fuzz(FilterModel(robot, accelerometer_interval=3), 1_000_000, seed=2)


def test_a_run_goes_on_from_a_state(model):
    t = 0.008 * np.arange(1, 401)
    columns = {"t": t, "command_right": np.full(400, 0.9), "command_left": np.full(400, 0.5), "yaw_rate": 0.1 * t}
    whole = run_filter(model, columns)
    later = {name: values[200:] for name, values in columns.items()}
    resumed = run_filter(model, later, start=(whole.states[199], whole.covariances[199]))
    np.testing.assert_allclose(resumed.states, whole.states[200:], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(resumed.covariances, whole.covariances[200:], rtol=1e-9, atol=1e-15)
    with pytest.raises(InputError, match="both given"):
        run_filter(model, columns, motion=np.zeros(5), start=(whole.states[0], whole.covariances[0]))
