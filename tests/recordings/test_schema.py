from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddagr_gym.errors import InputError
from ddagr_gym.presets import get_robot
from ddagr_gym.recordings.channels import CHANNELS
from ddagr_gym.recordings.schema import (
    Recording,
    RobotGeometry,
    bank_speeds,
    split_at_gaps,
)


def plain(n=50, **changes):
    t = np.arange(n) * 0.1
    columns = {"t": t, **{name: np.linspace(0.1, 1.0, n) for name, c in CHANNELS.items() if c.core}}
    return {**columns, **changes}


def test_bank_speeds_follow_the_kinematics_of_a_differential_drive(warthog):
    right, left = bank_speeds(1.2, 0.5, warthog)
    assert right == pytest.approx((1.2 + 0.5 * 0.54) / 0.3)
    assert left == pytest.approx((1.2 - 0.5 * 0.54) / 0.3)


@given(st.floats(-5, 5), st.floats(-5, 5))
def test_bank_speeds_invert_to_the_body_speed(forward, turn):
    geometry = RobotGeometry("any", 0.2, 0.4)
    right, left = bank_speeds(forward, turn, geometry)
    assert 0.5 * geometry.wheel_radius * (right + left) == pytest.approx(forward, abs=1e-9)
    assert 0.5 * geometry.wheel_radius / geometry.half_track * (right - left) == pytest.approx(turn, abs=1e-9)


def test_geometry_of_a_robot_is_its_outer_radius_and_half_track():
    robot = get_robot("husky")
    geometry = RobotGeometry.of(robot)
    assert geometry.wheel_radius == pytest.approx(0.15875)
    assert geometry.half_track == pytest.approx(0.5385 / 2)


@pytest.mark.parametrize("radius", [0.0, -1.0, float("nan"), 11.0])
def test_geometry_refuses_impossible_lengths(radius):
    with pytest.raises(InputError, match="wheel_radius"):
        RobotGeometry("x", radius, 0.5)


def test_columns_become_channels_and_extras():
    recording = Recording.from_columns(plain(true_x=np.arange(50.0)), get_robot("ddagr"))
    assert recording.meta.robot == "ddagr"
    assert "true_x" in recording.extras
    assert "true_x" not in recording.channels
    assert recording.period == pytest.approx(0.1)
    assert recording.validate() == ()
    assert np.isnan(recording["pose_x"]).all()
    assert not recording.has("pose_x")


def test_time_starts_at_zero_and_the_clock_is_kept():
    recording = Recording.from_columns(plain(t=1.7e9 + np.arange(50) * 0.1))
    assert recording.t[0] == 0.0
    assert recording.meta.start_time == 1.7e9


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"t": np.zeros(50)}, "does not increase at row 1"),
        ({"t": np.full(50, np.nan)}, "NaN"),
        ({"yaw_rate": np.zeros(49)}, "yaw_rate"),
    ],
)
def test_bad_structure_is_refused(changes, words):
    with pytest.raises(InputError, match=words):
        Recording.from_columns(plain(**changes))


def test_columns_without_time_are_refused():
    with pytest.raises(InputError, match="no time"):
        Recording.from_columns({"yaw_rate": np.zeros(3)})


@pytest.mark.parametrize("ranges", [((0, 0),), ((0, 51),), ((0, 30), (20, 50)), ((-1, 5),)])
def test_bad_ranges_are_refused(ranges):
    with pytest.raises(InputError, match="segments"):
        Recording.from_columns(plain(), segments=ranges)


def test_unknown_channel_lists_the_closest():
    recording = Recording.from_columns(plain())
    with pytest.raises(InputError, match="yaw_rate"):
        recording["yawrate"]


def test_a_lost_sample_ends_a_segment_but_not_a_span():
    t = np.delete(np.arange(50) * 0.1, 20)
    recording = Recording.from_columns({"t": t})
    assert recording.meta.segments == ((0, 20), (20, 49))
    assert recording.meta.spans == ((0, 49),)


@given(st.lists(st.integers(2, 20), min_size=1, max_size=6))
def test_splitting_at_gaps_finds_exactly_the_pieces(lengths):
    t = np.concatenate([100.0 * i + np.arange(n) for i, n in enumerate(lengths)])
    edges = np.cumsum([0, *lengths])
    assert split_at_gaps(t, ((0, len(t)),)) == tuple(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"yaw_rate": np.full(50, 57.0)}, "deg/s"),
        ({"specific_force_z": np.full(50, 1.0)}, "in g"),
        ({"specific_force_z": np.full(50, -9.8)}, "points down"),
        ({"specific_force_z": np.full(50, 0.01)}, "taken out"),
        ({"encoder_right": np.full(50, np.nan)}, "encoder_right holds no samples"),
        ({"pose_yaw": np.tile([179.0, -179.0], 25)}, "degrees"),
    ],
)
def test_doubtful_values_are_said_in_a_sentence(changes, words):
    sentences = Recording.from_columns(plain(**changes)).validate()
    assert len(sentences) == 1
    assert words in sentences[0]


def test_one_wild_sample_is_not_a_wrong_unit():
    yaw_rate = np.zeros(500)
    yaw_rate[7] = 1e6
    columns = {**plain(500), "yaw_rate": yaw_rate}
    assert Recording.from_columns(columns).validate() == ()


def test_commands_are_held_inside_spans_while_valid_and_young():
    command = np.array([np.nan, 1.0, np.nan, np.nan, np.nan, np.nan, 3.0, np.nan])
    valid = np.array([True] * 7 + [False])
    recording = Recording.from_columns(
        {"t": np.arange(8.0), "command_right": command, "command_left": command},
        command_valid=valid,
        spans=((0, 5), (5, 8)),
    )
    right, left = recording.held_commands()
    np.testing.assert_array_equal(right, [np.nan, 1, 1, 1, 1, np.nan, 3, np.nan])
    np.testing.assert_array_equal(left, right)
    young, _ = recording.held_commands(maximum_age=2.0)
    np.testing.assert_array_equal(young, [np.nan, 1, 1, 1, np.nan, np.nan, 3, np.nan])


def test_rates_count_new_samples_only():
    pose = np.where(np.arange(50) % 5 == 0, 1.0, np.nan)
    rates = Recording.from_columns(plain(pose_x=pose)).rates()
    assert rates["pose_x"] == pytest.approx(2.0)
    assert rates["yaw_rate"] == pytest.approx(10.0)
