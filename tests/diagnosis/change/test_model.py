"""How probable a shift is among all that were looked at."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ddagr_gym.diagnosis.change import model
from ddagr_gym.diagnosis.change.model import Model
from ddagr_gym.diagnosis.change.shifts import Pull, Shift
from ddagr_gym.identification.spells import Spell

ONE = np.ones(1)


def shift(name: str, probability: float, looks: int = 1) -> Shift:
    return Shift(SimpleNamespace(name=name), ONE, ONE, np.eye(1), np.eye(1), 10.0, probability, 10.0, 10.0, looks)


def model_with(looks: int) -> Model:
    """A model in which two effects, one of them in several parts of the drive, and a parameter were looked at."""
    shifts = (shift("towed_drag", 1e-3, looks), shift("payload", 1e-3))
    return Model(None, None, None, shifts, (Pull("soil_strength", 1.0, 10.0),))


def test_what_is_tried_in_every_part_of_the_drive_is_so_many_tests():
    always, later = model_with(1), model_with(18)
    drag, payload = later.shifts
    assert later.probability(drag) == pytest.approx(1.0 - (1.0 - 1e-3) ** (18 * 3))
    assert later.probability(payload) == always.probability(payload) == pytest.approx(1.0 - (1.0 - 1e-3) ** 3)
    assert drag.limit(3) > payload.limit(3)
    assert later.probability(later.pulls[0]) == always.probability(always.pulls[0])
    assert [item.compared.name for item in later.conspicuous] == ["payload"]


WINDOWS = SimpleNamespace(recording=np.zeros(14, dtype=int), time=4.0 * np.arange(14), count=14)
"""Three of them on either side: an effect may begin or end at nine times."""


@pytest.mark.parametrize(("against_the_rest", "chosen"), [(1e-6, True), (1e-2, False)])
def test_an_effect_in_a_part_of_the_drive_is_judged_by_what_says_more_surely(monkeypatch, against_the_rest, chosen):
    apart = replace(shift("towed_drag", against_the_rest, 2), apart=True)
    monkeypatch.setattr(model, "contrast_of", lambda *_: apart)
    problem = SimpleNamespace(spells={"towed_drag": Spell(0, 30.0)}, blocked=SimpleNamespace(windows=WINDOWS))
    drag, payload = model._against_the_rest([shift("towed_drag", 1e-4), shift("payload", 1e-3)], problem, None)
    assert drag.apart == chosen
    assert drag.looks == (2 if chosen else 18)
    assert (payload.apart, payload.looks) == (False, 1)
