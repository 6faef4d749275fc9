"""Names for readings that belong to other channels than the map says; they are no effects of the library."""

from __future__ import annotations

CHANNEL_FAULT_TITLES = {
    "encoders_exchanged": "exchanged encoders",
    "encoders_reversed": "encoders that count backwards",
    "commands_exchanged": "exchanged commands",
    "commands_reversed": "commands that count backwards",
    "imu_upside_down": "IMU upside down",
    "heading_reversed": "reversed heading of the pose",
    "path_mirrored": "mirrored path of the pose",
}
"""Titles by the name that a verdict uses."""
