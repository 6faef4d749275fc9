import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddagr_gym.frames import body_to_world, rotation_matrix, unwrap_heading, wrap_angle

angles = st.floats(-1e4, 1e4)


@given(angles)
def test_wrapped_angle_is_the_same_direction_in_the_half_open_interval(angle):
    wrapped = wrap_angle(angle)
    assert isinstance(wrapped, float)
    assert -math.pi < wrapped <= math.pi
    turns = (angle - wrapped) / (2 * math.pi)
    assert turns == pytest.approx(round(turns), abs=1e-9)


@pytest.mark.parametrize(
    ("angle", "wrapped"),
    [
        (0.0, 0.0),
        (math.pi, math.pi),
        (-math.pi, math.pi),
        (3 * math.pi, math.pi),
        (-0.5, -0.5),
        (2.5 * math.pi, 1.5708),
    ],
)
def test_wrapped_angle_at_the_interval_ends(angle, wrapped):
    assert wrap_angle(angle) == pytest.approx(wrapped, abs=1e-4)


def test_one_float_above_pi_stays_inside_the_interval():
    just_above = np.nextafter(math.pi, 4.0)
    assert -math.pi < wrap_angle(just_above) <= math.pi
    assert wrap_angle(np.array([just_above])).shape == (1,)


def test_rotation_turns_forward_to_the_left():
    np.testing.assert_allclose(rotation_matrix(math.pi / 2) @ [1.0, 0.0], [0.0, 1.0], atol=1e-15)
    np.testing.assert_allclose(rotation_matrix(math.pi / 2) @ [0.0, 1.0], [-1.0, 0.0], atol=1e-15)


@given(st.lists(angles, min_size=1, max_size=5))
def test_rotations_are_orthogonal_and_proper(yaw):
    matrices = rotation_matrix(yaw)
    assert matrices.shape == (len(yaw), 2, 2)
    np.testing.assert_allclose(
        matrices @ np.swapaxes(matrices, -1, -2), np.broadcast_to(np.eye(2), matrices.shape), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(matrices), 1.0)


def test_body_points_follow_each_pose():
    points = [(0.33, -0.58), (0.0, 0.0)]
    world = body_to_world(points, [0.0, 2.0], [0.0, 1.0], [0.0, math.pi])
    np.testing.assert_allclose(world, [[[0.33, -0.58], [0, 0]], [[1.67, 1.58], [2, 1]]], atol=1e-15)
    np.testing.assert_allclose(body_to_world(points, 2.0, 1.0, math.pi), world[1])


def test_unwrapping_bridges_gaps_and_keeps_them():
    heading = np.linspace(0.0, 9.0, 40)
    wrapped = wrap_angle(heading)
    wrapped[5:8] = np.nan
    continuous = unwrap_heading(wrapped)
    known = np.isfinite(wrapped)
    np.testing.assert_allclose(continuous[known], heading[known])
    assert np.isnan(continuous[~known]).all()
