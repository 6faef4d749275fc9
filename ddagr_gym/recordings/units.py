"""Units that recordings come in, as factors to SI.

A unit belongs to one quantity, so that a column map cannot turn degrees into metres by mistake.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.parameters import STANDARD_GRAVITY
from ddagr_gym.recordings.channels import CHANNELS

FACTORS: Mapping[str, Mapping[str, float]] = {
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    "rad/s": {"rad/s": 1.0, "deg/s": math.radians(1.0), "rev/s": 2 * math.pi, "rpm": 2 * math.pi / 60},
    "m/s": {"m/s": 1.0, "km/h": 1 / 3.6, "mm/s": 1e-3},
    "m/s^2": {"m/s^2": 1.0, "g": STANDARD_GRAVITY, "mg": STANDARD_GRAVITY * 1e-3},
    "rad": {"rad": 1.0, "deg": math.radians(1.0)},
    "m": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "km": 1e3},
    "A": {"A": 1.0, "mA": 1e-3},
    "V": {"V": 1.0, "mV": 1e-3},
}
"""Factor to SI by SI unit and written unit."""

WHEEL_CHANNELS = ("command_right", "command_left", "encoder_right", "encoder_left")


def factor(quantity: str, unit: str) -> float:
    """Factor from ``unit`` to the SI unit ``quantity``.

    Raises:
        InputError: the unit is not one of that quantity.
    """
    if unit not in FACTORS[quantity]:
        raise unknown_name(f"unit of a quantity in {quantity}", unit, FACTORS[quantity])
    return FACTORS[quantity][unit]


def channel_factor(channel: str, unit: str, wheel_radius: float | None = None) -> float:
    """Factor from ``unit`` to the channel's SI unit; wheel speeds may be rim speeds in m/s.

    Args:
        channel: name in the schema.
        unit: as written in a map; "" for SI.
        wheel_radius: hub to tread [m], for rim speeds.

    Raises:
        InputError: wrong unit, or a rim speed without a wheel radius.
    """
    if not unit:
        return 1.0
    if channel in WHEEL_CHANNELS and unit in FACTORS["m/s"]:
        if wheel_radius is None:
            raise InputError(f"{channel} is given as a rim speed in {unit}: name the robot to convert it to rad/s.")
        return FACTORS["m/s"][unit] / wheel_radius
    return factor(CHANNELS[channel].unit, unit)


def check_channel_unit(channel: str, unit: str) -> None:
    """Raise :class:`InputError` for a unit that the channel cannot have."""
    channel_factor(channel, unit, wheel_radius=1.0)
