"""How sure refitted nuisances are: which belong to robot and soil, what their intervals hold, what goes together."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.diagnosis.answer.nuisance_spread import NuisanceSpread
from ddagr_gym.diagnosis.result.uncertainty import _correlation, nuisance_spread, resampled_parameters
from tests.diagnosis.conftest import Sloping

BIASES = ("gyro_bias", "accelerometer_bias_x", "accelerometer_bias_y")
OF_RECORDINGS = {"command_shift"} | {f"{name}_{number}" for name in BIASES for number in (1, 2)}


@pytest.fixture(scope="module", params=["nominal", "chosen"])
def made(request: pytest.FixtureRequest, sloping: Sloping) -> tuple[NuisanceSpread, dict[str, float], np.ndarray]:
    """Spread of a fit without and with an effect, its values, and draws of all nuisances."""
    problem, fitted = sloping.problem, getattr(sloping, request.param)
    draws = resampled_parameters(problem, fitted, np.random.default_rng(0))
    values = {
        p.name: float(value)
        for p, value in zip(problem.nuisances.parameters, fitted.point.values, strict=True)
        if p.prior > 0.0
    }
    return nuisance_spread(problem, fitted, draws), values, draws.nuisances


def test_every_refitted_value_has_an_interval_that_holds_it(made):
    spread, values, draws = made
    assert list(spread.intervals) == list(values)
    assert all(low <= values[name] <= high for name, (low, high) in spread.intervals.items())
    place = list(values).index("mass")
    assert spread.intervals["mass"] == pytest.approx(np.quantile(draws[:, place], [0.05, 0.95]), abs=1e-3)
    assert spread.intervals["mass"][0] < spread.intervals["mass"][1]


def test_robot_and_soil_are_told_from_recordings(made):
    spread, values, _ = made
    assert {"soil_strength", "friction", "mass"} <= set(spread.shared)
    assert set(values) - set(spread.shared) == OF_RECORDINGS


def test_what_goes_together_is_kept(made):
    spread, values, draws = made
    matrix = np.array(spread.correlation)
    places = [list(values).index(name) for name in spread.shared]
    np.testing.assert_allclose(matrix, np.corrcoef(draws[:, places].T), atol=1e-4)
    assert np.abs(matrix - np.eye(len(matrix))).max() > 0.3


def test_what_nothing_moves_goes_with_nothing():
    draws = np.array([[1.0, 2.0, 5.0], [2.0, 4.0, 5.0], [3.0, 6.0, 5.0]])
    assert _correlation(draws) == ((1.0, 1.0, 0.0), (1.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    assert _correlation(np.zeros((3, 0))) == ()
