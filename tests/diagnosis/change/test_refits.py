"""Which effects are refitted beside those that are out of the ordinary."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from ddagr_gym.diagnosis.change.ordinary import Comparison, Scores
from ddagr_gym.diagnosis.change.refits import ALIKE, MOST_NEAR, _explaining_alike

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
