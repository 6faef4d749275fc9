"""Derivatives by what sensors read too much, where effects of the sensors act on that as well."""

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.identification.block_means import sample_windows
from ddagr_gym.identification.gauss_newton import fit
from ddagr_gym.identification.nuisances import Nuisances
from ddagr_gym.identification.parameters import sensor_parameters
from ddagr_gym.identification.problem import Point, Problem
from ddagr_gym.identification.reading_effects import reading_gain
from ddagr_gym.identification.spells import Spell
from ddagr_gym.identification.windows import cut_windows
from ddagr_gym.physics.effects import load_effects

SIGMA = np.array([0.05, 0.05, 0.002, 0.01, 0.01, np.inf, np.inf, np.inf])
PRIORS = 0.01, 0.2
STEP = 0.01

EFFECTS = [
    "accelerometer_sign=1,flip_y=1", "gyro_sign=1", "gyro_scale=1.3", "imu_misalignment=1.57",
    "imu_tilt=0.3,pitch=-0.2", "imu_lever_arm=0.2", "gyro_bias=0.05",
]  # fmt: skip


@pytest.fixture(scope="module")
def problem(drive, robot, soil):
    windows = cut_windows([drive], 2.0, wheel_radius=robot.outer_radius, half_track=robot.half_track)
    return Problem(robot, soil, sample_windows(windows, SIGMA), Nuisances(sensor_parameters(1, *PRIORS)))


@pytest.mark.parametrize("given", EFFECTS)
def test_a_bias_goes_through_the_effects_of_its_sensor(problem, given):
    effects = load_effects(given)
    timed = problem.during({effects[0].name: Spell(0, float(problem.blocked.windows.time[4]))})
    point = replace(timed.start(), effects=effects)
    base = timed.predict(point)
    columns = timed.parameter_columns(point, base)
    for k in range(columns.shape[2]):
        moved = replace(point, values=point.values + STEP * np.eye(columns.shape[2])[k])
        changed = timed.blocked.change(timed.predict(moved), base) / STEP
        assert np.abs(changed).max() > 0.0
        np.testing.assert_allclose(columns[..., k], changed, atol=1e-6 * np.abs(changed).max())


def test_effects_that_remember_let_a_constant_through():
    (held,) = load_effects("sensor_hold=0.1,gyro=1")
    np.testing.assert_array_equal(reading_gain(held), np.eye(3))


def test_a_bias_is_found_beside_a_reversed_axis(problem, robot, soil):
    """Its derivative has the other sign there: with the usual one no step would lower the cost."""
    effects = load_effects("accelerometer_sign=1")
    values = np.array([0.0, 0.3, 0.0])
    windows = problem.blocked.windows
    truth = Point(values, windows.initial, effects)
    driven = replace(windows, measured=np.where(np.isfinite(windows.measured), problem.predict(truth), np.nan))
    known = Problem(robot, soil, sample_windows(driven, SIGMA), Nuisances(sensor_parameters(1, *PRIORS)))
    fitted = fit(known, replace(known.start(), effects=effects))
    np.testing.assert_allclose(fitted.point.values, values, atol=0.02)
