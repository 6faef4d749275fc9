"""Sizes of soils: drawn along the valley of the cost, and what they do under a wheel."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.answer.soil_at_work import NET_PULL, SINKAGE, TRACTION
from ddagr_gym.diagnosis.result.factor_sizes import (
    FORM,
    NARROWEST,
    WIDEST,
    Valley,
    factors,
    factors_of,
    in_logarithms,
    valleys,
)
from ddagr_gym.diagnosis.result.soil_at_work import (
    MOST_SLIP,
    NOMINAL,
    UNITS,
    soil_at_work,
    wheel_at,
    widened,
    working_point,
)
from ddagr_gym.diagnosis.result.uncertainty import along, intervals, resampled, resampled_parameters, with_structure
from ddagr_gym.identification.effect_parameters import effect_parameters
from ddagr_gym.identification.gauss_newton import fit, linearised
from ddagr_gym.physics.effects import parse_effect
from ddagr_gym.presets import get_robot, get_soil

TRUTH = parse_effect("soil_split=1.6,stiffness=2.0")


@pytest.fixture(scope="module")
def fitted(drive, problem_of):
    """Problem and fit of a drive over soil that differs from side to side."""
    problem = problem_of(drive(("soil_split=1.6,stiffness=2.0",), seconds=24.0))
    return problem, fit(problem, replace(problem.start(), effects=(TRUTH,)), iterations=6, renewals=2)


@pytest.fixture(scope="module")
def drawn(fitted):
    return resampled_parameters(*fitted, np.random.default_rng(1))


def test_derivatives_over_wide_steps_know_less(fitted):
    """Noise of the simulator in two nearly parallel columns passes for knowledge."""
    problem, found = fitted
    parameters = effect_parameters(found.point.effects)
    narrow = linearised(problem, found)
    wide = in_logarithms(problem, found, narrow, parameters)
    value = np.array([getattr(found.point.effects[0], item.field) for item in parameters])
    np.testing.assert_allclose(wide.here[-2:], np.log(value))
    # of a column by the logarithm each entry is the factor as large, but for noise and curvature
    ratio = np.sqrt((wide.sensitivity[..., -2:] ** 2).sum((0, 1)) / (narrow.sensitivity[..., -2:] ** 2).sum((0, 1)))
    np.testing.assert_allclose(ratio, value, rtol=0.25)
    np.testing.assert_array_equal(wide.sensitivity[..., :-2], narrow.sensitivity[..., :-2])
    np.testing.assert_array_equal(wide.residual, narrow.residual)


def test_the_valley_is_where_the_two_sizes_are_known_worst(fitted):
    problem, found = fitted
    parameters = effect_parameters(found.point.effects)
    linear = in_logarithms(problem, found, linearised(problem, found), parameters)
    (valley,) = valleys(problem, found, linear, parameters)
    assert valley.direction @ linear.information @ valley.direction == pytest.approx(1.0)
    covariance = np.linalg.inv(linear.information)[-2:, -2:]
    assert np.linalg.norm(valley.direction[-2:]) == pytest.approx(math.sqrt(np.linalg.eigvalsh(covariance)[-1]))
    assert NARROWEST <= valley.width <= WIDEST
    assert valley.form * np.linalg.norm(valley.direction[-2:]) == pytest.approx(FORM)


def test_draws_follow_a_valley(fitted):
    problem, found = fitted
    parameters = effect_parameters(found.point.effects)
    linear = in_logarithms(problem, found, linearised(problem, found), parameters)
    linear = replace(linear, low=np.full_like(linear.low, -1e3), high=np.full_like(linear.high, 1e3))
    draws = resampled(linear, np.random.default_rng(2))
    (valley,) = valleys(problem, found, linear, parameters)
    across = linear.information @ valley.direction
    flat = Valley(valley.direction, 0.3, 2.0, 0.0)
    moved = along(draws, linear, flat, np.random.default_rng(3))
    before, after = ((item - linear.here) @ across for item in (draws, moved))
    assert after.mean() == pytest.approx(0.3)
    assert after.std() == pytest.approx(2.0 * before.std())


def test_intervals_hold_the_truth_and_the_sizes_trade(fitted, drawn):
    found = fitted[1].point.effects[0]
    for name in ("strength", "stiffness"):
        low, high = with_structure(intervals(drawn.of(0, name)[:, None])[0], found, name)
        assert low < getattr(TRUTH, name) < high
        assert low < getattr(found, name) < high


def test_only_sizes_of_soils_are_factors():
    effects = (parse_effect("soil_patch=0.8"), parse_effect("gyro_scale=1.02"))
    parameters = effect_parameters(effects)
    chosen = factors(effects, parameters)
    assert [p.field for p, k in zip(parameters, chosen, strict=True) if k] == ["strength", "stiffness"]
    np.testing.assert_allclose(factors_of(np.where(chosen, 0.0, 5.0), chosen), np.where(chosen, 1.0, 5.0))


def test_what_the_soils_do_holds_the_truth(fitted, drawn):
    problem, found = fitted
    soil = soil_at_work(problem, get_soil("thesis_a1"), found, 0, drawn)
    assert (soil.first, soil.second) == ("under the left wheels", "under the right wheels")
    assert [item.name for item in soil.quantities] == list(UNITS)
    for item, (first, second) in zip(soil.quantities, _true(soil.point), strict=True):
        assert item.first_interval[0] < first < item.first_interval[1]
        assert item.second_interval[0] < second < item.second_interval[1]
        if item.name != NET_PULL:
            assert item.change_interval[0] < first / second - 1.0 < item.change_interval[1]
    traction = soil.quantities[0]
    assert traction.name == TRACTION
    assert traction.change > 0.0


def _true(point):
    """By quantity, on the left and on the right soil of the drive."""
    nominal = get_soil("thesis_a1")
    found = []
    for strength, stiffness in TRUTH.soils.values():
        soil = replace(
            nominal,
            cohesion=nominal.cohesion * strength,
            friction_angle=math.atan(math.tan(nominal.friction_angle) * strength),
            cohesive_modulus=nominal.cohesive_modulus * stiffness,
            frictional_modulus=nominal.frictional_modulus * stiffness,
        )
        found.append(wheel_at(get_robot("ddagr").wheels[0], soil, point))
    return np.array(found).T


def test_the_working_point_is_one_of_the_drive(fitted):
    problem, found = fitted
    point = working_point(problem, found)
    weight = get_robot("ddagr").mass * 9.81 / 4.0
    assert point.load == pytest.approx(weight, rel=0.1)
    assert 0.05 < point.slip < MOST_SLIP
    assert 0.0 < point.slip_angle < math.pi / 2.0
    assert 0.02 < point.speed < 0.4


def test_a_stiffer_soil_lets_a_wheel_sink_less(fitted):
    point = working_point(*fitted)
    soft, nominal = (wheel_at(get_robot("ddagr").wheels[0], soil, point) for soil in (_softer(), get_soil("thesis_a1")))
    sinkage = list(UNITS).index(SINKAGE)
    assert soft[sinkage] > 1.3 * nominal[sinkage]


def _softer():
    soil = get_soil("thesis_a1")
    return replace(soil, cohesive_modulus=0.5 * soil.cohesive_modulus, frictional_modulus=0.5 * soil.frictional_modulus)


def test_a_soil_that_is_the_same_all_along_is_held_against_the_nominal_one(fitted, drawn):
    problem, found = fitted
    change = parse_effect("soil_change=1.6,stiffness=2.0")
    same = replace(found, point=replace(found.point, effects=(change,)))
    soil = soil_at_work(problem, get_soil("thesis_a1"), same, 0, drawn)
    assert soil.second == NOMINAL
    point = soil.point
    for item, value in zip(
        soil.quantities, wheel_at(get_robot("ddagr").wheels[0], get_soil("thesis_a1"), point), strict=True
    ):
        assert item.second == pytest.approx(value)


def test_other_effects_have_no_soil(fitted, drawn):
    problem, found = fitted
    other = replace(found, point=replace(found.point, effects=(parse_effect("slope=0.02"),)))
    assert soil_at_work(problem, get_soil("thesis_a1"), other, 0, drawn) is None


def test_an_interval_is_widened_holds_its_value_and_stays_above_the_least():
    assert widened((1.0, 1.6), 1.3, 0.4, 0.0) == pytest.approx((0.8, 1.8))
    assert widened((0.1, 0.3), 0.2, 0.6, 0.0)[0] == 0.0
    assert widened((1.0, 1.2), 0.5, 0.0, 0.0)[0] == 0.5


def test_a_shape_that_nothing_shows_stays_where_it_is(drive, problem_of):
    """A bank's release shows with a loss below 1 only: the information about it is exactly zero."""
    deadband = parse_effect("command_deadband=0.1,loss=1.0,release=1.0")
    problem = problem_of(drive(("command_deadband=0.1",), seconds=12.0))
    found = fit(problem, replace(problem.start(), effects=(deadband,)), iterations=2, renewals=1)
    drawn = resampled_parameters(problem, found, np.random.default_rng(1))
    assert np.ptp(drawn.of(0, "release")) == 0.0
    assert np.isfinite(drawn.effects).all()
    assert np.median(drawn.of(0, "width")) == pytest.approx(0.1, abs=0.01)
