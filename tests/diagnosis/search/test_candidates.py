"""Probes of every effect of the library make candidates, and candidates make valid first guesses."""

import math

import numpy as np
import pytest

from ddagr_gym.diagnosis.search.candidates import candidates_of
from ddagr_gym.diagnosis.search.initial_guess import first_guess
from ddagr_gym.identification.size_prior import TYPICAL_MULTIPLE, size_penalty
from ddagr_gym.physics.effects.base import DriveExtent
from ddagr_gym.physics.effects.registry import effect_kinds, parse_effect
from ddagr_gym.physics.effects.soil_patch import from_middle_line

EXTENT = DriveExtent(60.0, (-3.0, 3.0), (-2.0, 4.0), 1.2, 3.0)


@pytest.mark.parametrize("name", sorted(effect_kinds()))
def test_every_probe_is_in_one_candidate_and_guesses_are_valid(name: str) -> None:
    kind = effect_kinds()[name]
    found = candidates_of(kind, EXTENT, 7)
    columns = [column for candidate in found for column in candidate.columns]
    assert sorted(columns) == list(range(7, 7 + len(kind.probes(EXTENT))))
    for candidate in found:
        assert all(scale > 0.0 for scale in candidate.scales)
        guess = first_guess(candidate, [2.0] * len(candidate.probes))
        assert type(guess) is kind
        assert not guess.is_neutral


def test_every_place_of_the_area_lies_in_a_disc_and_in_a_band_of_each_bearing() -> None:
    """Half a cell in from the corners, where discs of 0.6 cells leave a gap between them."""
    probes = [candidate.probes[0] for candidate in candidates_of(effect_kinds()["soil_patch"], EXTENT, 0)]
    forms: dict[tuple[float, float], list] = {}
    for probe in probes:
        forms.setdefault((probe.half_length, probe.bearing), []).append(probe)
    assert [half_length for half_length, _ in forms] == [0.0] + 4 * [pytest.approx(math.hypot(6.0, 6.0))]
    x, y = (ends.ravel() for ends in np.meshgrid(np.linspace(-2.25, 2.25, 4), np.linspace(-1.25, 3.25, 4)))
    for (half_length, bearing), patches in forms.items():
        away = [from_middle_line(x - p.centre_x, y - p.centre_y, half_length, bearing) - p.radius for p in patches]
        assert np.min(away, axis=0).max() < 1e-9


def test_slope_is_guessed_from_two_components() -> None:
    candidate = candidates_of(effect_kinds()["slope"], EXTENT, 0)[0]
    step = candidate.probes[0].angle
    guess = first_guess(candidate, [3.0, -4.0])
    assert guess.angle == pytest.approx(5.0 * step)
    assert guess.direction == pytest.approx(np.arctan2(-4.0, 3.0))


def test_forms_of_a_motor_lag_are_tried_one_by_one() -> None:
    """Free to split the lag by any sign, one candidate would fit any loop of second order that is as fast."""
    found = candidates_of(effect_kinds()["motor_lag"], EXTENT, 0)
    forms = [(len(c.probes), *(getattr(c.probes[0], name) for name in c.probes[0].shape_names())) for c in found]
    assert forms == [(1, 0.0, 1.0, 0.0), (1, 1.0, 1.0, 0.0), (1, 0.0, 0.0, 0.0), (1, 0.0, 1.0, 1.0)]


def test_sign_is_guessed_as_reversed() -> None:
    candidate = candidates_of(effect_kinds()["gyro_sign"], EXTENT, 0)[0]
    assert first_guess(candidate, [1.0]).flip == 1.0
    assert candidate.whole == pytest.approx(1.0 / candidate.probes[0].flip)


def test_size_of_the_typical_multiple_costs_half() -> None:
    effect = parse_effect(f"motor_lag={TYPICAL_MULTIPLE * 0.05}")
    assert size_penalty([effect]) == pytest.approx(0.5)
    assert size_penalty([parse_effect("gyro_sign=1")]) == 0.0
