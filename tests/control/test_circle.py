import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddagr_gym.control.circle import running_radius, taubin_circle, turn_window
from ddagr_gym.errors import InputError


def arc(radius, start, end, count=200, centre=(0.0, 0.0)):
    angle = np.linspace(start, end, count)
    return centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)


def kasa_radius(x, y):
    """The plain algebraic fit, biased towards small circles on short arcs: the contrast, not a metric."""
    (a, b, c), *_ = np.linalg.lstsq(np.column_stack([x, y, np.ones_like(x)]), x * x + y * y)
    return math.sqrt(c + a * a / 4 + b * b / 4)


@given(st.floats(1e-3, 1e3), st.floats(-100, 100), st.floats(-100, 100), st.floats(0, 6), st.floats(0.5, 6.0))
def test_exact_points_give_the_circle(radius, x, y, start, span):
    fit = taubin_circle(*arc(radius, start, start + span, 60, (x, y)))
    size = 1e-9 * (radius + abs(x) + abs(y)) * (1 + (abs(x) + abs(y)) / radius) + 1e-12
    assert fit.radius == pytest.approx(radius, abs=size * 1e3)
    assert (fit.x, fit.y) == pytest.approx((x, y), abs=size * 1e3)
    assert fit.residual < size * 1e3


def test_taubin_is_nearly_unbiased_where_kasa_is_not():
    """Means over 400 arcs of 120 degrees, radius 0.8 m, with noise of 2 cm: Kasa's radius is 1.2 cm small."""
    rng = np.random.default_rng(1)
    x, y = arc(0.8, 0.0, math.radians(120), 60)
    noisy = [(x + rng.normal(0, 0.02, x.shape), y + rng.normal(0, 0.02, x.shape)) for _ in range(400)]
    taubin = np.array([taubin_circle(*pair).radius for pair in noisy])
    kasa = np.array([kasa_radius(*pair) for pair in noisy])
    error = taubin.std() / math.sqrt(len(taubin))
    assert abs(taubin.mean() - 0.8) < 0.001 + 3 * error
    assert kasa.mean() - 0.8 < -0.010


def test_residual_is_the_radial_noise():
    rng = np.random.default_rng(2)
    x, y = arc(0.8, 0.0, 2.5, 4000)
    fit = taubin_circle(x + rng.normal(0, 0.01, x.shape), y + rng.normal(0, 0.01, y.shape))
    assert fit.residual == pytest.approx(0.01, rel=0.05)


@pytest.mark.parametrize(
    "points",
    [
        ([0.0, 1.0], [0.0, 1.0]),
        (np.linspace(0, 1, 30), np.linspace(0, 2, 30)),
        (np.full(10, 3.0), np.full(10, 4.0)),
        ([0.0, 1.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0]),
    ],
    ids=["two points", "line", "one point", "two places"],
)
def test_points_without_a_circle_give_none(points):
    assert taubin_circle(*points) is None


@pytest.mark.parametrize("side", ["left", "right"])
def test_window_runs_from_30_to_150_degrees(side):
    degrees = np.arange(0, 181)
    yaw = np.radians(degrees) * (1 if side == "left" else -1)
    window, largest = turn_window(np.arctan2(np.sin(yaw), np.cos(yaw)), side)
    assert degrees[window][0] in (30, 31)
    assert degrees[window][-1] in (149, 150)
    assert largest == pytest.approx(math.pi)
    assert turn_window(yaw, "left" if side == "right" else "right") == (None, 0.0)


def test_running_radius_waits_for_an_arc():
    angle = np.radians(np.arange(0, 60.0, 0.5))
    x, y = 0.8 * np.sin(angle), 0.8 * (1 - np.cos(angle))
    assert running_radius(x[:90], y[:90], angle[:90], "left") is None
    assert running_radius(x, y, angle, "left") == pytest.approx(0.8)
    assert running_radius(x, y, angle, "right") is None


@pytest.mark.parametrize("yaw", [[], [0.0, math.nan], [[0.0]]])
def test_window_refuses_gaps(yaw):
    with pytest.raises(InputError, match="yaw has shape"):
        turn_window(yaw, "left")
