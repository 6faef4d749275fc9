"""What contains a named effect stands beside it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ddagr_gym.diagnosis.change import nested
from ddagr_gym.identification.problem import Point
from ddagr_gym.identification.spells import Spell
from ddagr_gym.physics.effects.centre_of_mass_offset import CentreOfMassOffset
from ddagr_gym.physics.effects.gyro_bias import GyroBias
from ddagr_gym.physics.effects.wheel_radius_mismatch import WheelRadiusMismatch
from ddagr_gym.presets import get_robot

LATER = Spell(0, 30.0)


class Drives:
    """Windows of a DDAGR of which nothing is simulated."""

    robot = get_robot("ddagr")

    def __init__(self, spells=None) -> None:
        self.spells = spells or {}

    def during(self, spells) -> Drives:
        return Drives(spells)


def found(monkeypatch, effect, cost: float, spells=None):
    """What contains an effect that took the cost from 100 to 40, where the refit of it ends at another cost."""
    asked = []

    def refitted(problem, point, **_):
        asked.append(problem.spells)
        return SimpleNamespace(point=point, cost=cost)

    monkeypatch.setattr(nested, "fit", refitted)
    point = Point(np.zeros(0), np.zeros((1, 8)), (effect,))
    before = SimpleNamespace(fitted=SimpleNamespace(cost=100.0))
    named = SimpleNamespace(problem=Drives(spells))
    rival = SimpleNamespace(name=effect.name, gain=60.0, fitted=SimpleNamespace(point=point))
    return nested.containing(before, named, rival, 1.0), asked


@pytest.mark.parametrize(
    ("effect", "larger"),
    [(WheelRadiusMismatch(0.03), "encoder_scale"), (CentreOfMassOffset(x=0.06), "payload")],
)
def test_what_does_the_same_and_more_stands_beside_a_name(monkeypatch, effect, larger):
    rival, _ = found(monkeypatch, effect, 40.0)
    assert rival is not None
    assert (rival.name, rival.equivalent, rival.gain) == (larger, True, 60.0)


def test_what_explains_less_does_not_stand_beside_it_nor_has_every_effect_a_larger_one(monkeypatch):
    assert found(monkeypatch, WheelRadiusMismatch(0.03), 60.0)[0] is None
    assert found(monkeypatch, GyroBias(0.01), 40.0) == (None, [])


def test_it_begins_when_the_name_does(monkeypatch):
    spells = {"wheel_radius_mismatch": LATER}
    _, asked = found(monkeypatch, WheelRadiusMismatch(0.03), 40.0, spells)
    assert asked == [{**spells, "encoder_scale": LATER}]


def test_nothing_tells_it_from_the_name():
    weights = nested.beside({"wheel_radius_mismatch": 0.8, "gyro_bias": 0.2}, "wheel_radius_mismatch", "encoder_scale")
    assert weights["encoder_scale"] == weights["wheel_radius_mismatch"]
    assert sum(weights.values()) == pytest.approx(1.0)
    assert max(weights, key=weights.__getitem__) == "wheel_radius_mismatch"
