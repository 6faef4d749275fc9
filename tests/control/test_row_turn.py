import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddagr_gym.control.row_turn import Phase, RowTurn, wheels_fit_furrow, within_practice_tolerance
from ddagr_gym.errors import InputError

turns = st.builds(
    RowTurn,
    radius=st.floats(0.3, 5.0),
    side=st.sampled_from(["left", "right"]),
    run_in=st.floats(0.0, 3.0),
    run_out=st.floats(0.0, 3.0),
)


@pytest.mark.parametrize("side", ["left", "right"])
def test_landmarks_of_the_path(side):
    turn = RowTurn(radius=0.8, side=side, run_in=1.0, run_out=0.5)
    sign = 1 if side == "left" else -1
    marks = [0.0, 1.0, 1.0 + math.pi * 0.4, 1.0 + math.pi * 0.8, turn.length]
    expected = [(-1.0, 0.0), (0.0, 0.0), (0.8, 0.8 * sign), (0.0, 1.6 * sign), (-0.5, 1.6 * sign)]
    np.testing.assert_allclose(turn.position(marks), expected, atol=1e-12)
    np.testing.assert_allclose(
        turn.heading(marks), np.multiply(sign, [0, 0, math.pi / 2, math.pi, math.pi]), atol=1e-12
    )
    assert turn.centre == (0.0, 0.8 * sign)


def test_default_task_fits_its_25_seconds():
    assert RowTurn().radius == 0.80
    assert RowTurn().duration == pytest.approx((1.5 + 0.8 * math.pi) / 0.2)
    assert RowTurn().duration < 25.0


@given(turns)
def test_path_has_unit_speed_and_turns_with_its_curvature(turn):
    path = turn.sample(0.01)
    step = path.distance[1]
    chord = np.hypot(np.diff(path.x), np.diff(path.y))
    assert step <= 0.01
    assert np.all(chord <= step * (1 + 1e-12))
    np.testing.assert_allclose(chord, step, rtol=(step / turn.radius) ** 2)
    course = np.unwrap(np.arctan2(np.diff(path.y), np.diff(path.x)))
    middle = turn.heading((path.distance[1:] + path.distance[:-1]) / 2)
    np.testing.assert_allclose(course, middle, atol=step / turn.radius)
    assert np.sum(path.curvature) * step == pytest.approx(turn.sign * math.pi, abs=2.5 * step / turn.radius)


@given(turns, st.floats(0.001, 0.999), st.floats(-0.25, 0.25))
def test_projection_recovers_distance_and_left_offset(turn, share, offset):
    distance = share * turn.length
    (x, y), yaw = turn.position(distance), turn.heading(distance)
    found, error = turn.project(x - offset * math.sin(yaw), y + offset * math.cos(yaw))
    assert float(error) == pytest.approx(offset, abs=1e-9)
    assert float(found) == pytest.approx(distance, abs=1e-7)


@given(turns, st.floats(-3, 3), st.floats(-3, 8))
def test_turns_to_either_side_are_mirror_images(turn, x, y):
    other = turn.with_values(side="left" if turn.side == "right" else "right")
    np.testing.assert_allclose(turn.project(x, y)[0], other.project(x, -y)[0])
    np.testing.assert_allclose(turn.cross_track_error(x, y), -other.cross_track_error(x, -y))


def test_projection_is_continuous_over_the_boundary():
    turn = RowTurn()
    for y in (0.05, 1.5):
        inside, outside = turn.project(-1e-12, y), turn.project(1e-12, y)
        np.testing.assert_allclose(inside, outside, atol=1e-10)
    assert turn.project(-0.0, 1.6)[0] == pytest.approx(turn.run_in + turn.turn_length)


def test_phases_and_references():
    turn = RowTurn(radius=1.0, side="right", run_in=1.0, run_out=1.0, speed=0.25)
    distance = np.array([0.0, 0.99, 1.01, 4.1, 4.2])
    assert turn.phase(distance).tolist() == [Phase.RUN_IN, Phase.RUN_IN, Phase.TURN, Phase.TURN, Phase.RUN_OUT]
    np.testing.assert_allclose(turn.yaw_rate(distance), [0, 0, -0.25, -0.25, 0])
    np.testing.assert_allclose(turn.distance_at([0.0, 4.0, 1e3]), [0.0, 1.0, turn.length])
    np.testing.assert_allclose(turn.heading_to_go([0.0, -math.pi, -4.0]), [math.pi, 0.0, math.pi - 4.0])


@pytest.mark.parametrize(("side", "sign"), [("left", 1), ("right", -1)])
def test_exit_error_is_left_of_the_next_row(side, sign):
    turn = RowTurn(side=side)
    lateral, heading = turn.exit_error(1.6 * sign - 0.05, sign * math.pi + 0.1)
    assert lateral == pytest.approx(0.05)
    assert heading == pytest.approx(0.1)
    assert turn.cross_track_error(-1e-9, 1.6 * sign - 0.05) == pytest.approx(lateral)


def test_success_is_a_wheel_in_its_furrow():
    assert wheels_fit_furrow(0.127, 0.0, 0.33)
    assert not wheels_fit_furrow(0.128, 0.0, 0.33)
    assert wheels_fit_furrow(-0.06, -math.asin(0.066 / 0.33), 0.33)
    assert not wheels_fit_furrow(-0.06, -math.asin(0.068 / 0.33), 0.33)
    assert not wheels_fit_furrow(0.0, math.pi, 0.33)
    assert within_practice_tolerance(0.1, math.radians(-15))
    assert not within_practice_tolerance(0.1, math.radians(15.1))
    assert not within_practice_tolerance(-0.101, 0.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"radius": 0.29}, r"RowTurn.radius is 0.29: .*\[0.3, 5\] m"),
        ({"radius": math.nan}, "RowTurn.radius is nan"),
        ({"side": "lft"}, "unknown side 'lft': did you mean 'left'"),
        ({"speed": 0.0}, r"RowTurn.speed is 0: .*\(0, 5\] m/s"),
        ({"run_in": -1.0}, "RowTurn.run_in is -1"),
    ],
)
def test_bad_turns_are_refused(change, message):
    with pytest.raises(InputError, match=message):
        RowTurn(**change)


def test_bad_spacing_is_refused():
    with pytest.raises(InputError, match="spacing is 0"):
        RowTurn().sample(0.0)
