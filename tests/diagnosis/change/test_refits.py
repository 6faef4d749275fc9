"""Which effects are refitted beside those that are out of the ordinary."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from ddagr_gym.diagnosis.change import refits
from ddagr_gym.diagnosis.change.model import _further
from ddagr_gym.diagnosis.change.ordinary import Comparison, Scores
from ddagr_gym.diagnosis.change.refits import ALIKE, MOST_NEAR, Refit, _explaining_alike, _in_a_place
from ddagr_gym.diagnosis.search.scanned_model import Rival
from ddagr_gym.identification.problem import Point
from ddagr_gym.physics.effects.soil_change import SoilChange
from ddagr_gym.physics.effects.soil_patch import SoilPatch

KEYS = ("a 0", "b 0", "c 0", "d 0", "e 0")


def drive(gains: dict[str, float]) -> Scores:
    """Scores by which each effect alone explains a gain."""
    gradient = np.array([np.sqrt(2.0 * gains.get(key[0], 0.0)) for key in KEYS])
    eye = np.eye(len(KEYS))
    return Scores(KEYS, gradient, eye, eye, 0.0 * eye)


def model(gains: dict[str, float], conspicuous=("a",), pulled=()):
    scores = drive(gains)
    shifts = [SimpleNamespace(compared=SimpleNamespace(name=key[0], keys=(key,), ridge=np.zeros(1))) for key in KEYS]
    scan = SimpleNamespace(scores=lambda: scores)
    return SimpleNamespace(scan=scan, best=shifts, conspicuous=conspicuous, pulled=pulled, named=())


def names(found) -> list[str]:
    return [shift.compared.name for shift in found]


def test_what_explains_nearly_as_much_is_refitted_the_most_first():
    gains = {"a": 100.0, "b": 100.0 * ALIKE + 1.0, "c": 100.0 * ALIKE - 1.0}
    assert names(_explaining_alike(model(gains), Comparison((drive({}),)))) == ["a", "b"]


def test_what_ordinary_drives_explain_too_does_not_count():
    gains = {"a": 50.0, "b": 500.0}
    assert names(_explaining_alike(model(gains), Comparison((drive({"b": 480.0}), drive({"b": 20.0}))))) == ["a"]


def test_nothing_is_asked_where_nothing_is_out_of_the_ordinary():
    assert _explaining_alike(model({"a": 50.0}, conspicuous=()), Comparison((drive({}),))) == []
    assert names(_explaining_alike(model({"a": 50.0}, conspicuous=(), pulled=("x",)), Comparison((drive({}),)))) == [
        "a"
    ]


def test_no_more_than_a_few_are_refitted():
    alike = dict.fromkeys("abcde", 10.0)
    assert len(_explaining_alike(model(alike), Comparison((drive({}),)))) == MOST_NEAR


PATCH = SoilPatch(0.5, 0.4, 7.0, 3.0, 2.0)
GROUND, CHANGED = np.array([0.1]), np.array([0.3])
"""Values of the ground's parameter without a changed soil and beside it."""


def places_asked(monkeypatch, soil_gain: float, *, wider: bool = False, present=()) -> list[Point]:
    """Where refits of a patch begin, beside a refit of another effect that explains 100."""
    asked: list[Point] = []
    monkeypatch.setattr(refits, "patch_of_change", lambda *_: PATCH)
    point = Point(CHANGED, np.zeros((1, 3)), (SoilChange(0.5, 0.4),))
    fitted, nothing = SimpleNamespace(point=point), SimpleNamespace(point=Point(GROUND, np.zeros((1, 3)), present))
    found = [
        Refit("same", None, Rival("slope", nothing, 100.0)),
        Refit("wider" if wider else "same", None, Rival("soil_change", fitted, soil_gain)),
    ]
    without = SimpleNamespace(problem="same", fitted=nothing)

    def kept(problem, model, starts, *_):
        asked.extend(at for _, at in starts.values())
        return []

    monkeypatch.setattr(refits, "_refitted", kept)
    _in_a_place(without, found, 1.0, lambda line: None)
    return asked


def test_a_changed_soil_that_explains_about_as_much_as_any_is_tried_in_a_place(monkeypatch):
    (start,) = places_asked(monkeypatch, 100.0 * ALIKE + 1.0)
    assert start.effects == (PATCH,)
    np.testing.assert_array_equal(start.values, CHANGED)
    assert places_asked(monkeypatch, 100.0 * ALIKE - 1.0) == []


def test_the_soil_beside_a_patch_is_that_of_the_ground(monkeypatch):
    (start,) = places_asked(monkeypatch, 90.0, wider=True)
    np.testing.assert_array_equal(start.values, GROUND)


def test_there_is_one_patch(monkeypatch):
    assert places_asked(monkeypatch, 90.0, present=(PATCH,)) == []


def test_a_changed_soil_is_no_further_effect_beside_a_patch_that_has_its_keys():
    soil, slope = (SimpleNamespace(name=name, keys=(f"{name} 0",)) for name in ("soil_change", "slope"))
    assert _further([soil, slope], {}, ()) == [soil, slope]
    assert _further([soil, slope], {}, soil.keys) == [slope]
    assert _further([soil, slope], {"slope": "why"}, ()) == [soil]
