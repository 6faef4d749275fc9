"""What a diagnosis needs of recordings, said before anything is computed, and what identifies them afterwards."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Sequence

import numpy as np

from ddagr_gym.diagnosis.setting import LEAST_WINDOWS, Setting, commanded_seconds, window_duration, windows_in
from ddagr_gym.errors import InputError, InputWarning
from ddagr_gym.identification.noise import too_few_to_measure
from ddagr_gym.identification.windows import PERIOD_TOLERANCE
from ddagr_gym.parameters import Robot
from ddagr_gym.presets import robot_option
from ddagr_gym.recordings.drive_requirements import check_rows
from ddagr_gym.recordings.schema import Recording

LEAST_SPEED = 0.02
"""Bank speed that counts as moving [rad/s] (ours: 5 mm/s at the rim of the thesis's robot)."""

LEAST_MOVING = 0.05
"""Share of the time in which a robot must be commanded to move (ours: 3 s of a drive of 60 s)."""


def content_hash(recording: Recording) -> str:
    """SHA-256 of the values, whatever file they came from."""
    digest = hashlib.sha256()
    for name, values in (*recording.columns().items(), ("command_valid", recording.command_valid.astype(float))):
        digest.update(name.encode())
        digest.update(np.ascontiguousarray(values, dtype=np.float64).tobytes())
    return digest.hexdigest()


def reading_hash(recording: Recording) -> str:
    """SHA-256 of the values and of how they were read: an answer depends on both."""
    meta = recording.meta
    read = (meta.source, meta.segments, meta.spans, sorted(meta.held.items()), meta.column_map)
    return hashlib.sha256(f"{content_hash(recording)}{read!r}".encode()).hexdigest()


def check_recordings(recordings: Sequence[Recording], robot: Robot, setting: Setting) -> None:
    """Refuse what cannot be diagnosed.

    Args:
        recordings: to be diagnosed together.
        robot: nominal.
        setting: of the diagnosis.

    Raises:
        InputError: none given, another robot, different periods, no commands or no sensors, too short, or a robot that
            stands still throughout, or one drive given twice.
    """
    if not recordings:
        raise InputError("no recording is given: name one or more files, or a folder of them.")
    for recording in recordings:
        _check_robot(recording, robot)
        _check_channels(recording)
    periods = [recording.period for recording in recordings]
    if np.ptp(periods) > PERIOD_TOLERANCE * periods[0]:
        rates = ", ".join(f"{r.meta.source} {1.0 / p:.3g} Hz" for r, p in zip(recordings, periods, strict=True))
        raise InputError(f"the recordings have different rates ({rates}): diagnose those of one rate together.")
    check_different(recordings)
    _check_length(recordings, setting)
    _check_motion(recordings)


def _check_robot(recording: Recording, robot: Robot) -> None:
    if recording.meta.robot not in ("", robot.name):
        raise InputError(
            f"{recording.meta.source} is a recording of the robot {recording.meta.robot!r}: "
            f"diagnose it with {robot_option(recording.meta.robot)}, and not together with one of {robot.name!r}."
        )


def _check_channels(recording: Recording) -> None:
    check_rows(recording, "a diagnosis")
    if not recording.has("command_right", "command_left"):
        raise InputError(
            f"{recording.meta.source} has no commands (command_right, command_left): "
            "without what the robot was commanded nothing can be predicted; name their columns in a --map."
        )
    sensors = (("yaw_rate",), ("encoder_right", "encoder_left"), ("pose_x", "pose_y"))
    if not any(recording.has(*names) for names in sensors):
        raise InputError(
            f"{recording.meta.source} has neither yaw_rate nor encoders nor poses: "
            "a diagnosis needs one of them; name their columns in a --map."
        )


def check_different(recordings: Sequence[Recording]) -> None:
    """Refuse drives that are there twice: they would be predicted by a model that was fitted to them.

    Raises:
        InputError: two recordings with the same values.
    """
    seen: dict[str, str] = {}
    for recording in recordings:
        values = content_hash(recording)
        if values in seen:
            raise InputError(f"{seen[values]} and {recording.meta.source} hold the same values: give every drive once.")
        seen[values] = recording.meta.source


def warn_of_unmeasured(recordings: Sequence[Recording]) -> None:
    """Warn of channels that are left out because they have too few samples to measure their noise."""
    few = too_few_to_measure(recordings)
    if not few:
        return
    names = " and ".join(r.meta.source for r in recordings if any(r.has(name) for name in few))
    counts = ", ".join(f"{name} ({count} samples)" for name, count in few.items())
    warnings.warn(
        f"{names}: {counts} without a gap in the other channels are too few to measure their noise, and left out of "
        "the fit: record these channels more often, or give longer drives.",
        InputWarning,
        stacklevel=3,
    )


def _check_length(recordings: Sequence[Recording], setting: Setting) -> None:
    duration = window_duration(recordings, setting)
    # segments are exactly one window long in logs that were cut into steps
    stretches = [seconds for recording in recordings for seconds in commanded_seconds(recording)]
    total, commanded = windows_in(stretches, duration), sum(stretches)
    if total < LEAST_WINDOWS:
        names = ", ".join(recording.meta.source for recording in recordings)
        raise InputError(
            f"{names}: {total} windows of {duration:g} s without a gap and with commands, which are known for "
            f"{commanded:.0f} s, are too few: give drives with commands for {LEAST_WINDOWS * duration:g} s at least."
        )


def moving_share(recording: Recording) -> float:
    """Share of the time with commands in which a robot is commanded to move."""
    speed = np.max(np.abs(np.stack(recording.held_commands())), axis=0)
    speed = speed[np.isfinite(speed)]
    return float(np.mean(speed > LEAST_SPEED)) if speed.size else 0.0


def _check_motion(recordings: Sequence[Recording]) -> None:
    shares = [moving_share(recording) for recording in recordings]
    if max(shares) < LEAST_MOVING:
        names = ", ".join(recording.meta.source for recording in recordings)
        raise InputError(
            f"{names}: the robot is commanded to stand still {100.0 * (1.0 - max(shares)):.0f} % of the time: "
            "record a drive with straight pieces and arcs to both sides."
        )
