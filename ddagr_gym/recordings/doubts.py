"""Values that are missing or implausible, in one sentence each: wrong units, degrees, gravity taken out."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.recordings.channels import CHANNELS
from ddagr_gym.recordings.heading_units import near, times_gyro
from ddagr_gym.recordings.plausible import SLOWEST_PERIOD, pauses, slow_rows

FASTEST_IN_MILLISECONDS = 0.2
"""Shortest time between rows that may be milliseconds taken for seconds [s] (ours): rows of 5 kHz."""


class Readings(Protocol):
    """What is asked of a recording: its time, and its channels, NaN where there is no sample."""

    def __len__(self) -> int: ...

    def __getitem__(self, channel: str) -> NDArray[np.float64]: ...

    @property
    def t(self) -> NDArray[np.float64]:
        """Time of the rows (N,) [s]."""
        ...

    def spans(self) -> Iterator[slice]:
        """Rows that share one clock."""
        ...

    @property
    def period(self) -> float:
        """Time between rows [s]."""
        ...

    @property
    def command_valid(self) -> NDArray[np.bool_]:
        """Rows with commands (N,)."""
        ...


def doubts(recording: Readings) -> Iterator[str]:
    """Sentences on values that are missing or implausible.

    Args:
        recording: any.
    """
    if not len(recording):
        yield "the recording holds no rows."
        return
    for name, channel in CHANNELS.items():
        values = recording[name]
        finite = np.abs(values[np.isfinite(values)])
        if not finite.size:
            if channel.core:
                yield f"{name} holds no samples: checks and diagnosis that need it will be left out."
            continue
        # A single wild sample is not a wrong unit: look at the hundredth-largest share.
        high = float(np.quantile(finite, 0.99))
        if high > channel.limit:
            yield (
                f"{name} reaches {high:.4g} {channel.unit}, beyond the {channel.limit:g} {channel.unit} of a ground "
                f"robot: check its unit in the column map{_unit_hint(channel.unit)}."
            )
    yield from slow_rows(recording.period)
    yield from pauses(recording.t, recording.spans())
    yield from _milliseconds(recording)
    yield from _degrees(recording)
    yield from _gravity(recording)
    if not recording.command_valid.any():
        yield "no row has valid commands: the recording can be checked but not replayed from commands."


def _unit_hint(unit: str) -> str:
    hints = {"rad/s": "deg/s", "rad": "deg", "m/s^2": "g", "m": "mm", "A": "mA", "V": "mV"}
    return f" ({hints[unit]}?)" if unit in hints else ""


def _milliseconds(recording: Readings) -> Iterator[str]:
    """Rows of 1 kHz and faster: milliseconds come as often as seconds of a slow log, and only the turns tell."""
    if not FASTEST_IN_MILLISECONDS < recording.period <= SLOWEST_PERIOD:
        return
    as_they_are, as_milliseconds = (_times_gyro(recording, unit) for unit in (1.0, 1e-3))
    if near(as_milliseconds, 1.0) and not near(as_they_are, 1.0):
        yield (
            f"rows come every {recording.period:.3g} s, and the heading turns as far as the gyro says only if it is in "
            "milliseconds: say unit: ms under time in the column map."
        )


def _times_gyro(recording: Readings, unit: float) -> float:
    """Change of the heading over that of the integrated gyro [-], a unit of time being ``unit`` seconds."""
    return times_gyro(unit * recording.t, recording["pose_yaw"], recording["yaw_rate"], recording.spans())


def _degrees(recording: Readings) -> Iterator[str]:
    yaw = recording["pose_yaw"][np.isfinite(recording["pose_yaw"])]
    if not yaw.size or np.max(np.abs(yaw)) < 7.0:
        return
    # Continuous radians grow by small steps; wrapped degrees jump by 360.
    jumps = np.max(np.abs(yaw)) <= 360.5 and np.any(np.abs(np.abs(np.diff(yaw)) - 360.0) < 20.0)
    ratio = _times_gyro(recording, 1.0)
    if jumps:
        yield f"pose_yaw jumps by 360 and reaches {np.max(np.abs(yaw)):.4g}: degrees? Say unit: deg in the map."
    elif near(ratio, math.degrees(1.0)):
        yield f"pose_yaw changes {ratio:.3g} times as much as the gyro turns: degrees? Say unit: deg in the map."


def _gravity(recording: Readings) -> Iterator[str]:
    z = recording["specific_force_z"]
    if not np.any(np.isfinite(z)):
        return
    middle = float(np.nanmedian(z))
    if abs(middle - 1.0) < 0.1 or abs(middle + 1.0) < 0.1:
        yield f"specific_force_z has the median {middle:.3g}: the accelerometer is in g; say unit: g in the map."
    elif abs(middle + 9.8) < 1.0:
        yield f"specific_force_z has the median {middle:.3g} m/s^2: z points down here; give the axes signs in the map."
    elif abs(middle) < 1.0:
        yield f"specific_force_z has the median {middle:.3g} m/s^2: gravity was taken out; the schema wants it in."
