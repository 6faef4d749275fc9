"""B6: it steers back to the circle by the estimated pose, stands first where it is asked to, and sees no truth."""

import math

import numpy as np
import pytest

from ddagr_gym.control.observation import OBSERVATION, SCALES
from ddagr_gym.control.path_tracker import PathTracker, aligning_path, carried
from ddagr_gym.control.pid import PidGains
from ddagr_gym.envs.options import make_settings
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import Reckoned
from ddagr_gym.evaluation.controllers import find_controller
from ddagr_gym.evaluation.runs import drive_turn
from ddagr_gym.presets import get_robot

ROBOT = get_robot("ddagr")
SENSED = {"samples": np.zeros((10, 5)), "command": np.zeros(2)}


def observation(**values):
    entries = {"side": 1.0, "target_radius": 0.8, "target_speed": 0.2, "heading_to_go": 1.5, "run_in_to_go": 0.5}
    entries |= values
    return np.array([entries.get(name, 0.0) for name, _, _ in OBSERVATION]) / SCALES


class Placed:
    """An estimator that is told where the robot is."""

    def __init__(self, radius=0.8, angle=1.0, course=0.0):
        self.at = Reckoned(
            radius * math.sin(angle), 0.8 - radius * math.cos(angle), angle + course, 0.2, 0.0, 0.25, np.ones(4)
        )
        self.started = []

    def reset(self, x, y, yaw):
        self.started.append((x, y, yaw))

    def update(self, command, samples):
        return self.at

    def present(self):
        return self.at


def curvature_at(estimator, steady_arc=None, **options):
    """Curvature that the tracker asks for in the second control period."""
    asked = []

    def record(at, speed, curvature):
        asked.append(curvature)
        return None if steady_arc is None else steady_arc(at, speed, curvature)

    controller = PathTracker(ROBOT, PidGains(10.0, 0.0, 0.0, 5.0), 3.0, estimator, record, **options)
    controller(observation(), SENSED)
    controller(observation(), SENSED)
    return asked[-1]


def test_tracker_steers_back_to_the_circle():
    assert curvature_at(Placed()) == pytest.approx(1.0 / 0.8, rel=1e-9)
    assert curvature_at(Placed(radius=0.85)) == pytest.approx(1.25 + 10.0 * 0.05, rel=1e-9)  # outside: turn harder
    assert curvature_at(Placed(radius=0.75)) == pytest.approx(1.25 - 10.0 * 0.05, rel=1e-9)
    assert curvature_at(Placed(course=0.1)) == pytest.approx(1.25 - 3.0 * 0.1, rel=1e-9)


def test_course_counts_and_not_heading():
    sliding = Placed()
    sliding.at = sliding.at._replace(v_y=-0.02)  # moves to the right of where it points
    assert curvature_at(sliding) == pytest.approx(1.25 + 3.0 * math.atan2(0.02, 0.2), rel=1e-9)


def test_a_share_of_the_side_slip_counts():
    sliding = Placed()
    sliding.at = sliding.at._replace(v_y=-0.02)
    expected = 1.25 + 3.0 * 0.4 * math.atan2(0.02, 0.2)
    assert curvature_at(sliding, side_slip_share=0.4) == pytest.approx(expected, rel=1e-9)


def test_motion_is_carried_ahead_along_its_arc():
    at = Placed(angle=0.5).at._replace(yaw_rate=0.25)
    x, y, yaw = carried(at, 0.4)
    # on the circle of 0.8 m at 0.2 m/s: 0.1 rad further, up to the third order of that angle
    assert yaw == pytest.approx(0.6)
    assert (x, y) == pytest.approx((0.8 * math.sin(0.6), 0.8 - 0.8 * math.cos(0.6)), abs=0.8 * 0.1**3 / 24)
    assert carried(at, 0.0) == pytest.approx((at.x, at.y, at.yaw), abs=1e-15)


def test_errors_of_the_motion_ahead_steer():
    turning = Placed(course=-0.1)
    turning.at = turning.at._replace(yaw_rate=0.75)
    now, later = curvature_at(turning), curvature_at(turning, ahead=0.2)
    # it points outward by 0.1 rad, but in 0.2 s it has turned by 0.1 rad more than the path
    assert now == pytest.approx(1.25 + 3.0 * 0.1, rel=1e-9)
    assert later < now - 0.2


def test_aligning_path_ends_at_the_row_with_the_slip_as_its_course():
    assert aligning_path(0.0, 0.3) == (0.0, 1.0)
    assert aligning_path(0.3, 0.0) == (0.0, 0.0)
    assert aligning_path(-0.1, 0.3)[0] == 0.0
    for to_go in (0.05, 0.2, 0.5):
        (after, slope), (before, _) = aligning_path(to_go + 1e-6, 0.3), aligning_path(to_go - 1e-6, 0.3)
        assert slope == pytest.approx((after - before) / 2e-6, rel=1e-4)
    assert max(abs(value) for value in aligning_path(1.2, 0.3)) < 1e-5


def test_nose_turns_into_the_row_and_the_slip_carries_to_it():
    sliding = Placed(angle=math.pi - 1e-9)  # at the end of the turn, nose along the row, slips to the right
    sliding.at = sliding.at._replace(v_y=-0.04)
    slip = math.atan2(0.04, 0.2)
    assert curvature_at(sliding) == pytest.approx(1.25 + 3.0 * slip, rel=1e-6)
    assert curvature_at(sliding, aligning=0.3) == pytest.approx(1.25, rel=1e-6)
    early = Placed(angle=math.pi - 0.3)  # 0.24 m before: it should be to the left, so that it asks for more
    early.at = early.at._replace(v_y=-0.04)
    aside, slope = aligning_path(0.24, 0.3)
    expected = 1.25 + 10.0 * slip * aside + 3.0 * slip * (1.0 - slope)
    assert curvature_at(early, aligning=0.3) == pytest.approx(expected, rel=1e-6)


def test_feed_forward_runs_ahead_of_the_end():
    late, early = Placed(angle=math.pi - 0.05), Placed(angle=math.pi - 0.05)
    assert curvature_at(late) == pytest.approx(1.25, rel=1e-6)
    assert curvature_at(early, lead=0.1) == pytest.approx(0.0, abs=1e-6)


def test_speeds_come_from_the_estimated_soil_or_from_kinematics():
    controller = PathTracker(ROBOT, PidGains(), 0.0, Placed(), lambda at, speed, curvature: (1.5, 0.1))
    np.testing.assert_allclose(controller(observation(), SENSED) * ROBOT.maximum_wheel_speed, [1.5, 0.1], rtol=1e-5)
    controller = PathTracker(ROBOT, PidGains(), 0.0, Placed(), lambda at, speed, curvature: None, track_ratio=1.4)
    found = controller(observation(), SENSED) * ROBOT.maximum_wheel_speed
    np.testing.assert_allclose(found, controller.bank_speeds(0.2, 1.25), rtol=1e-5)


def test_tracker_stands_first_and_starts_at_the_run_in():
    estimator = Placed()
    controller = PathTracker(ROBOT, PidGains(), 0.0, estimator, lambda at, speed, curvature: (1.0, 1.0), standing=3)
    for _ in range(2):
        actions = [controller(observation(), SENSED) for _ in range(4)]
        assert [bool(np.any(action)) for action in actions] == [False, False, False, True]
        controller.reset()
    assert estimator.started == [(-0.5, 0.0, 0.0)] * 2


def test_tracker_needs_the_samples_in_one_sentence():
    controller = PathTracker(ROBOT, PidGains(), 0.0, Placed(), lambda at, speed, curvature: None)
    with pytest.raises(InputError, match="samples"):
        controller(observation(), {"ending": 0})


@pytest.mark.parametrize("name", ["B6", "B6_flat"])
def test_trackers_see_no_truth_and_repeat_their_bits(name):
    settings = make_settings(randomisation=False, side="left", soil="thesis_a1")
    inner = find_controller(name, settings.draw(np.random.default_rng(0)).turn)

    class Blind:
        """Hands on what a robot has: its samples and its command."""

        def reset(self):
            inner.reset()

        def __call__(self, seen, info=None):
            return inner(seen, {key: info[key] for key in ("samples", "command")})

    runs = [drive_turn(Blind(), settings, 3), drive_turn(inner, settings, 3)]
    assert all(run.success for run in runs)
    for key, values in runs[0].columns.items():
        np.testing.assert_array_equal(values, runs[1].columns[key])
