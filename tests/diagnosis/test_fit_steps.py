"""What one step of a fit simulates, and what it keeps of it."""

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.identification import gauss_newton as refit
from ddagr_gym.identification.gauss_newton import DAMPING, cost_of, fit
from ddagr_gym.identification.problem import Point, Problem
from tests.diagnosis.conftest import Sloping


def spoilt(point: Point) -> Point:
    """Every other window begins turned, sideways and too fast."""
    states = point.states.copy()
    states[::2, :3] += (1.0, 0.5, 1.5)
    return replace(point, states=states)


def window_costs(sloping: Sloping, point: Point) -> np.ndarray:
    return cost_of(sloping.problem, point, sloping.problem.predict(point), sloping.nominal.elimination)[1]


def test_windows_that_a_step_makes_worse_keep_their_states(sloping: Sloping) -> None:
    problem, before = sloping.problem, sloping.nominal.point
    trial = spoilt(before)
    costs = window_costs(sloping, before)
    worse = window_costs(sloping, trial) > costs
    assert worse.any()
    assert not worse[1::2].any()
    taken, prediction, total = refit._best_by_window(problem, trial, before, sloping.nominal.elimination, costs)
    np.testing.assert_array_equal(taken.states, np.where(worse[:, None], before.states, trial.states))
    np.testing.assert_allclose(prediction, problem.predict(taken), rtol=0.0, atol=1e-12)
    assert total == pytest.approx(cost_of(problem, taken, prediction, sloping.nominal.elimination)[0], rel=1e-12)


def test_windows_that_a_step_improves_take_its_states(sloping: Sloping) -> None:
    before, trial = spoilt(sloping.nominal.point), sloping.nominal.point
    costs = window_costs(sloping, before)
    better = window_costs(sloping, trial) <= costs
    assert better.any()
    taken, _, _ = refit._best_by_window(sloping.problem, trial, before, sloping.nominal.elimination, costs)
    np.testing.assert_array_equal(taken.states[better], trial.states[better])


def test_only_doubtful_windows_are_simulated_again(sloping: Sloping, monkeypatch: pytest.MonkeyPatch) -> None:
    before = sloping.nominal.point
    costs = window_costs(sloping, before)
    worse = int((window_costs(sloping, spoilt(before)) > costs).sum())
    simulated: list[int] = []
    predict = Problem.predict

    def counted(self: Problem, point: Point) -> np.ndarray:
        simulated.append(len(point.states))
        return predict(self, point)

    monkeypatch.setattr(Problem, "predict", counted)
    refit._best_by_window(sloping.problem, spoilt(before), before, sloping.nominal.elimination, costs)
    assert simulated == [len(costs), worse]


def test_a_step_that_promises_nothing_is_tried_once(sloping: Sloping, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the whole step fails, shares of it that promise less than the tolerance are not simulated."""
    trials: list[Point] = []

    def failed(problem: Problem, trial: Point, *rest: object) -> tuple[Point, np.ndarray, float]:
        trials.append(trial)
        return trial, problem.predict(trial), np.inf

    monkeypatch.setattr(refit, "_best_by_window", failed)
    for tolerance, expected in ((1e3, 1), (0.0, len(DAMPING))):
        trials.clear()
        left = fit(sloping.problem, sloping.nominal.point, first=sloping.nominal, iterations=1, tolerance=tolerance)
        assert len(trials) == expected
        np.testing.assert_array_equal(left.point.values, sloping.nominal.point.values)
