"""Where the refit of a patch of soil starts: a band is found in drives over one, as a band."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.search.gains import gains
from ddagr_gym.diagnosis.search.patch_guess import patch_guesses
from ddagr_gym.diagnosis.search.scan import scan, touched
from ddagr_gym.identification.gauss_newton import fit
from ddagr_gym.physics.effects.registry import effect_kind, parse_effect
from ddagr_gym.physics.effects.soil_patch import from_middle_line

BAND = "soil_patch=0.6,stiffness=0.5,centre_x=0.9,centre_y=0.1,radius=0.45,edge=0.2,half_length=50,bearing=1.2"


@pytest.mark.slow
def test_a_band_is_found_with_its_place_bearing_and_width(drive, problem_of) -> None:
    truth = parse_effect(BAND)
    problem = problem_of(*(drive((BAND,), seed=k, yaw=yaw) for k, yaw in enumerate((0.0, 1.0, -1.0))))
    nominal = fit(problem)
    terms = scan(problem, nominal, {name: effect_kind(name) for name in ("soil_patch", "soil_change", "slope")})
    assert gains(terms)[0].name == "soil_patch"
    starts = [replace(nominal.point, effects=(guess,)) for guess in patch_guesses(terms)]
    assert [start.effects[0].half_length > 0.0 for start in starts] == [False, True, True]
    trials = [fit(problem, start, iterations=3, reuse=nominal) for start in starts]
    best = fit(problem, min(trials, key=lambda trial: trial.cost).point, iterations=10, renewals=3)
    found = best.point.effects[0]
    assert found.half_length > 0.0
    assert math.remainder(found.bearing - truth.bearing, math.pi) == pytest.approx(0.0, abs=0.1)
    assert _offset(found, truth) < 0.15
    assert found.radius == pytest.approx(truth.radius, abs=0.15)
    assert found.strength == pytest.approx(truth.strength, rel=0.15)


def _offset(band, other) -> float:
    """Distance of a band's centre from the middle line of another [m]."""
    x, y = (np.array([getattr(band, name) - getattr(other, name)]) for name in ("centre_x", "centre_y"))
    return float(from_middle_line(x, y, other.half_length, other.bearing)[0])


def test_windows_beside_a_band_need_no_simulation(drive, problem_of) -> None:
    problem = problem_of(drive(seconds=8.0))
    prediction = np.zeros((problem.blocked.windows.count, 2, 8))
    prediction[0, :, 5:7] = (30.0, 31.0)
    prediction[1:, :, 5:7] = (30.0, 24.0)
    along = parse_effect(f"soil_patch=0.6,half_length=100,bearing={math.pi / 4}")
    assert touched(along, problem, prediction).tolist() == [True] + [False] * (len(prediction) - 1)
    assert not touched(parse_effect("soil_patch=0.6"), problem, prediction).any()
