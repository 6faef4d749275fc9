"""Matched Monte Carlo: drives drawn from the filter's own model. A right filter is consistent with them."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.estimation import (
    BLOCKS,
    CHANNELS,
    FilterModel,
    FilterNoise,
    SoilPrior,
    channel_statistics,
    chi_square_band,
    draw_drive,
    normalised_estimation_error,
    run_filter,
)

RUNS = 100
FIRST = 12
"""The launch from rest, 0.1 s, is left out: friction is far from linear there."""

CHECKED = slice(24, None, 200)
"""Samples at which errors are averaged over runs, 1.6 s apart."""


def manoeuvre():
    """Commands (2750, 2): straight, sharp turn, straight, gentle turn the other way, straight."""
    t = np.arange(0.0, 22.0, 0.008)
    commands = np.full((t.size, 2), 0.701)
    commands[(t >= 4) & (t < 14)] = [0.1, 1.1]
    commands[(t >= 16) & (t < 20)] = [1.0, 0.4]
    return commands


def columns(commands, readings):
    named = dict(zip(CHANNELS, readings.T, strict=True))
    t = 0.008 * np.arange(1, len(commands) + 1)
    return named | {"t": t, "command_right": commands[:, 0], "command_left": commands[:, 1]}


class Study(NamedTuple):
    errors: dict[str, np.ndarray]  # (RUNS, checked times) NEES by block
    standardised: np.ndarray  # (RUNS, T, 5)


def monte_carlo(model, seed):
    rng, commands = np.random.default_rng(seed), manoeuvre()
    errors, standardised = {block: [] for block in BLOCKS}, []
    for _ in range(RUNS):
        states, readings = draw_drive(model, commands, rng)
        run = run_filter(model, columns(commands, readings))
        difference = states[CHECKED] - run.states[CHECKED]
        for block in BLOCKS:
            errors[block].append(normalised_estimation_error(difference, run.covariances[CHECKED], block))
        standardised.append(run.standardised[FIRST:])
    return Study({block: np.array(values) for block, values in errors.items()}, np.array(standardised))


def prior(deviation):
    return SoilPrior(
        traction_limit_deviation=deviation,
        traction_rate_deviation=deviation,
        coupling_deviation=min(deviation, 0.03),
        resistance_deviation=deviation,
    )


@pytest.fixture(scope="module")
def at_rest(robot):
    """The default filter on soils of which it knows the parameters to 15 %, from rest."""
    still = {"velocity_deviation": 0.0, "yaw_rate_deviation": 0.0, "bank_speed_deviation": 0.0}
    return FilterModel(robot, prior=prior(0.15), **still)


@pytest.fixture(scope="module")
def default_study(at_rest):
    return monte_carlo(at_rest, seed=7)


@pytest.fixture(scope="module")
def textbook_study(at_rest):
    """The same without de-weighting or consider update, on soils known to 5 %."""
    noise = FilterNoise(accelerometer_deweighting=0.0, learning_deweighting=0.0)
    plain = {"excitation": 0.0, "accelerometer_interval": 1, "motor_uncertainty": 0.0}
    textbook = replace(at_rest, prior=prior(0.05), noise=noise, **plain)
    return monte_carlo(textbook, seed=7)


@pytest.mark.parametrize("block", list(BLOCKS))
def test_errors_are_as_large_as_the_filter_says(default_study, block):
    degrees = BLOCKS[block].stop - BLOCKS[block].start
    means = default_study.errors[block].mean(axis=0)
    # 14 times are looked at: each with the probability that makes 99 % for all of them
    band = chi_square_band(degrees, RUNS, 0.99 ** (1 / means.size))
    assert band.contains(means).all(), (band, means)


@pytest.mark.parametrize("channel", range(5), ids=CHANNELS)
def test_innovations_are_as_large_as_the_filter_says(default_study, channel):
    # De-weighting correlates a run's innovations in time; runs are independent.
    nis = np.nanmean(default_study.standardised[:, :, channel] ** 2, axis=1)
    assert abs(nis.mean() - 1.0) < 3.0 * nis.std(ddof=1) / np.sqrt(RUNS)


@pytest.mark.parametrize("channel", range(5), ids=CHANNELS)
def test_textbook_innovations_are_white_and_in_band(textbook_study, channel):
    values = textbook_study.standardised[:, :, channel]
    band = chi_square_band(1, int(np.isfinite(values).sum()), 0.999)
    assert band.contains(np.nanmean(values**2)), band
    name = CHANNELS[channel]
    inside = []
    for run in textbook_study.standardised:
        statistics = channel_statistics(run, lags=20)[name]
        inside.append(np.mean(np.abs(statistics.correlation) < statistics.correlation_bound))
    # 95 % of 2000 autocorrelations; their own spread is half a percent
    assert np.mean(inside) == pytest.approx(0.95, abs=0.02)


def test_why_parameters_are_de_weighted(textbook_study, default_study):
    # Healthy innovations say nothing of the parameters: the textbook filter is sure of wrong ones.
    band = chi_square_band(4, RUNS, 0.999)
    assert textbook_study.errors["parameters"].mean(axis=0)[-1] > 1.5 * band.high
    assert band.contains(default_study.errors["parameters"].mean(axis=0)[-1])


def test_a_constant_straight_does_not_shrink_the_parameters_covariance(robot):
    # From steady motion, so that the launch teaches nothing either; 60 s.
    model = FilterModel(robot)
    rng = np.random.default_rng(5)
    commands = np.full((7500, 2), 0.701)
    state = model.initial()[0]
    state[[0, 3, 4]] = 0.19, 0.701, 0.701
    _, readings = draw_drive(model, commands, rng, state=state)
    run = run_filter(model, columns(commands, readings), motion=state[:5])
    initial = model.initial()[1][5:9, 5:9]
    # no combination of them: the smallest generalised eigenvalue against the prior stays at or above 1
    ratio = np.linalg.eigvals(np.linalg.solve(initial, run.covariances[-1, 5:9, 5:9])).real
    assert ratio.min() > 0.999


def test_a_turn_does_shrink_it(default_study, at_rest):
    rng, commands = np.random.default_rng(6), manoeuvre()
    _, readings = draw_drive(at_rest, commands, rng)
    run = run_filter(at_rest, columns(commands, readings))
    before, after = run.deviations[400, 5:9], run.deviations[1700, 5:9]
    assert after[1] < 0.8 * before[1]


def test_drawn_readings_have_the_noise_they_should(robot, rng):
    still = dict.fromkeys(("acceleration", "yaw_acceleration", "bank_speed", "soil"), 0.0)
    model = FilterModel(robot, noise=FilterNoise(accelerometer=0.05, gyro=2e-3, encoder=0.03, **still))
    commands = np.zeros((4000, 2))
    state = model.initial()[0]
    _, readings = draw_drive(model, commands, rng, state=state)
    deviations = readings.std(axis=0)
    np.testing.assert_allclose(deviations[:2], 0.05, rtol=0.05)
    np.testing.assert_allclose(deviations[2:], [2e-3, 0.03, 0.03], rtol=0.05)


def test_a_drive_repeats_with_its_seed(model):
    commands = manoeuvre()[:100]
    first = draw_drive(model, commands, np.random.default_rng(1))
    second = draw_drive(model, commands, np.random.default_rng(1))
    np.testing.assert_array_equal(first[0], second[0])
    np.testing.assert_array_equal(first[1], second[1])


def test_commands_of_a_wrong_shape(model, rng):
    with pytest.raises(InputError, match="give"):
        draw_drive(model, np.zeros(7), rng)
