"""Joint refits of one effect: shapes that a scan chose and no fit moves."""

from __future__ import annotations

import pytest

from ddagr_gym.diagnosis.search.rivals import _finish
from ddagr_gym.diagnosis.search.scanned_model import Rival, scan_model
from ddagr_gym.identification.effect_parameters import at_kept_shapes
from ddagr_gym.identification.gauss_newton import fit
from ddagr_gym.identification.problem import Point
from ddagr_gym.physics.effects.gyro_bias import GyroBias
from ddagr_gym.physics.effects.payload import Payload
from ddagr_gym.physics.effects.towed_drag import TowedDrag

FORCE = 60.0


def test_kept_shapes_go_back_to_their_defaults():
    assert at_kept_shapes(TowedDrag(20.0, hitch_distance=1.0)) == TowedDrag(20.0)
    assert at_kept_shapes(Payload(10.0, x=0.1)) == Payload(10.0)
    assert at_kept_shapes(GyroBias(0.1)) == GyroBias(0.1)


@pytest.mark.parametrize("large", [False, True])
def test_a_load_that_the_scan_put_too_far_behind_is_found_at_its_hitch(drive, problem_of, large):
    problem = problem_of(drive((f"towed_drag={FORCE:g}",)))
    nominal = fit(problem)
    point = Point(nominal.point.values, nominal.point.states, (TowedDrag(20.0, hitch_distance=1.0),))
    there = fit(problem, point, iterations=3, first=nominal)
    model = scan_model(problem, nominal)
    found = _finish(problem, model, Rival(TowedDrag.name, there, 0.0), large).fitted
    (effect,) = found.point.effects
    assert effect.hitch_distance == TowedDrag(FORCE).hitch_distance
    # soil that resists more explains a part of the drag in so short a drive
    assert 0.6 * FORCE < effect.force < 1.2 * FORCE
    assert fit(problem, found.point).cost < fit(problem, there.point).cost
