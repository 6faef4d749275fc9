import math

import numpy as np
import pytest

from ddagr_gym.presets import get_robot
from ddagr_gym.rendering.camera import Camera
from ddagr_gym.rendering.ruts import SPACING, RutMap, contact_outline, prints_along
from ddagr_gym.rendering.scene import View

ROBOT = get_robot("ddagr")
CAMERA = Camera(View(-1.5, 2.5, -2.0, 2.0), 400, 400)


def arc(count=200, sinkage=0.015):
    angle = np.linspace(0.0, 2.0, count)
    track = np.column_stack([0.8 * np.sin(angle), 0.8 * (1 - np.cos(angle)), angle])
    return track, np.full((count, 4), sinkage)


def fresh():
    return RutMap(CAMERA, ROBOT, np.full((400, 400, 3), 180.0, np.float32))


def test_contact_is_the_cut_of_plane_and_torus():
    wheel = ROBOT.wheels[0]
    assert contact_outline(wheel, 0.0) == (0.0, 0.0)
    length, width = contact_outline(wheel, 0.01)
    assert length == pytest.approx(math.sqrt(0.2794**2 - 0.2694**2))
    assert width == pytest.approx(0.1016 * math.sqrt(1 - 0.8**2))
    assert contact_outline(wheel, 0.3) == contact_outline(wheel, wheel.minor_radius)
    assert contact_outline(wheel, 0.3)[1] == pytest.approx(0.1016)


def test_prints_have_equal_travel_and_do_not_change_when_the_track_grows():
    track, ruts = arc()
    whole = prints_along(track, ruts, 0.67)
    part = prints_along(track[:90], ruts[:90], 0.67)
    np.testing.assert_array_equal(part, whole[: len(part)])
    assert 0 < len(part) < len(whole)
    travel = np.hypot(*np.diff(whole[:, :2], axis=0).T) + 0.67 * np.diff(whole[:, 2])
    np.testing.assert_allclose(travel, SPACING, rtol=1e-3)
    still = prints_along(np.zeros((5, 3)), np.zeros((5, 4)), 0.67)
    assert len(still) == 1
    turning = np.column_stack([np.zeros(50), np.zeros(50), np.linspace(0, 3, 50)])
    assert len(prints_along(turning, np.zeros((50, 4)), 0.67)) == int(3 * 0.67 / SPACING) + 1


def test_picture_depends_on_the_track_and_not_on_its_history():
    track, ruts = arc()
    at_once, bit_by_bit = fresh(), fresh()
    at_once.update(track, ruts)
    for end in (1, 7, 40, 41, 120, 200):
        bit_by_bit.update(track[:end], ruts[:end])
    np.testing.assert_array_equal(at_once.image, bit_by_bit.image)
    assert at_once.update(track, ruts) == []
    bit_by_bit.update(-track, ruts)
    bit_by_bit.update(track, ruts)
    np.testing.assert_array_equal(at_once.image, bit_by_bit.image)


def test_only_the_reported_windows_change():
    track, ruts = arc()
    ground = fresh()
    ground.update(track[:100], ruts[:100])
    before = ground.image.copy()
    windows = ground.update(track[:110], ruts[:110])
    for window in windows:
        before[window] = ground.image[window]
    np.testing.assert_array_equal(before, ground.image)
    assert 0 < sum((w[0].stop - w[0].start) * (w[1].stop - w[1].start) for w in windows) < 0.2 * 400 * 400


def test_deeper_ruts_are_darker_and_wider():
    shallow, deep = fresh(), fresh()
    track = np.column_stack([np.linspace(0.0, 1.0, 50), np.zeros(50), np.zeros(50)])
    shallow.update(track, np.full((50, 4), 0.006))
    deep.update(track, np.full((50, 4), 0.03))
    column = int(CAMERA.pixels((0.8, 0.0))[0])
    row = int(CAMERA.pixels((0.0, 0.58))[1])
    assert shallow.image[row - 3 : row + 4, column].mean() < 170
    assert deep.image[row - 3 : row + 4, column].mean() < shallow.image[row - 3 : row + 4, column].mean() - 15
    dark = [np.count_nonzero(ground.image[row - 25 : row + 25, column, 0] < 165) for ground in (shallow, deep)]
    assert dark[1] > 1.4 * dark[0] > 0


def test_wheels_off_the_picture_are_left_out():
    ground = fresh()
    before = ground.image.copy()
    ground.update(np.array([[50.0, 50.0, 0.0], [51.0, 50.0, 0.0]]), np.full((2, 4), 0.02))
    np.testing.assert_array_equal(ground.image, before)
