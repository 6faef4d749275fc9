"""Faults of wiring, mounting and clocks, written into recordings by arithmetic on their columns.

They share no code with the checks that look for them (:mod:`benchmarks.check_faults`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ddagr_gym.recordings.schema import Recording

Array = npt.NDArray[np.float64]

ENCODERS = ("encoder_right", "encoder_left")
COMMANDS = ("command_right", "command_left")
POSE = ("pose_x", "pose_y", "pose_yaw")
IMU = ("specific_force_x", "specific_force_y", "specific_force_z", "yaw_rate")

DRIFT = 0.6
"""Change of a clock along the drive [s]: a tenth of a percent in ten minutes, a clock that is set by messages."""
CAPPED = 0.45
"""Speed at which banks are capped over the fastest command: a governor, a battery that is nearly empty."""


@dataclass(frozen=True)
class Fault:
    """What is written.

    Attributes:
        write: gives the faulty recording.
        words: all of which one sentence has to hold; none where nothing is wrong.
    """

    write: Callable[[Recording], Recording]
    words: tuple[str, ...]


def changed(recording: Recording, channels: Mapping[str, Array]) -> Recording:
    """Copy with some channels replaced."""
    return replace(recording, channels={**recording.channels, **channels})


def scaled(recording: Recording, names: Sequence[str], factor: float) -> Recording:
    """Channels times a factor."""
    return changed(recording, {name: factor * recording[name] for name in names})


def exchanged(recording: Recording, one: str, other: str) -> Recording:
    """Two channels in each other's place."""
    return changed(recording, {one: recording[other], other: recording[one]})


def turned(recording: Recording, axes: Sequence[Sequence[int]]) -> Recording:
    """Readings of an IMU whose axes (rows) point along these directions of the robot; its gyro shows the third axis."""
    rotation = np.array(axes, dtype=np.float64)
    force = rotation @ np.stack([recording[name] for name in IMU[:3]])
    upright = rotation[2, 2]
    # Roll and pitch rates are not recorded; a gyro that lies on its side shows about nothing but noise.
    noise = np.random.default_rng(0).normal(0.0, 0.01, len(recording))
    gyro = upright * recording["yaw_rate"] + (noise if upright == 0 else 0.0)
    return changed(recording, dict(zip(IMU, [*force, gyro], strict=True)))


def drifting(recording: Recording, names: Sequence[str], seconds: float) -> Recording:
    """Channels whose stamps come later and later, by -seconds/2 at the beginning and seconds/2 at the end."""
    t, moved = recording.t, {}
    for name in names:
        new = np.full(len(recording), np.nan)
        for span in recording.spans():
            rows = span.start + np.flatnonzero(np.isfinite(recording[name][span]))
            stamp = t[rows] + seconds * ((t[rows] - t[0]) / (t[-1] - t[0]) - 0.5)
            at = span.start + np.searchsorted(t[span], stamp - 0.5 * recording.period)
            inside = (at > span.start) & (at < span.stop)
            new[at[inside]] = recording[name][rows[inside]]
        moved[name] = new
    return changed(recording, moved)


def stuck(recording: Recording, name: str) -> Recording:
    """A channel that stays at its first reading."""
    values = recording[name]
    first = float(values[np.isfinite(values)][0])
    return changed(recording, {name: np.where(np.isfinite(values), first, np.nan)})


def capped(recording: Recording) -> Recording:
    """Banks that cannot go faster than a share of the fastest command."""
    limit = CAPPED * float(np.nanmax(np.abs(np.stack([recording[name] for name in COMMANDS]))))
    return changed(recording, {name: np.clip(recording[name], -limit, limit) for name in ENCODERS})


def reversed_pose(recording: Recording) -> Recording:
    """A pose in a frame whose z axis points down, seen from above: y and heading reversed."""
    return scaled(recording, ("pose_y", "pose_yaw"), -1.0)


FAULTS: Mapping[str, Fault] = {
    "nothing": Fault(lambda r: r, ()),
    "gyro reversed": Fault(lambda r: scaled(r, ("yaw_rate",), -1.0), ("the gyro goes against",)),
    "heading reversed": Fault(lambda r: scaled(r, ("pose_yaw",), -1.0), ("the heading goes against",)),
    "pose with z down": Fault(reversed_pose, ("the heading goes against",)),
    "path mirrored": Fault(lambda r: scaled(r, ("pose_y",), -1.0), ("the path goes against",)),
    "encoders exchanged": Fault(
        lambda r: exchanged(r, *ENCODERS), ("encoder_right", "It moves as the left wheels do: ")
    ),
    "commands exchanged": Fault(
        lambda r: exchanged(r, *COMMANDS), ("command_right", "It moves as the left wheels do: ")
    ),
    "right encoder reversed": Fault(
        lambda r: scaled(r, ENCODERS[:1], -1.0), ("encoder_right", "moves as the right wheels do, but counts backwards")
    ),
    "both encoders reversed": Fault(
        lambda r: scaled(r, ENCODERS, -1.0), ("encoder_left", "moves as the left wheels do, but counts backwards")
    ),
    "IMU turned by 90 degrees": Fault(
        lambda r: turned(r, ((0, 1, 0), (-1, 0, 0), (0, 0, 1))),
        ("turned by 90 degrees about the vertical to the left",),
    ),
    "IMU turned by 270 degrees": Fault(
        lambda r: turned(r, ((0, -1, 0), (1, 0, 0), (0, 0, 1))),
        ("turned by 90 degrees about the vertical to the right",),
    ),
    "IMU turned by 180 degrees": Fault(
        lambda r: turned(r, ((-1, 0, 0), (0, -1, 0), (0, 0, 1))), ("turned by 180 degrees about the vertical",)
    ),
    "IMU upside down, rolled": Fault(
        lambda r: turned(r, ((1, 0, 0), (0, -1, 0), (0, 0, -1))), ("upside down (rolled over)",)
    ),
    "IMU upside down, pitched": Fault(
        lambda r: turned(r, ((-1, 0, 0), (0, 1, 0), (0, 0, -1))), ("upside down (pitched over)",)
    ),
    "IMU on its side": Fault(lambda r: turned(r, ((1, 0, 0), (0, 0, 1), (0, -1, 0))), ("on its side",)),
    "sideways axis reversed": Fault(
        lambda r: scaled(r, IMU[1:2], -1.0), ("imu_mounting", "specific_force_y has the wrong sign")
    ),
    "right encoder stuck": Fault(lambda r: stuck(r, ENCODERS[0]), ("stuck, encoder_right",)),
    "gyro and encoders": Fault(
        lambda r: exchanged(scaled(r, ("yaw_rate",), -1.0), *ENCODERS),
        ("encoder_right", "It moves as the left wheels do: "),
    ),
    "wheels capped": Fault(capped, ("bank stops at",)),
    "encoder clock drifts": Fault(lambda r: drifting(r, ENCODERS, DRIFT), ("The clock of", "the encoders")),
    "pose clock drifts": Fault(lambda r: drifting(r, POSE, DRIFT), ("The clock of", "the pose")),
    "IMU clock drifts": Fault(lambda r: drifting(r, IMU, DRIFT), ("The clock of", "the gyro")),
}
"""By name; words are those of the sentence that names the fault."""
