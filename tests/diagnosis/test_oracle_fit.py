"""A model with given names, as the oracle of the concealed benchmark fits it."""

import pytest

from benchmarks.concealed_oracle import fit_named_effects
from ddagr_gym.diagnosis.gates.thresholds import Thresholds
from ddagr_gym.diagnosis.search.starting_models import StartingModels
from ddagr_gym.identification.gauss_newton import fit
from tests.diagnosis.conftest import Sloping, session_of


def test_an_oracle_fits_the_names_it_is_given_and_nothing_else(sloping: Sloping) -> None:
    problem = sloping.problem
    session = session_of(problem, sloping.recordings, Thresholds({}, {}, 20, "a test"))
    first = StartingModels(session, fit(problem, iterations=0), sloping.nominal)
    fitted = fit_named_effects(first, ["slope"])
    assert fitted is not None
    assert [effect.name for effect in fitted.point.effects] == ["slope"]
    assert fitted.cost == pytest.approx(sloping.chosen.cost, rel=0.02)
