"""A model that is told the names, as the oracle of the concealed benchmark is."""

import pytest

from benchmarks.concealed_oracle import told
from ddagr_gym.diagnosis.preprocessing.mended_recordings import Prepared
from ddagr_gym.diagnosis.result.conclusion import Begun
from ddagr_gym.diagnosis.setting import Setting
from ddagr_gym.identification.gauss_newton import fit
from tests.diagnosis.conftest import Sloping


def test_an_oracle_fits_what_it_is_told_and_nothing_else(sloping: Sloping) -> None:
    problem = sloping.problem
    prepared = Prepared(sloping.recordings, (), None, problem)
    first = Begun(Setting(), prepared, fit(problem, iterations=0), sloping.nominal)
    fitted = told(first, ["slope"])
    assert fitted is not None
    assert [effect.name for effect in fitted.point.effects] == ["slope"]
    assert fitted.cost == pytest.approx(sloping.chosen.cost, rel=0.02)
