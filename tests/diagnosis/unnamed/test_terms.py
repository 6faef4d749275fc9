"""Equations for what has no name: on drives of the simulator with a push that no effect of the library makes."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ddagr_gym.diagnosis.localisation.residual_wrench import HeldWrench
from ddagr_gym.diagnosis.result.files import plain
from ddagr_gym.diagnosis.unnamed.boosted_baseline import concentration_of
from ddagr_gym.diagnosis.unnamed.regressors import TARGETS, library, motion_of
from ddagr_gym.diagnosis.unnamed.response import INPUTS, course_of, linearise
from ddagr_gym.diagnosis.unnamed.terms import find_terms, stretches
from ddagr_gym.identification.gauss_newton import fit

PUSH = 60.0
"""[N] to the left: a third of the robot's rolling resistance and more."""


@pytest.fixture(scope="module")
def nominal(drive, problem_of):
    problem = problem_of(drive())
    return problem, fit(problem, iterations=2)


@pytest.fixture(scope="module")
def pushed(drive, problem_of):
    push = (HeldWrench(0.0, PUSH, 0.0),)
    problem = problem_of(drive(push, seed=5), drive(push, seed=6, yaw=2.0))
    return problem, fit(problem, iterations=2)


def scanned(fitted):
    return SimpleNamespace(fitted=fitted)


@pytest.mark.parametrize("target", ["F_y", "M_z"])
def test_linear_response_agrees_with_a_simulation(nominal, target: str) -> None:
    problem, fitted = nominal
    response = linearise(problem, fitted, course_of(problem, fitted))
    size = 5.0
    push = HeldWrench(**{"F_y": {"force_y": size}, "M_z": {"moment": size}}[target])
    change = problem.predict(replace(fitted.point, effects=(push,))) - fitted.prediction
    exact = problem.blocked.means(change).reshape(problem.blocked.sigma.shape)
    shape = problem.blocked.sigma.shape
    linear = response.to(target, np.full((*shape[:2], 1), size))[..., 0] / problem.blocked.sigma
    # poses of whole windows: chained blocks add up to the simulated path
    error, size_ = (exact - linear)[..., 5:], exact[..., 5:]
    assert np.sqrt((error**2).mean() / (size_**2).mean()) < 0.15
    assert set(INPUTS) <= set(TARGETS)


def test_a_push_is_found_with_its_size_unit_and_interval(pushed) -> None:
    problem, fitted = pushed
    found = find_terms(problem, scanned(fitted), np.random.default_rng(1))
    term = next(item for item in found.terms if item.target == "F_y")
    assert (term.regressor, term.unit) == ("1", "N")
    # the nominal refit has bent the soil towards it before: what is left is a little less
    assert 0.7 * PUSH < term.coefficient < 1.2 * PUSH
    assert term.interval[0] < term.coefficient < term.interval[1]
    assert 0.0 < found.equation_share <= found.ceiling_share < 1.0
    assert found.equation.startswith(f"F_y = {term.coefficient:.3g} [")
    mapping = plain(found)
    assert set(mapping) == {"equation", "terms", "equation_share", "ceiling_share", "where"}
    assert mapping["terms"][0]["interval"] == list(found.terms[0].interval)


def test_nothing_is_found_where_nothing_is_missing(nominal) -> None:
    problem, fitted = nominal
    blocked = problem.blocked
    length, blocks = blocked.weights.shape[2], blocked.sigma.shape[1]
    rng = np.random.default_rng(2)
    noise = np.where(np.isfinite(blocked.sigma), blocked.sigma, 0.0) * rng.standard_normal(blocked.sigma.shape)
    measured = fitted.prediction.copy()
    measured[:, : blocks * length] += np.repeat(noise, length, axis=1)
    measured = np.where(np.isfinite(blocked.windows.measured), measured, np.nan)
    white = problem.on(replace(blocked, windows=replace(blocked.windows, measured=measured)))
    found = find_terms(white, scanned(fitted), rng)
    assert found.terms == ()
    assert found.equation == ""
    assert found.ceiling_share < 0.05


def test_stretches_keep_recordings_apart_and_are_enough(drive, problem_of) -> None:
    problem = problem_of(drive(seconds=12.0), drive(seconds=12.0, seed=2))
    group = stretches(problem)
    assert len(np.unique(group)) == 10
    recording = problem.blocked.windows.recording
    assert all(len(set(recording[group == g])) == 1 for g in np.unique(group))


def test_every_term_of_the_library_has_a_finite_signal_and_a_unit(nominal) -> None:
    problem, fitted = nominal
    motion = motion_of(problem, course_of(problem, fitted))
    terms = library(problem, motion)
    assert {term.target for term in terms} == set(TARGETS)
    for term in terms:
        assert np.isfinite(np.broadcast_to(term.signal.values, motion["t"].values.shape)).all(), term.signal.name
        assert (term.unit * term.signal.unit).dimension == TARGETS[term.target].dimension
    assert len({(term.target, term.signal.name) for term in terms}) == len(terms)


def test_regime_in_words(nominal) -> None:
    problem, fitted = nominal
    motion = motion_of(problem, course_of(problem, fitted))
    recording = problem.blocked.windows.recording
    turning = motion["r"].values > 0.05
    regime = concentration_of(turning.astype(float), motion, recording)
    assert regime.words.startswith("turning left: 100 % of it")
    assert concentration_of(np.ones(turning.shape), motion, recording).words == "everywhere"
