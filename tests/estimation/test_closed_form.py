"""Yardsticks without a filter."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddagr_gym.errors import InputError
from ddagr_gym.estimation import FilterModel, ForceLaw, SoilPrior, encoder_motion, roll_out, symmetric_forward_speed
from ddagr_gym.presets import get_robot

ROBOT = get_robot("ddagr")
RADIUS = ROBOT.wheels[0].outer_radius


def test_encoders_alone():
    motion = encoder_motion(ROBOT, 1.0, 0.5)
    assert motion.v_x == pytest.approx(0.75 * RADIUS)
    assert motion.yaw_rate == pytest.approx(0.5 * RADIUS / (2 * ROBOT.half_track))
    assert encoder_motion(ROBOT, 1.0, 0.5, track_factor=1.5).yaw_rate == pytest.approx(motion.yaw_rate / 1.5)
    with pytest.raises(InputError, match="positive ratio"):
        encoder_motion(ROBOT, 1.0, 0.5, track_factor=0.0)


@given(st.floats(0.05, 0.9), st.floats(0.1, 2.0), st.floats(0.0, 2.0), st.booleans())
def test_opposite_slips_are_recovered(slip, outer, inner, left_turn):
    # the outer bank drives with +s, v = A (1 - s); the inner is dragged with -s, v = B/(1 - s)
    v_outer, v_inner = RADIUS * outer * (1 - slip), RADIUS * inner / (1 - slip)
    if v_outer <= v_inner:
        return
    turn = (v_outer - v_inner) / (2 * ROBOT.half_track)
    right, left, sign = (outer, inner, 1.0) if left_turn else (inner, outer, -1.0)
    found = symmetric_forward_speed(ROBOT, sign * turn, right, left)
    assert found == pytest.approx(0.5 * (v_outer + v_inner), rel=1e-9)


def test_straight_driving_does_not_slip():
    assert symmetric_forward_speed(ROBOT, 0.0, 0.7, 0.7) == pytest.approx(0.7 * RADIUS)


@pytest.mark.parametrize("law_parameters", [(0.2, 4.0), (0.6, 12.0)])
def test_exact_for_a_symmetric_soil_without_resistance(law_parameters):
    limit, rate = law_parameters
    prior = SoilPrior(traction_limit_over_load=limit, traction_rate=rate, resistance_over_limit=1e-9, coupling=0.3)
    model = FilterModel(ROBOT, law=ForceLaw.thesis, prior=prior, rest_speed=1e-6)
    state = roll_out(model, model.initial()[0], np.tile([1.0, 0.5], (3000, 1)))[-1]
    found = symmetric_forward_speed(ROBOT, state[2], 1.0, 0.5)
    assert found == pytest.approx(state[0], rel=1e-4)


def test_not_a_number_where_its_premise_fails():
    found = symmetric_forward_speed(ROBOT, [0.2, 0.2, 0.0, 0.2], [-0.5, 1.0, 0.0, 1.0], [0.5, -0.2, 0.0, 0.3])
    assert [math.isfinite(v) for v in found] == [False, False, False, True]
