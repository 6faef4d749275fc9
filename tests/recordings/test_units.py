from __future__ import annotations

import math

import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.units import channel_factor, factor


@pytest.mark.parametrize(
    ("quantity", "unit", "value"),
    [
        ("rad/s", "deg/s", math.pi / 180),
        ("rad/s", "rpm", 2 * math.pi / 60),
        ("m/s^2", "g", 9.80665),
        ("s", "ns", 1e-9),
        ("m", "km", 1000.0),
    ],
)
def test_factors(quantity, unit, value):
    assert factor(quantity, unit) == pytest.approx(value, rel=1e-12)


def test_rim_speed_becomes_wheel_speed():
    assert channel_factor("encoder_right", "m/s", wheel_radius=0.25) == pytest.approx(4.0)


def test_rim_speed_needs_the_radius():
    with pytest.raises(InputError, match="name the robot"):
        channel_factor("encoder_right", "m/s")


@pytest.mark.parametrize(("channel", "unit"), [("yaw_rate", "m/s"), ("pose_x", "deg"), ("roll", "furlong")])
def test_a_unit_of_another_quantity_is_refused(channel, unit):
    with pytest.raises(InputError, match=unit):
        channel_factor(channel, unit)
