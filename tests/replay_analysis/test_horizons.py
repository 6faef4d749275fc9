from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.replay_analysis.horizons import METRICS, heading_growth, horizon_errors, integrated, start_headings
from ddagr_gym.replay_analysis.kinematic import KinematicModel

GYRO, YAW = CHANNELS.index("yaw_rate"), CHANNELS.index("pose_yaw")
POSE = [CHANNELS.index(name) for name in ("pose_x", "pose_y", "pose_yaw")]


@pytest.fixture(scope="module")
def judged(make_windows):
    """Two windows of 5 s on a circle, measured without error, and the prediction of them."""
    windows = make_windows(np.broadcast_to([3.0, 2.0], (2, 120, 2)).copy())
    exact = KinematicModel(0.25, 0.5).predict(windows)
    return replace(windows, measured=exact.copy()), exact


def test_a_perfect_prediction_has_no_error(judged):
    windows, exact = judged
    errors = horizon_errors(windows, exact)
    assert set(errors) == set(METRICS)
    for values in errors.values():
        np.testing.assert_allclose(values, 0.0, atol=1e-9)


def test_a_constant_yaw_rate_error_grows_with_time(judged):
    windows, exact = judged
    wrong = exact.copy()
    wrong[..., GYRO] += 0.02
    errors = horizon_errors(windows, wrong)
    np.testing.assert_allclose(errors["heading"], 0.02 * 5.0)
    np.testing.assert_allclose(errors["yaw_rate"], 0.02)
    np.testing.assert_allclose(heading_growth(windows, wrong), 0.02 * 0.05 * np.arange(1, 101))


def test_position_error_is_the_distance_at_the_end(judged):
    windows, exact = judged
    wrong = exact.copy()
    wrong[..., POSE[0]] += np.linspace(0.0, 0.3, 100)
    wrong[..., POSE[1]] += np.linspace(0.0, 0.4, 100)
    np.testing.assert_allclose(horizon_errors(windows, wrong)["position"], 0.5)


def test_a_wrong_first_heading_of_the_pose_is_no_error(judged):
    windows, exact = judged
    turned = exact.copy()
    angle = 0.4
    c, s = np.cos(angle), np.sin(angle)
    turned[..., POSE[0]] = c * exact[..., POSE[0]] - s * exact[..., POSE[1]]
    turned[..., POSE[1]] = s * exact[..., POSE[0]] + c * exact[..., POSE[1]]
    turned[..., YAW] += angle
    measured = replace(windows, measured=turned)
    np.testing.assert_allclose(start_headings(measured), angle, atol=1e-9)
    errors = horizon_errors(measured, exact)
    np.testing.assert_allclose(errors["position"], 0.0, atol=1e-9)
    np.testing.assert_allclose(errors["heading_pose"], 0.0, atol=1e-9)


def test_speed_error_is_of_the_last_second(judged):
    windows, exact = judged
    slower = exact.copy()
    slower[..., POSE[0]] *= 0.9
    slower[..., POSE[1]] *= 0.9
    # a tenth of the chord of one second at 0.625 m/s and 0.25 rad/s
    chord = 2.0 * 0.625 / 0.25 * np.sin(0.125)
    np.testing.assert_allclose(horizon_errors(windows, slower)["speed"], -0.1 * chord, rtol=1e-3)


def test_what_nothing_measures_is_nan(judged):
    windows, exact = judged
    blind = replace(windows, measured=np.full_like(exact, np.nan))
    assert all(np.isnan(values).all() for values in horizon_errors(blind, exact).values())
    assert np.isnan(heading_growth(blind, exact)).all()


def test_a_pose_that_ends_early_judges_nothing(judged):
    windows, exact = judged
    measured = exact.copy()
    measured[0, 60:, POSE[0]] = np.nan
    errors = horizon_errors(replace(windows, measured=measured), exact)
    assert np.isnan(errors["position"][0])
    assert errors["position"][1] == pytest.approx(0.0, abs=1e-9)


def test_between_the_samples_of_a_gyro_its_rate_changes_evenly(judged):
    rate = np.tile(np.linspace(0.0, 0.2, 100), (3, 1))
    rate[0, 3:9] = np.nan
    rate[1, 3:30] = np.nan
    found = integrated(rate, 0.05)
    assert found[[0, 2]] == pytest.approx([0.5, 0.5])
    assert np.isnan(found[1])
    windows, exact = judged
    wrong = exact.copy()
    wrong[..., GYRO] += 0.02
    measured = exact.copy()
    measured[:, ::2, GYRO] = np.nan  # a gyro of half the rate
    slow = replace(windows, measured=measured)
    np.testing.assert_allclose(horizon_errors(slow, wrong)["heading"], 0.02 * 5.0)
    np.testing.assert_allclose(heading_growth(slow, wrong)[-1], 0.02 * 5.0)


@pytest.mark.parametrize("backwards", [False, True])
def test_fixes_without_headings_are_followed_in_their_course(make_windows, backwards):
    """The path turns as the fixes do, and whoever goes astray is as far from them as beside poses with headings."""
    speeds = np.array([3.0, 2.0]) * (-1.0 if backwards else 1.0)
    windows = make_windows(np.broadcast_to(speeds, (2, 120, 2)).copy())
    exact = KinematicModel(0.25, 0.5).predict(windows)
    angle = 2.0
    measured = exact.copy()
    measured[..., POSE[0]] = np.cos(angle) * exact[..., POSE[0]] - np.sin(angle) * exact[..., POSE[1]]
    measured[..., POSE[1]] = np.sin(angle) * exact[..., POSE[0]] + np.cos(angle) * exact[..., POSE[1]]
    measured[..., YAW] = np.nan
    fixes = replace(windows, measured=measured)
    np.testing.assert_allclose(start_headings(fixes), angle, atol=2e-3)
    np.testing.assert_allclose(horizon_errors(fixes, exact)["position"], 0.0, atol=0.01)
    wrong = exact.copy()
    wrong[..., POSE[0]] += np.linspace(0.0, 0.3, 100)
    assert horizon_errors(fixes, wrong)["position"] == pytest.approx([0.3, 0.3], abs=0.01)
    standing = replace(fixes, measured=np.where(np.isnan(measured), np.nan, measured[:, :1]))
    assert np.isnan(horizon_errors(standing, exact)["position"]).all()
