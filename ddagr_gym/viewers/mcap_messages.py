"""What the topics of an MCAP file share: messages in the order of time, and their stamps."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from ddagr_gym.viewers.drive_traces import DriveTraces

if TYPE_CHECKING:
    from foxglove import messages

WORLD = "world"
"""Frame of the poses; the robot's frames are ``base_link_measured`` and one for each model."""

Message = tuple[int, int, Callable[[int], None]]
"""Time [ns], order among equal times, and the function that logs the message at that time."""


def nanoseconds(drive: DriveTraces, time: float) -> int:
    """Stamp of a time of a recording [s]; clocks are known to a microsecond, as far as a float tells today's."""
    return round(drive.stamp * 1e6) * 1000 + round(time * 1e9)


def timestamp(ns: int) -> messages.Timestamp:
    """Time of a message from its stamp [ns]."""
    from foxglove.messages import Timestamp

    return Timestamp(sec=ns // 10**9, nsec=ns % 10**9)
