"""Rivals that tell the same story in other words stand behind it, unless they are clearly better."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ddagr_gym.diagnosis.search import equivalents
from ddagr_gym.diagnosis.search.equivalents import with_looped_encoders, with_off_centre_load
from ddagr_gym.diagnosis.search.scanned_model import Rival
from ddagr_gym.identification.problem import Point
from ddagr_gym.physics.effects import load_effects
from ddagr_gym.presets import get_robot

DISPERSION = 2.0
STANDING: Any = SimpleNamespace(fitted=SimpleNamespace(cost=1000.0), dispersion=DISPERSION)
PROBLEM: Any = None


def fitted_at(point: Point, gain: float) -> Any:
    return SimpleNamespace(point=point, cost=STANDING.fitted.cost - DISPERSION * gain)


def rival(gain: float, *effects: str) -> Rival:
    point = Point(np.zeros(1), np.zeros((1, 8)), load_effects(effects))
    return Rival(point.effects[-1].name, fitted_at(point, gain), gain)


def beside(monkeypatch: pytest.MonkeyPatch, gain: float, *tried: Rival) -> list[Rival]:
    """Rivals where a fit of the encoders reaches a gain."""
    monkeypatch.setattr(equivalents, "fit", lambda problem, point, **options: fitted_at(point, gain))
    return with_looped_encoders(PROBLEM, STANDING, list(tried))


RADII = rival(100.0, "gyro_scale=1.1", "wheel_radius_mismatch=0.04")


@pytest.mark.parametrize("gain", [90.0, 100.0, 104.0])
def test_encoders_that_fit_as_well_stand_behind_the_radii(monkeypatch: pytest.MonkeyPatch, gain: float) -> None:
    kept, told = beside(monkeypatch, gain, RADII)
    assert kept is RADII
    assert (told.name, told.equivalent) == ("encoder_scale", True)
    assert told.gain == pytest.approx(min(gain, 100.0) * (1.0 - equivalents._SECOND_SIZE))
    assert [effect.name for effect in told.fitted.point.effects] == ["gyro_scale", "encoder_scale"]
    assert told.fitted.point.effects[-1].loop == 1.0


def test_encoders_that_fit_clearly_better_are_a_rival_as_any_other(monkeypatch: pytest.MonkeyPatch) -> None:
    told = beside(monkeypatch, 106.0, RADII)[1]
    assert (told.name, told.equivalent) == ("encoder_scale", False)
    assert told.gain == pytest.approx(106.0)


def test_of_two_kinds_of_encoders_the_better_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    slope = rival(50.0, "slope=0.02")
    better, worse = rival(97.0, "encoder_scale=1.1"), rival(20.0, "encoder_scale=1.1")
    assert beside(monkeypatch, 100.0, RADII, better, slope) == [RADII, better, slope]
    found = beside(monkeypatch, 100.0, RADII, worse, slope)
    assert found[:2] == [RADII, slope]
    assert [item.equivalent for item in found] == [False, False, True]


def test_without_uneven_radii_nothing_is_told_again(monkeypatch: pytest.MonkeyPatch) -> None:
    slope = rival(50.0, "slope=0.02")
    assert beside(monkeypatch, 100.0, slope) == [slope]
    beside_encoders = rival(100.0, "encoder_scale=1.1", "wheel_radius_mismatch=0.04")
    assert beside(monkeypatch, 100.0, beside_encoders) == [beside_encoders]


CENTRE = rival(100.0, "centre_of_mass_offset=0.05")


def beside_centre(monkeypatch: pytest.MonkeyPatch, gain: float, *tried: Rival) -> list[Rival]:
    """Rivals where a fit of a load reaches a gain."""
    monkeypatch.setattr(equivalents, "fit", lambda problem, point, **options: fitted_at(point, gain))
    problem: Any = SimpleNamespace(robot=get_robot("ddagr"))
    return with_off_centre_load(problem, STANDING, list(tried))


@pytest.mark.parametrize(("gain", "equivalent"), [(99.0, True), (110.0, False)])
def test_a_load_off_the_centre_stands_beside_an_offset_centre_of_mass(
    monkeypatch: pytest.MonkeyPatch, gain: float, equivalent: bool
) -> None:
    kept, load = beside_centre(monkeypatch, gain, CENTRE)
    assert kept is CENTRE
    assert (load.name, load.equivalent) == ("payload", equivalent)
    effect: Any = load.fitted.point.effects[-1]
    robot = get_robot("ddagr")
    assert effect.mass / (robot.mass + effect.mass) * effect.x == pytest.approx(0.05)
    assert effect.x == pytest.approx(max(robot.half_wheelbase, robot.half_track))


def test_no_load_is_looked_for_behind_another_effect_or_where_nothing_is_shifted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    slope, hardly = rival(150.0, "slope=0.02"), rival(100.0, "centre_of_mass_offset=0.001")
    assert beside_centre(monkeypatch, 99.0, slope, CENTRE) == [slope, CENTRE]
    assert beside_centre(monkeypatch, 99.0, hardly) == [hardly]
    assert beside_centre(monkeypatch, 99.0) == []
