from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.identification.fit_numerics import field_numerics
from ddagr_gym.identification.parameters import robot_parameters, soil_parameters
from ddagr_gym.identification.window_fit import Refitter, _bounded_step, project, weighted, with_prior
from ddagr_gym.identification.window_model import WindowModel
from ddagr_gym.identification.windows import CHANNELS, cut_windows
from ddagr_gym.parameters import Imu, PoseReceiver, Sensors
from ddagr_gym.recordings.schema import RobotGeometry

STRENGTH, MOTOR_RATE = 0.8, 0.85
"""Of the fixture's drive, over the presets'."""
SIGMA = np.array([np.inf, np.inf, 0.002, 0.01, 0.01, 0.012, 0.012, 0.008])


@pytest.fixture(scope="module")
def model(make_drive, robot, soil):
    """Soil and motor to be found from eight windows of arcs."""
    sensors = Sensors(imu=Imu(sample_rate=50.0, gyro_noise=0.002, accelerometer_noise=0.05), pose=PoseReceiver(5.0))
    geometry = RobotGeometry.of(robot)
    windows = cut_windows(
        [make_drive(("arcs",), sensors)], 2.0, wheel_radius=geometry.wheel_radius, half_track=geometry.half_track
    )
    chosen = [
        p for p in (*soil_parameters(soil), *robot_parameters(robot)) if p.name in ("soil_strength", "motor_rate")
    ]
    return WindowModel(robot, soil, windows.subset(np.arange(1, 17, 2)), chosen, numerics=field_numerics())


def test_projection_removes_what_the_states_explain():
    rng = np.random.default_rng(0)
    by_state, mask = rng.normal(size=(3, 30, 8)), np.ones((3, 30))
    left = with_prior(by_state, mask)
    rows = rng.normal(size=(3, 38, 2))
    projected, change = project(rows, left)
    np.testing.assert_allclose(np.einsum("wms,wmk->wsk", left, projected), 0.0, atol=1e-9)
    np.testing.assert_allclose(projected + np.einsum("wms,wsk->wmk", left, change), rows)


def test_the_step_stays_in_its_bounds_and_is_the_best_there():
    from scipy.optimize import minimize

    rng = np.random.default_rng(1)
    root = rng.normal(size=(4, 4))
    information, gradient = root @ root.T + np.eye(4), 5.0 * rng.normal(size=4)
    low, high = np.array([-0.1, -9.0, -9.0, -0.05]), np.array([0.2, 9.0, 9.0, 0.3])
    step = _bounded_step(information, gradient, low, high)
    best = minimize(
        lambda x: 0.5 * x @ information @ x - gradient @ x, np.zeros(4), bounds=list(zip(low, high, strict=True))
    )
    assert ((step >= low) & (step <= high)).all()
    assert 0.5 * step @ information @ step - gradient @ step <= 0.95 * best.fun


def test_headings_are_compared_on_the_circle():
    measured, prediction = np.zeros((1, 1, 8)), np.zeros((1, 1, 8))
    measured[..., 7], prediction[..., 7] = np.pi - 0.1, -np.pi + 0.1
    assert weighted(measured, prediction, np.ones(8))[0, 0, 7] == pytest.approx(-0.2)


def test_the_known_soil_and_motor_are_found(model):
    fit = Refitter(model, SIGMA, robust=2.0).fit()
    assert fit.converged
    found = dict(zip((p.name for p in model.parameters), fit.values, strict=True))
    spread = dict(zip((p.name for p in model.parameters), fit.window_deviations, strict=True))
    assert found["motor_rate"] == pytest.approx(np.log(MOTOR_RATE), abs=max(3.0 * spread["motor_rate"], 0.01))
    assert found["soil_strength"] == pytest.approx(np.log(STRENGTH), abs=max(3.0 * spread["soil_strength"], 0.02))
    assert fit.at_bound == ()
    assert fit.cost < Refitter(model, SIGMA, robust=2.0)._cost(np.zeros(2), model.windows.initial)[0]


def test_wrong_initial_states_are_found_again(model):
    truth = np.log([STRENGTH, MOTOR_RATE])
    refitter = Refitter(model, SIGMA)
    states, prediction = refitter.fit_states(truth, iterations=4)
    disturbed = states.copy()
    disturbed[:, 5] += 0.05
    again, other = refitter.fit_states(truth, disturbed, iterations=4)
    np.testing.assert_allclose(again[:, 5], states[:, 5], atol=0.01)
    gyro = CHANNELS.index("yaw_rate")
    assert np.abs(prediction - other)[..., gyro].max() < 0.01


def test_a_step_never_raises_the_cost_of_a_window(model):
    refitter = Refitter(model, SIGMA)
    nominal = np.zeros(2)
    before = refitter._window_costs(model.windows.initial, model.predict(nominal, model.windows.initial))
    after = refitter._window_costs(*refitter.fit_states(nominal))
    assert (after <= before + 1e-9).all()


def test_a_channel_without_weight_says_nothing(model):
    sigma = SIGMA.copy()
    sigma[CHANNELS.index("yaw_rate")] = np.inf
    refitter = Refitter(model, sigma)
    prediction = model.predict(np.zeros(2), model.windows.initial)
    residual, _, _, mask = refitter.linearise(np.zeros(2), model.windows.initial, prediction)
    shape = model.windows.measured.shape
    assert mask.reshape(shape)[..., CHANNELS.index("yaw_rate")].max() == 0.0
    assert np.abs(residual.reshape(shape)[..., CHANNELS.index("specific_force_x")]).max() == 0.0


def test_the_robust_cost_grows_linearly(model):
    plain, robust = Refitter(model, SIGMA), Refitter(model, SIGMA, robust=2.0)
    prediction = model.predict(np.zeros(2), model.windows.initial)
    far, farther = prediction.copy(), prediction.copy()
    gyro = CHANNELS.index("yaw_rate")
    far[0, 0, gyro] += 1.0
    farther[0, 0, gyro] += 2.0
    steps = [r._window_costs(model.windows.initial, p)[0] for r in (plain, robust) for p in (far, farther)]
    base = [r._window_costs(model.windows.initial, prediction)[0] for r in (plain, robust)]
    assert (steps[1] - base[0]) / (steps[0] - base[0]) == pytest.approx(4.0, rel=0.05)
    assert (steps[3] - base[1]) / (steps[2] - base[1]) == pytest.approx(2.0, rel=0.05)
