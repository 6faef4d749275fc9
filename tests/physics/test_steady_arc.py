"""Steady bank speeds on the simulator's own soil, against the simulator."""

import math

import numpy as np
import pytest

from ddagr_gym.evaluation.calibration import steady_motion
from ddagr_gym.physics.steady_arc import soil_of, steady_bank_speeds
from ddagr_gym.physics.wheel_forces import soil_vector
from ddagr_gym.presets import get_robot, get_soil

ROBOT = get_robot("ddagr")


def test_soil_survives_its_vector():
    soil = get_soil("thesis_a1")
    np.testing.assert_allclose(soil_vector(soil_of(soil_vector(soil))), soil_vector(soil), rtol=1e-12)


@pytest.mark.parametrize(("speed", "radius"), [(0.2, 0.8), (0.2, -0.8), (0.15, 1.2), (0.2, math.inf)])
def test_the_simulator_drives_what_was_asked(speed, radius):
    soil, curvature = get_soil("thesis_a1"), 1.0 / radius
    v_x, v_y, rate = steady_motion(ROBOT, soil, *steady_bank_speeds(ROBOT, soil, speed, curvature))
    assert math.hypot(v_x, v_y) == pytest.approx(speed, rel=0.01)
    assert rate / math.hypot(v_x, v_y) == pytest.approx(curvature, rel=0.01, abs=1e-6)


def test_no_solution_is_none():
    assert steady_bank_speeds(ROBOT, get_soil("thesis_a1"), 0.5, 1 / 0.4) is None
