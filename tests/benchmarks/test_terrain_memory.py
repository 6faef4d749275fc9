"""Terrain of the concealed simulator that keeps its ruts."""

import numpy as np
import pytest

from benchmarks.concealed.cases import ALL_STRUCTURES, STRUCTURES
from benchmarks.concealed.change import with_ground
from benchmarks.concealed.drive import SAMPLE_PERIOD, SUBSTEPS, drive
from benchmarks.concealed.plant import nominal_plant
from benchmarks.concealed.terrain_memory import FLOOR, HEIGHT_GRID, PASSING, WALL_LEFT, WALL_RIGHT, new_grid, press

SINKAGE = 0.007


def driven(*parts, **ground):
    """Truth of a drive by parts (right, left [rad/s], seconds)."""
    rows = [np.tile([right, left], (round(seconds / SAMPLE_PERIOD), 1)) for right, left, seconds in parts]
    return drive(with_ground(nominal_plant(), **ground), np.repeat(np.concatenate(rows), SUBSTEPS, axis=0), np.zeros(3))


def kept(*parts, rebound=0.2):
    return driven(*parts, rut_mode=HEIGHT_GRID, rebound=rebound)


def roll(grid, under, y, start, yaw=0.0):
    """Roll a wheel of constant sinkage along x; what the last calls say of the soil's stiffening."""
    found = [press(grid, 0.2, 0.5, under, SINKAGE, 0.01 * k, y, yaw, 0.01, start + 0.02 * k) for k in range(100)]
    return found[-1]


def test_untouched_ground_is_as_it_was_and_a_wheel_is_not_in_its_own_rut():
    under = np.zeros(6)
    assert roll(new_grid(True), under, 0.025, 0.0) == pytest.approx(0.0, abs=1e-12)
    assert np.all(under == 0.0)


def test_a_rut_is_as_deep_as_what_does_not_spring_back_and_carries_more_on_less():
    grid, under = new_grid(True), np.zeros(6)
    roll(grid, np.zeros(6), 0.025, 0.0)
    stiffening = roll(grid, under, 0.025, PASSING + 2.0)
    floor = 0.8 * SINKAGE
    assert under[FLOOR] == pytest.approx(floor, rel=1e-3)
    # beyond the depth that was carried before: the curve of untouched soil at the whole depth
    assert stiffening == pytest.approx(((floor + SINKAGE) / SINKAGE) ** 0.5 - 1.0, rel=1e-3)
    assert under[WALL_LEFT] == under[WALL_RIGHT] == pytest.approx(floor, rel=1e-3)


def test_beside_a_rut_only_the_part_of_the_tyre_in_it_stands_lower():
    grid, under = new_grid(True), np.zeros(6)
    roll(grid, np.zeros(6), 0.025, 0.0)
    roll(grid, under, 0.125, PASSING + 2.0)
    assert 0.0 < under[FLOOR] < 0.8 * SINKAGE
    assert under[WALL_RIGHT] == 0.0 < under[WALL_LEFT]


def test_the_axle_that_follows_sinks_less_in_either_direction_and_the_ground_resists_less():
    truth, plain = kept((2, 2, 5), (-2, -2, 2.5)), driven((2, 2, 5), (-2, -2, 2.5))
    ahead, back = 240, 374
    assert truth["sinkage_3"][ahead] < 0.85 * truth["sinkage_1"][ahead]
    assert truth["torque_right"][ahead] < 0.97 * plain["torque_right"][ahead]
    assert abs(truth["torque_right"][back]) < abs(truth["torque_right"][ahead])
    # the IMU is tilted back by what the rear wheels stand lower; the robot does not drive uphill
    assert truth["force_x"][ahead] - plain["force_x"][ahead] == pytest.approx(9.81 * 0.0043 / 0.66, rel=0.3)
    assert truth["v_x"][ahead] == pytest.approx(plain["v_x"][ahead], rel=0.01)


def test_ruts_hold_the_robot_sideways_and_the_softer_the_soil_springs_back_the_deeper_they_are():
    turn = (1, 3, 6)
    plain, firm, soft = driven(turn), kept(turn, rebound=0.4), kept(turn, rebound=0.05)
    slips = [np.mean(np.abs(truth["v_y"][150:])) for truth in (plain, firm, soft)]
    assert slips[0] > slips[1] > slips[2]


def test_earlier_sets_do_not_have_it():
    assert "ruts that stay" not in STRUCTURES
    assert set(ALL_STRUCTURES) - set(STRUCTURES) == {"ruts that stay"}
