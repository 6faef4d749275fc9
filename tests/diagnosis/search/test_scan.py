"""Refit and scan on drives of the simulator itself: sensitivities, names, sizes."""

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.result.uncertainty import intervals, resampled_parameters
from ddagr_gym.diagnosis.search.gains import gains, held_out_gains
from ddagr_gym.diagnosis.search.initial_guess import first_guess
from ddagr_gym.diagnosis.search.scan import scan
from ddagr_gym.identification.gauss_newton import fit
from ddagr_gym.identification.misfit import channel_misfit
from ddagr_gym.physics.effects.registry import effect_kinds, parse_effect

FEW = ("gyro_scale", "slope", "motor_lag", "towed_drag", "encoder_scale")


@pytest.fixture(scope="module")
def few() -> dict:
    return {name: effect_kinds()[name] for name in FEW}


def test_elimination_takes_away_what_the_unknowns_explain(drive, problem_of) -> None:
    problem = problem_of(drive(seconds=6.0))
    point = problem.start()
    base, reference = problem.predict(point), problem.reference(point)
    by_parameter = problem.parameter_columns(point, base, reference)
    elimination = problem.eliminate(point, base, by_parameter, reference)
    states = point.states.copy()
    states[:, 3] += 1e-3
    moved = replace(point, states=states)
    # what is left of a change of the initial speed is what its prior alone resists; simulated anew, a little more
    followed = problem.blocked.means(problem.varied(moved, reference) - reference.prediction)
    anew = problem.blocked.means(problem.predict(moved) - base)
    for changed, share in ((followed, 0.02), (anew, 0.03)):
        column = problem.padded(changed[..., None])
        assert np.linalg.norm(elimination.project(column)) < share * np.linalg.norm(column)
    residual = elimination.project(problem.residual(point, base)[..., None])
    assert np.abs(np.matmul(elimination.basis.transpose(0, 2, 1), residual)).max() < 1e-8


@pytest.mark.slow
def test_a_drive_with_nothing_missing_is_explained(drive, problem_of, few) -> None:
    problem = problem_of(drive())
    fitted = fit(problem)
    assert all(value < 1.3 for value in channel_misfit(problem, fitted).values())
    terms = scan(problem, fitted, few)
    assert max(item.gain for item in gains(terms)) < 6.0


@pytest.mark.slow
@pytest.mark.parametrize("text", ["slope=0.05", "towed_drag=120"])
def test_an_effect_is_named(drive, problem_of, few, text: str) -> None:
    truth = parse_effect(text)
    problem = problem_of(drive((text,)))
    terms = scan(problem, fit(problem), few)
    found = gains(terms)
    assert found[0].name == truth.name
    assert held_out_gains(terms)[truth.name] > 0.0
    guess = first_guess(terms.candidates[found[0].candidate], found[0].multiples)
    size = truth.size_names()[0]
    # the scan is linear at a bent nominal model and shrinks towards none: it may fall short, never go beyond
    assert 0.3 * getattr(truth, size) < abs(getattr(guess, size)) < 1.3 * getattr(truth, size)


@pytest.mark.slow
def test_joint_refit_recovers_the_size_with_an_interval_that_holds_it(drive, problem_of) -> None:
    problem = problem_of(drive(("gyro_scale=1.05",), seconds=14.0))
    raw = fit(problem, iterations=0)
    start = replace(raw.point, effects=(parse_effect("gyro_scale=1.02"),))
    refitted = fit(problem, start, iterations=5, reuse=raw)
    assert refitted.cost < raw.cost - 20.0
    scale = refitted.point.effects[0].scale
    assert scale == pytest.approx(1.05, abs=0.012)
    draws = resampled_parameters(problem, refitted, np.random.default_rng(2))
    low, high = intervals(draws.effects)[0]
    assert low < scale < high
    assert 1e-4 < high - low < 0.06
