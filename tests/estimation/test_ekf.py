"""Predict and correct: update against an independent library, gates, consider update, standstill, missing samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.estimation import BatchFilter, Filter, FilterModel, FilterNoise, correct, layout, predict
from ddagr_gym.estimation.measurement_models import specific_force
from ddagr_gym.estimation.process_model import body_forces

NAN = np.nan
PARAMETERS = slice(5, 9)


@pytest.fixture
def plain(robot):
    """No de-weighting, no gate, no limits in reach: the textbook filter where the channel may teach everything."""
    noise = FilterNoise(accelerometer_deweighting=0.0, learning_deweighting=0.0)
    return FilterModel(robot, noise=noise, gate=1e6, excitation=0.0)


def uncorrelated(covariance):
    """The covariance with parameters uncorrelated to everything else."""
    result = covariance.copy()
    result[PARAMETERS, :5] = result[:5, PARAMETERS] = 0.0
    result[PARAMETERS, 9:] = result[9:, PARAMETERS] = 0.0
    return result


def mixed(covariance, rng):
    """A covariance of the same variances with correlations of up to about 0.5."""
    root = np.eye(12) + 0.15 * rng.standard_normal((12, 12))
    deviations = np.sqrt(np.diag(covariance))
    correlation = root @ root.T
    scale = 1.0 / np.sqrt(np.diag(correlation))
    return correlation * np.outer(scale * deviations, scale * deviations)


def test_linear_channels_against_filterpy(plain, turning_state, rng):
    kalman = pytest.importorskip("filterpy.kalman", reason="filterpy is a development dependency")
    state, covariance = turning_state
    prior = uncorrelated(mixed(covariance, rng))
    reading = np.array([NAN, NAN, 0.2130, 1.17, 0.061])
    ours = correct(plain, state, prior, reading)

    other = kalman.KalmanFilter(dim_x=12, dim_z=3)
    other.x, other.P = state.copy(), prior.copy()
    other.H = np.zeros((3, 12))
    other.H[0, [2, 9]] = other.H[1, 3] = other.H[2, 4] = 1.0
    other.R = np.diag(np.square([plain.noise.gyro, plain.noise.encoder, plain.noise.encoder]))
    other.update(reading[2:])
    np.testing.assert_allclose(ours.state, other.x, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(ours.covariance, other.P, rtol=1e-7, atol=1e-14)


def test_accelerometer_against_filterpy(plain, turning_state, load, rng):
    kalman = pytest.importorskip("filterpy.kalman", reason="filterpy is a development dependency")
    state, covariance = turning_state
    prior = mixed(covariance, rng)
    work = load(state)
    body_forces(plain.pack(), work)
    predicted = specific_force(plain.pack(), work, 0)
    row = work[layout.ROW : layout.ROW + 12].copy()
    ours = correct(plain, state, prior, [predicted + 0.05, NAN, NAN, NAN, NAN])

    other = kalman.KalmanFilter(dim_x=12, dim_z=1)
    other.x, other.P, other.H = state.copy(), prior.copy(), row[None]
    other.R = np.array([[plain.noise.accelerometer**2]])
    other.update(np.array([row @ state + 0.05]))
    np.testing.assert_allclose(ours.state, other.x, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(ours.covariance, other.P, rtol=1e-7, atol=1e-14)
    innovation_variance = row @ prior @ row + plain.noise.accelerometer**2
    assert ours.standardised[0] == pytest.approx(0.05 / np.sqrt(innovation_variance), rel=1e-9)


def test_functions_are_pure(model, turning_state):
    state, covariance = turning_state
    before = state.copy(), covariance.copy()
    predict(model, state, covariance, (1.0, 0.2))
    correct(model, state, covariance, [0.1, 0.1, 0.2, 1.1, 0.1])
    np.testing.assert_array_equal(state, before[0])
    np.testing.assert_array_equal(covariance, before[1])


def test_missing_samples_change_nothing(model, turning_state):
    state, covariance = turning_state
    result = correct(model, state, covariance, [NAN] * 5)
    np.testing.assert_array_equal(result.state, state)
    np.testing.assert_allclose(result.covariance, covariance, rtol=1e-12)
    assert np.isnan(result.standardised).all()


@pytest.mark.parametrize("value", [np.inf, -np.inf, 1e300])
def test_absurd_readings_are_missing_samples(model, turning_state, value):
    state, covariance = turning_state
    result = correct(model, state, covariance, [value] * 5)
    np.testing.assert_array_equal(result.state, state)
    assert np.isnan(result.standardised).all()


def test_gate_bounds_what_an_outlier_can_do(model, turning_state):
    state, covariance = turning_state

    def shift(error):
        reading = [NAN, NAN, state[2] + error, NAN, NAN]
        result = correct(model, state, covariance, reading)
        return result.state[2] - state[2], result

    at_gate, far = shift(5.0 * np.hypot(model.noise.gyro, 5e-3))[0], shift(3.0)
    assert far[0] == pytest.approx(at_gate, rel=0.05)
    assert far[0] != 0.0
    # the covariance shrinks less than by a good reading: the filter does not grow sure on outliers
    good = shift(0.0)[1]
    assert good.covariance[2, 2] < far[1].covariance[2, 2] < covariance[2, 2]


def test_filter_recovers_from_a_wrong_start(model):
    filter_ = Filter(model)
    filter_.reset(motion=[0.0, 0.0, 2.0, 0.0, 0.0])
    for _ in range(300):
        filter_.step([0.0, 0.0], [NAN, NAN, 0.0, 0.0, 0.0])
    assert abs(filter_.state[2]) < 5e-3


def test_straight_driving_teaches_no_soil(model, turning_state, rng):
    state, covariance = turning_state
    state[:5] = [0.19, 0.0, 0.0, 0.70, 0.70]
    prior = mixed(covariance, rng)
    result = correct(model, state, prior, [0.02, 0.0, 0.001, 0.71, 0.69])
    np.testing.assert_array_equal(result.state[PARAMETERS], state[PARAMETERS])
    np.testing.assert_allclose(result.covariance[PARAMETERS, PARAMETERS], prior[PARAMETERS, PARAMETERS], rtol=1e-12)
    # consider update: their correlation with the speeds is still carried
    assert not np.allclose(result.covariance[PARAMETERS, 2], prior[PARAMETERS, 2], rtol=1e-3)


def test_a_turn_teaches_soil_but_gyro_and_encoders_not_its_scale(model, turning_state):
    state, covariance = turning_state
    for _ in range(3):
        state, covariance = predict(model, state, covariance, (1.19, 0.05))
    result = correct(model, state, covariance, [NAN, NAN, state[2] + 0.002, 1.19, 0.05])
    change = (result.state - state)[PARAMETERS]
    assert change[0] == 0.0
    assert abs(change[1]) > 1e-6
    with_force = correct(model, state, covariance, [0.5, 0.2, NAN, NAN, NAN])
    assert with_force.state[5] != state[5]


def test_standstill_teaches_the_gyro_bias(model):
    filter_ = Filter(model)
    bias = 4e-3
    rng = np.random.default_rng(3)
    for _ in range(500):
        noise = model.noise.gyro * rng.standard_normal()
        filter_.step([0.0, 0.0], [NAN, NAN, bias + noise, 0.0, 0.0])
    assert filter_.state[9] == pytest.approx(bias, abs=1.5e-4)
    assert np.sqrt(filter_.covariance[9, 9]) < 1.5e-4
    assert abs(filter_.state[2]) < 2e-4


def test_a_commanded_robot_is_not_held_still(model):
    batch = BatchFilter(model)
    for _ in range(125):
        batch.step([[0.7, 0.7]], [[NAN, NAN, 0.0, 0.7, 0.7]])
    assert batch.states[0, 0] > 0.15


def test_missing_command_holds_the_bank_speed_with_doubt(model, turning_state):
    state, covariance = turning_state
    held = predict(model, state, covariance, (NAN, 0.05))
    np.testing.assert_allclose(held.state[3:5], state[3:5], rtol=1e-12)
    assert held.covariance[3, 3] > covariance[3, 3] + 0.9 * 0.008 * model.noise.unknown_command**2
    assert held.covariance[4, 4] < covariance[4, 4] + 1e-7


def test_long_gaps_are_bridged_in_short_steps(model, turning_state):
    state, covariance = turning_state
    at_once = predict(model, state, covariance, (1.19, 0.05), duration=0.2)
    for _ in range(20):
        state, covariance = predict(model, state, covariance, (1.19, 0.05), duration=0.01)
    np.testing.assert_allclose(at_once.state, state, rtol=1e-12)
    np.testing.assert_allclose(at_once.covariance, covariance, rtol=1e-6, atol=1e-12)


def test_uncertainty_grows_without_measurements(model, turning_state):
    state, covariance = turning_state
    later = predict(model, state, covariance, (1.19, 0.05), duration=10.0)
    assert (np.diag(later.covariance)[[5, 6, 7, 8, 9]] > np.diag(covariance)[[5, 6, 7, 8, 9]]).all()


def test_uncertain_motors_widen_transients_only(robot, turning_state):
    state, covariance = turning_state
    exact = replace(robot, standard_deviations={})
    sure = FilterModel(exact, motor_uncertainty=0.0)
    for unsure in (
        FilterModel(replace(robot, standard_deviations={"motor_rate": 1.0}), motor_uncertainty=0.0),
        FilterModel(exact, motor_uncertainty=0.25),
    ):
        compare(sure, unsure, state, covariance)


def compare(sure, unsure, state, covariance):
    settled = [predict(m, state, covariance, (1.19, 0.05)).covariance[3, 3] for m in (sure, unsure)]
    moving = [predict(m, state, covariance, (0.5, 0.05)).covariance[3, 3] for m in (sure, unsure)]
    assert settled[0] == pytest.approx(settled[1])
    assert moving[1] > 2.0 * moving[0]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m, x, p: predict(m, x[:5], p, (0.0, 0.0)), "give (12,) and (12, 12)"),
        (lambda m, x, p: predict(m, x, p, (0.0, 0.0), duration=0.0), "give a positive time"),
        (lambda m, x, p: correct(m, x, p, [0.0, 0.0]), "give (5,)"),
    ],
)
def test_errors_name_the_remedy(model, turning_state, call, message):
    with pytest.raises(InputError, match=message.replace("(", r"\(").replace(")", r"\)")):
        call(model, *turning_state)
