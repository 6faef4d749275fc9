"""Compiled code draws what numpy's generators draw, and they go on after it."""

import copy

import numpy as np
import pytest

from ddagr_gym.jit import kernel
from ddagr_gym.sensors import normal_draws
from ddagr_gym.sensors.normal_draws import FILL, GIVEN, NormalDraws, draw_normals

EVERYONE = np.arange(3)


@kernel(cached=False)
def draw_all(function, addresses, values):
    for n in range(values.shape[0]):
        if addresses[n] != GIVEN:
            draw_normals(function, addresses[n], values[n])


def _generators(kinds=(np.random.PCG64, np.random.Philox, np.random.MT19937)):
    return [np.random.Generator(kind(7)) for kind in kinds]


def _drawn(draws, generators, chosen, function=FILL):
    values = np.full((3, 400, 8), np.nan)
    draw_all(function, draws.prepare(generators, chosen, values), values)
    return values


def _is_shown():
    if not FILL:
        pytest.skip("numpy's library does not show its function here")


@pytest.mark.parametrize("shown", [True, False], ids=["compiled", "numpy itself"])
def test_draws_are_those_of_numpy_and_generators_go_on(shown, monkeypatch):
    if shown:
        _is_shown()
    monkeypatch.setattr(normal_draws, "FILL", FILL if shown else 0)
    generators, others, draws = _generators(), _generators(), NormalDraws()
    for _ in range(2):
        found = _drawn(draws, generators, EVERYONE)
        np.testing.assert_array_equal(found, [other.standard_normal((400, 8)) for other in others])
    assert [g.random() for g in generators] == [g.random() for g in others]
    assert [g.integers(9) for g in generators] == [g.integers(9) for g in others]


@pytest.mark.parametrize("shown", [True, False], ids=["compiled", "numpy itself"])
def test_only_chosen_generators_draw(shown, monkeypatch):
    if shown:
        _is_shown()
    monkeypatch.setattr(normal_draws, "FILL", FILL if shown else 0)
    generators = _generators()
    found = _drawn(NormalDraws(), generators, np.array([0, 2]))
    assert np.isnan(found).all(axis=(1, 2)).tolist() == [False, True, False]
    assert generators[1].random() == _generators()[1].random()


def test_a_generator_that_is_replaced_is_noticed():
    _is_shown()
    generators, draws = _generators(), NormalDraws()
    _drawn(draws, generators, EVERYONE)
    generators[1] = np.random.default_rng(3)
    found = _drawn(draws, generators, EVERYONE)
    np.testing.assert_array_equal(found[1], np.random.default_rng(3).standard_normal((400, 8)))


def test_a_copy_draws_from_its_own_generators():
    _is_shown()
    both = (NormalDraws(), _generators())
    _drawn(*both, EVERYONE)
    copied = copy.deepcopy(both)
    first = _drawn(*both, EVERYONE)
    np.testing.assert_array_equal(_drawn(*copied, EVERYONE), first)
