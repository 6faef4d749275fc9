"""Dead reckoning and its reference: geometry that is known exactly."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.parameters import Sensors
from ddagr_gym.policies.reckoning import Reckoning, path_errors

STEP, SPEED, RADIUS = 0.08, 0.2, 0.8
ONE = np.array([0])


def drive(reckoning, steps, rate=0.0, curvature=1 / RADIUS, lateral=None):
    """Steady driving; by default the accelerometer sees what the yaw rate says, that is no sideslip."""
    for _ in range(steps):
        force = rate * SPEED if lateral is None else lateral
        reckoning.advance(ONE, *(np.array([v]) for v in (SPEED, rate, force, curvature)))


def started(run_in=0.5):
    reckoning = Reckoning(Sensors(), 1)
    reckoning.start(ONE, np.array([run_in]))
    return reckoning


def test_the_reference_is_the_commanded_path():
    reckoning, turn = started(), RowTurn(radius=RADIUS, side="left", run_in=0.5, run_out=0.5)
    for step in range(1, int(turn.duration / STEP)):
        drive(reckoning, 1)
        along = SPEED * STEP * step
        x, y = turn.position(along)
        assert reckoning.references[0, 2] == pytest.approx(float(turn.heading(along)), abs=1e-9)
        # chords of 16 mm, and the step in which the turn begins or ends
        np.testing.assert_allclose(reckoning.references[0, :2], [x, y], atol=1e-3)
    assert reckoning.references[0, 2] == pytest.approx(math.pi)


def test_a_correction_changes_the_references_radius_and_no_error_arises():
    reckoning, wider = started(0.0), 1.25 * RADIUS
    half = int(math.pi * wider / SPEED / STEP)
    for _ in range(half):
        drive(reckoning, 1, curvature=1 / wider)
    assert reckoning.references[0, 1] == pytest.approx(2 * wider, abs=0.01)
    assert reckoning.references[0, 2] == pytest.approx(math.pi, abs=0.02)


def test_a_robot_that_turns_like_its_reference_has_no_course_error():
    reckoning = started(0.0)
    drive(reckoning, 1, rate=SPEED / RADIUS)
    for _ in range(30):
        drive(reckoning, 1, rate=SPEED / RADIUS)
        _, course = reckoning.reference_errors(ONE)
        # the yaw rate's first trapezoid is half a step short, and sideslip makes the way a thousandth longer
        assert abs(course[0] - reckoning.slip_angles[0]) < 0.5 * STEP * SPEED / RADIUS + 0.003


def test_errors_are_positive_to_the_left_all_along_the_path():
    turn = RowTurn(radius=RADIUS, side="left", run_in=0.5, run_out=0.5)
    reckoning = started()
    for _ in range(int(turn.duration / STEP)):
        drive(reckoning, 1)
        x, y, direction = reckoning.references[0]
        reckoning.positions[0] = x - 0.03 * math.sin(direction), y + 0.03 * math.cos(direction)
        reckoning.poses[0] = *reckoning.positions[0], direction + 0.1
        reckoning.slip_angles[0] = 0.0
        offset, course = reckoning.reference_errors(ONE)
        assert (offset[0], course[0]) == (pytest.approx(0.03), pytest.approx(0.1))
        found = reckoning.path_errors(ONE, np.array([RADIUS]), with_sideslip=True)
        assert found.offset[0] == pytest.approx(0.03, abs=2e-3)
        assert found.direction[0] == pytest.approx(0.1, abs=0.02)


def test_path_errors_agree_with_the_commanded_manoeuvre():
    turn = RowTurn(radius=RADIUS, side="left", run_in=0.0, run_out=0.5)
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-0.8, 1.2, 200), rng.uniform(-0.5, 2.2, 200)
    found = path_errors(x, y, np.zeros(200), np.full(200, RADIUS))
    distance, offset = turn.project(x, y)
    np.testing.assert_allclose(found.offset, offset, atol=1e-12)
    np.testing.assert_allclose(turn.turn_length - found.to_go, distance, atol=1e-12)


def test_sideslip_carries_the_position_aside_and_not_the_heading():
    reckoning = started(2.0)
    drive(reckoning, 60)
    drive(reckoning, 3, rate=0.25)
    drive(reckoning, 60, rate=0.25, lateral=0.25 * SPEED + 0.004)
    assert reckoning.slip_angles[0] > -0.037 * 0.25 / SPEED + 0.01
    assert reckoning.poses[0, 2] == pytest.approx(0.25 * STEP * 62.5, abs=1e-9)
    away = reckoning.positions[0] - reckoning.poses[0, :2]
    assert np.hypot(*away) > 0.005


def test_rows_are_apart_and_start_again():
    both, alone = Reckoning(Sensors(), 2), started(0.3)
    both.start(np.array([0, 1]), np.array([0.3, 0.7]))
    for _ in range(20):
        both.advance(np.array([0, 1]), *(np.full(2, v) for v in (SPEED, 0.1, 0.03, 1.25)))
        alone.advance(ONE, *(np.array([v]) for v in (SPEED, 0.1, 0.03, 1.25)))
    for one, two in zip(both.memories(), alone.memories(), strict=True):
        np.testing.assert_allclose(one[0], two[0], rtol=1e-9, atol=1e-15)
    both.start(ONE, np.array([0.4]))
    fresh = started(0.4)
    for one, two in zip(both.memories(), fresh.memories(), strict=True):
        np.testing.assert_array_equal(one[0], two[0])
