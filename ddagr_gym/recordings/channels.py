"""The channels that a recording may hold, with their units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Channel:
    """One column of the schema.

    Attributes:
        unit: SI unit.
        description: what it holds.
        limit: largest magnitude that a ground robot's sensor gives [unit]; beyond it the unit is in doubt.
        core: whether the checks and the diagnosis need it.
    """

    unit: str
    description: str
    limit: float
    core: bool = True


CHANNELS: Mapping[str, Channel] = {
    "command_right": Channel("rad/s", "right bank speed command", 200.0),
    "command_left": Channel("rad/s", "left bank speed command", 200.0),
    "encoder_right": Channel("rad/s", "right bank speed, forward positive", 200.0),
    "encoder_left": Channel("rad/s", "left bank speed, forward positive", 200.0),
    "specific_force_x": Channel("m/s^2", "raw accelerometer, forward", 320.0),
    "specific_force_y": Channel("m/s^2", "raw accelerometer, to the left", 320.0),
    "specific_force_z": Channel("m/s^2", "raw accelerometer, up; gravity included", 320.0, core=False),
    "yaw_rate": Channel("rad/s", "gyro about z, counter-clockwise", 10.0),
    "roll": Channel("rad", "attitude about x", 1.6, core=False),
    "pitch": Channel("rad", "attitude about y, nose down positive", 1.6, core=False),
    "pose_x": Channel("m", "position in the span's frame", 1e7, core=False),
    "pose_y": Channel("m", "position in the span's frame", 1e7, core=False),
    "pose_yaw": Channel("rad", "heading in the span's frame", 1e3, core=False),
    "current_right": Channel("A", "right motors' current, or what they draw from the supply", 2000.0, core=False),
    "current_left": Channel("A", "left motors' current, or what they draw from the supply", 2000.0, core=False),
    "voltage_right": Channel("V", "supply voltage of the right motors", 1000.0, core=False),
    "voltage_left": Channel("V", "supply voltage of the left motors", 1000.0, core=False),
    "battery_voltage": Channel("V", "voltage of the battery", 1000.0, core=False),
}
"""The channels of the schema by name, in the order in which files hold them."""

COMMANDS = ("command_right", "command_left")
CURRENTS = ("current_right", "current_left")
VOLTAGES = ("voltage_right", "voltage_left", "battery_voltage")
