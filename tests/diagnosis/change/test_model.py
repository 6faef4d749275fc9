"""How probable a shift is among all that were looked at."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ddagr_gym.diagnosis.change.model import Model
from ddagr_gym.diagnosis.change.shifts import Pull, Shift
from ddagr_gym.identification.spells import Spell

ONE = np.ones(1)


def shift(name: str, probability: float) -> Shift:
    return Shift(SimpleNamespace(name=name), ONE, ONE, np.eye(1), np.eye(1), 10.0, probability)


def model_with(spells) -> Model:
    """A model of 14 windows in which two effects and a parameter were looked at."""
    windows = SimpleNamespace(recording=np.zeros(14, dtype=int), time=4.0 * np.arange(14))
    problem = SimpleNamespace(spells=spells, blocked=SimpleNamespace(windows=windows))
    shifts = (shift("towed_drag", 1e-3), shift("payload", 1e-3))
    return Model(problem, None, None, shifts, (Pull("soil_strength", 1.0, 10.0),))


def test_what_is_tried_in_every_part_of_the_drive_is_so_many_tests():
    always, later = model_with({}), model_with({"towed_drag": Spell(0, 30.0)})
    drag, payload = always.shifts
    # 14 windows, three of them on either side: it may begin or end at nine times
    assert later.probability(drag) == pytest.approx(1.0 - (1.0 - 1e-3) ** (18 * 3))
    assert later.probability(payload) == always.probability(payload) == pytest.approx(1.0 - (1.0 - 1e-3) ** 3)
    assert later.probability(later.pulls[0]) == always.probability(always.pulls[0])
    assert [item.compared.name for item in later.conspicuous] == ["payload"]
