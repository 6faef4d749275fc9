"""Slope of a ground from accelerometers: found with its size, and none where there is none or nothing tells it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_robots import drive
from ddagr_gym.calibration.ground_slopes import QUARTERS, Readings, readings_of, slope_from, slopes_of
from ddagr_gym.identification.windows import cut_windows
from ddagr_gym.parameters import STANDARD_GRAVITY
from ddagr_gym.physics.effects.slope import Slope
from ddagr_gym.presets import get_robot

ROBOT = get_robot("ddagr")
SLOPING = "slope=0.05,direction=0.8"


def cut(recordings):
    return cut_windows(
        recordings, 4.0, wheel_radius=ROBOT.outer_radius, half_track=ROBOT.half_track, history=0.6
    )  # fmt: skip


@pytest.fixture(scope="module")
def sloping():
    return [drive("field", seed, 60.0, effects=(SLOPING,)) for seed in (1, 2)]


def test_the_slope_of_a_ground_is_found_beside_another_ones(sloping):
    drives = [*sloping, drive("track", 3, 60.0)]
    found = slopes_of(drives, cut(drives), {"field": (0, 1), "track": (2,)}, ROBOT.outer_radius)
    assert set(found) == {"field"}
    assert found["field"].gradient == pytest.approx(Slope(0.05, 0.8).gradient, abs=5e-4)
    assert max(found["field"].deviations) < 0.006


@pytest.mark.parametrize(
    "effect", ["accelerometer_bias=0.3", "imu_tilt=0.05", "imu_misalignment=0.2", "imu_lever_arm=0.4", "soil_split=0.7"]
)
def test_what_turns_with_the_robot_is_no_slope(effect):
    drives = [drive("field", seed, 60.0, effects=(effect,)) for seed in (1, 2)]
    assert slopes_of(drives, cut(drives), {"field": (0, 1)}, ROBOT.outer_radius) == {}


def test_a_bias_of_each_drive_stays_apart(sloping):
    drives = [drive("field", 1, 60.0, effects=(SLOPING, "accelerometer_bias=0.3")), sloping[1]]
    found = slopes_of(drives, cut(drives), {"field": (0, 1)}, ROBOT.outer_radius)
    assert found["field"].gradient == pytest.approx(Slope(0.05, 0.8).gradient, abs=5e-4)


def test_drives_without_headings_tell_none(sloping):
    blind = replace(
        sloping[0], channels={name: v for name, v in sloping[0].channels.items() if not name.startswith("pose")}
    )
    drives = [blind, sloping[1]]
    assert slopes_of(drives, cut(drives), {"field": (0, 1)}, ROBOT.outer_radius) == {}


def test_a_slope_too_small_to_matter_is_none():
    drives = [drive("field", 1, 60.0, effects=("slope=0.004",))]
    assert slopes_of(drives, cut(drives), {"field": (0,)}, ROBOT.outer_radius) == {}


def test_readings_without_an_accelerometer_say_nothing(sloping):
    without = replace(
        sloping[0], channels={n: v for n, v in sloping[0].channels.items() if not n.startswith("specific")}
    )
    assert slope_from(readings_of(cut([without]), ROBOT.outer_radius)) is None


def _made(gradient, parts, noise, rng, count=50):
    """Readings in every direction, whose parts have slopes of their own besides."""
    n = QUARTERS * count
    heading = rng.uniform(-np.pi, np.pi, n)
    part = np.repeat(np.arange(QUARTERS), count)
    x, y = (np.array(gradient)[:, None] + np.array(parts)[part].T) * STANDARD_GRAVITY
    cosine, sine = np.cos(heading), np.sin(heading)
    force = np.stack([cosine * x + sine * y, cosine * y - sine * x], axis=1) + noise * rng.normal(size=(n, 2))
    return Readings(force, heading, np.zeros(n, dtype=np.int64), part)


def test_what_differs_from_quarter_to_quarter_is_no_slope():
    rng = np.random.default_rng(4)
    steady = _made((0.02, 0.0), np.zeros((4, 2)), 0.1, rng)
    assert slope_from(steady).gradient[0] == pytest.approx(0.02, abs=0.002)
    hills = np.array([[0.06, 0.0], [-0.03, 0.04], [0.05, -0.05], [0.0, 0.01]])
    assert slope_from(_made((0.0, 0.0), hills, 0.1, rng)) is None


def test_level_ground_passes_for_a_slope_in_one_of_a_hundred():
    """Quarters of slopes that differ by chance: the test keeps its level."""
    rng = np.random.default_rng(5)
    found = [slope_from(_made((0.0, 0.0), 0.03 * rng.normal(size=(4, 2)), 0.02, rng)) for _ in range(400)]
    assert sum(item is not None for item in found) / 400.0 < 0.03


def test_single_readings_that_are_far_off_do_not_bend_it():
    rng = np.random.default_rng(6)
    readings = _made((0.03, -0.02), np.zeros((4, 2)), 0.05, rng)
    readings.force[::20] += 8.0
    assert slope_from(readings).gradient == pytest.approx((0.03, -0.02), abs=0.003)
