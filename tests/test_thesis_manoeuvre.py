"""The thesis's manoeuvre in the simulator: straight, a turn with one bank locked, straight."""

import math

import numpy as np
import pytest

from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.simulator import simulate

ROBOT, SOIL = get_robot("ddagr"), get_soil("thesis_a1")


@pytest.fixture(scope="module")
def table_6_2():
    pieces = [((0.701, 0.701), 625), ((0.0, 1.195), 2188), ((0.701, 0.701), 312)]
    return simulate(ROBOT, SOIL, np.concatenate([np.tile(speeds, (count, 1)) for speeds, count in pieces]))


def test_straight_speed_of_table_6_2(table_6_2):
    assert table_6_2["true_v_x"][620] == pytest.approx(0.1942, rel=0.01)
    assert abs(table_6_2["true_yaw_rate"][620]) < 1e-12


def test_steady_turn_of_table_6_2(table_6_2):
    end = 2800
    assert table_6_2["true_v_x"][end] == pytest.approx(0.1546, rel=0.01)
    assert abs(table_6_2["true_v_y"][end]) == pytest.approx(0.0046, rel=0.01)
    # the right bank is locked: the robot turns to the right
    assert table_6_2["true_yaw_rate"][end] == pytest.approx(-0.2108, rel=0.01)


def test_radius_of_table_6_2(table_6_2):
    """Radius of the circle through the driven path, not of a ratio of averages."""
    x, y = table_6_2["true_x"][1500:2800], table_6_2["true_y"][1500:2800]
    system = np.stack([2 * x, 2 * y, np.ones_like(x)], axis=-1)
    centre_x, centre_y, rest = np.linalg.lstsq(system, x**2 + y**2, rcond=None)[0]
    assert math.sqrt(rest + centre_x**2 + centre_y**2) == pytest.approx(0.733, rel=0.01)


def test_effective_track_is_that_of_fielded_robots():
    """Effective over geometric track in a turn: 1.3 to 1.85 over soils (1.49 to 1.88 as fielded)."""
    ratios = []
    for name in ("thesis_a1", "sandy_loam_lll_15", "lete_sand_wong", "firm_ground", "dry_sand_lll_0"):
        drive = simulate(ROBOT, get_soil(name), np.tile([1.0, 0.5], (800, 1)))
        rim = ROBOT.wheels[0].outer_radius * 0.5
        ratios.append(rim / (2 * ROBOT.half_track * drive["true_yaw_rate"][-1]))
    assert min(ratios) > 1.3
    assert max(ratios) < 1.85
