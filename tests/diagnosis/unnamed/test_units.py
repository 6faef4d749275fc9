"""Dimension algebra of the regressors."""

import numpy as np
import pytest

from ddagr_gym.diagnosis.unnamed.units import (
    ACCELERATION,
    METRE,
    NEWTON,
    NEWTON_METRE,
    NUMBER,
    RADIAN,
    SECOND,
    SPEED,
    TURN_RATE,
    Signal,
)
from ddagr_gym.errors import InputError

ONES = np.ones(3)


@pytest.mark.parametrize(
    ("unit", "text"),
    [
        (NUMBER, "-"),
        (NEWTON, "N"),
        (NEWTON / SPEED, "N s/m"),
        (NEWTON / ACCELERATION, "kg"),
        (NEWTON_METRE / TURN_RATE, "N m s/rad"),
        (NEWTON / (SPEED * SPEED), "kg/m"),
        (ACCELERATION, "m/s^2"),
        (TURN_RATE / TURN_RATE, "-"),
        (NUMBER / SECOND, "1/s"),
        (TURN_RATE / NEWTON_METRE, "rad/(N m s)"),
    ],
)
def test_units_read_as_people_write_them(unit, text):
    assert str(unit) == text


def test_only_like_quantities_add():
    with pytest.raises(InputError, match="only like quantities"):
        Signal("v_x", ONES, SPEED) + Signal("r", ONES, TURN_RATE)
    # a rim speed is a radius times a turn rate: radians are pure numbers
    rim = Signal("R", ONES, METRE) * Signal("w", 2.0 * ONES, TURN_RATE)
    assert (rim - Signal("v_x", ONES, SPEED)).values.tolist() == [1.0, 1.0, 1.0]


def test_functions_take_pure_numbers():
    with pytest.raises(InputError, match="argument has the unit m"):
        Signal("x", ONES, METRE).of_number("sin")
    angle = Signal("yaw", np.array([0.0, np.pi / 2]), RADIAN)
    twice = angle.of_number("cos", 2.0)
    assert twice.name == "cos(2 yaw)"
    np.testing.assert_allclose(twice.values, [1.0, -1.0], atol=1e-12)
    assert Signal("t", ONES, SECOND).decay(30.0).name == "exp(-|t|/30 s)"
