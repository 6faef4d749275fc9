"""What a calibration needs of drives, said before anything is fitted."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass

import numpy as np

from ddagr_gym.diagnosis.answer.amounts import amounts
from ddagr_gym.diagnosis.change.requirements import NEEDED
from ddagr_gym.diagnosis.preprocessing.channel_faults import find_channel_faults
from ddagr_gym.diagnosis.preprocessing.input_requirements import LEAST_SPEED, check_different
from ddagr_gym.diagnosis.preprocessing.reversed_gyro import with_gyro_reversed
from ddagr_gym.diagnosis.wording import describe
from ddagr_gym.errors import InputError
from ddagr_gym.identification.windows import PERIOD_TOLERANCE
from ddagr_gym.parameters import Robot
from ddagr_gym.presets import robot_option
from ddagr_gym.recordings.checks.travel import TRAVEL, rolled_and_travelled, share_with_least_slip, travelled_shares
from ddagr_gym.recordings.checks.turning import TRACK, effective_track, gyro_against_pose, track_in_turns
from ddagr_gym.recordings.drive_requirements import check_rows
from ddagr_gym.recordings.schema import Recording

SHORTEST_DRIVE = 60.0
"""Time under command that a drive must have [s] (ours): ten windows of 6 s."""

LEAST_MOVING = 0.1
"""Share of that time in which the robot must be commanded to move (ours)."""

LEAST_TRAVEL = 0.85
"""Least travelled over rolled distance where an ordinary drive slips least [-] (ours): 1.01 to 1.12 in six real ones,
whose mean is 0.83 to 0.93."""

PUSHED = TRAVEL.expected[1] - 1.0
"""Mean travelled beyond rolled distance that readings explain [-]: that of ``ddagr check``."""

LIKELY_DEVIATIONS = 3.0
"""Deviations of the data sheet by which a radius or a track may be off."""

WIDEST_TRACK = TRACK.expected[1]
"""Largest effective over geometric track [-]: that of ``ddagr check``."""

TWO_ROBOTS = 1.35
"""Ratio between two drives of travelled over rolled distance, where they slip least, above which they are of two robots
(ours): 1.11 at most between six ordinary drives on asphalt, grass, gravel and sand."""


@dataclass(frozen=True)
class DriveScale:
    """What the sensors of one drive say about the robot's size.

    Attributes:
        travel: travelled over rolled distance [-]; None without poses or motion.
        rolling: the same where the drive slips least, which is near 1 on any ground [-]; None without such windows.
        track: effective over geometric track [-]; None without turns.
        track_interval: of that one, 99 %; everything where it is not known.
    """

    travel: float | None
    rolling: float | None
    track: float | None
    track_interval: tuple[float, float]


def check_drives(recordings: Sequence[Recording], robot: Robot) -> None:
    """Refuse drives from which nothing can be calibrated.

    Args:
        recordings: to be calibrated together.
        robot: of the data sheet.

    Raises:
        InputError: none given, one given twice, another robot, missing channels, different rates, a drive that is too
            short or stands still.
    """
    if not recordings:
        raise InputError("no ordinary drive is given: name one or more recordings of the robot as it should be.")
    for recording in recordings:
        _check_robot(recording, robot)
        check_rows(recording, "a calibration")
        _check_channels(recording)
        _check_length(recording)
    check_different(recordings)
    periods = [recording.period for recording in recordings]
    if np.ptp(periods) > PERIOD_TOLERANCE * periods[0]:
        rates = ", ".join(f"{r.meta.source} {1.0 / p:.3g} Hz" for r, p in zip(recordings, periods, strict=True))
        raise InputError(f"the drives have different rates ({rates}): calibrate with those of one rate.")


def _check_robot(recording: Recording, robot: Robot) -> None:
    if recording.meta.robot not in ("", robot.name):
        raise InputError(
            f"{recording.meta.source} is a drive of the robot {recording.meta.robot!r}: "
            f"calibrate one robot at a time, this one with {robot_option(recording.meta.robot)}."
        )


def _check_channels(recording: Recording) -> None:
    absent = [name for name in NEEDED if not recording.has(name)]
    if absent:
        raise InputError(
            f"{recording.meta.source} has no {', '.join(absent)}: a calibration needs commands, encoders and the gyro; "
            "name their columns in a --map."
        )


def _check_length(recording: Recording) -> None:
    speed = np.max(np.abs(np.stack(recording.held_commands())), axis=0)
    known = np.isfinite(speed)
    seconds = float(known.sum()) * recording.period
    if not seconds >= SHORTEST_DRIVE - 0.5 * recording.period:
        raise InputError(
            f"{recording.meta.source} has {seconds:.0f} s under known commands: give drives of {SHORTEST_DRIVE:g} s "
            "at least."
        )
    moving = float(np.mean(speed[known] > LEAST_SPEED))
    if moving < LEAST_MOVING:
        raise InputError(
            f"{recording.meta.source}: the robot is commanded to stand still {100.0 * (1.0 - moving):.0f} % of the "
            "time: give a drive with straight pieces and arcs to both sides."
        )


def check_map(recordings: Sequence[Recording], rng: np.random.Generator) -> None:
    """Refuse drives whose readings are in the wrong channels: what later drives are compared with has to be right.

    Args:
        recordings: to be calibrated together.
        rng: of the intervals.

    Raises:
        InputError: exchanged or reversed encoders or commands, an IMU upside down, a pose that turns the wrong way.
    """
    for recording in recordings:
        for fault in find_channel_faults([recording], deepcopy(rng)):
            raise InputError(
                f"{recording.meta.source}: {describe(fault.name, amounts(fault.sizes))}. {fault.remedy} "
                "A calibration needs drives that are mapped right."
            )


def with_gyro_forward(recording: Recording, rng: np.random.Generator) -> tuple[Recording, tuple[str, ...]]:
    """Drive whose gyro turns the right way, and a sentence where its sign was turned.

    A gyro against both the encoders and the poses is reversed; one against the encoders alone is a doubt about them.
    """
    track, pose = effective_track(recording, rng), gyro_against_pose(recording, rng)
    if track is None or pose is None or not (track.intervals[0][1] < 0.0 and pose.intervals[0][1] < 0.0):
        return recording, ()
    said = "the gyro turns against the encoders and against the poses: its sign was turned."
    return with_gyro_reversed(recording), (said,)


def drive_scale(recording: Recording, rng: np.random.Generator) -> DriveScale:
    """Size of the robot as its sensors show it.

    Args:
        recording: with the geometry of the data sheet.
        rng: for the resampling of the checks.
    """
    geometry, vectors = recording.meta.geometry, rolled_and_travelled(recording, rng)
    travel = travelled_shares(vectors, rng)
    track = track_in_turns(recording, rng)
    travelled = None if travel is None else float(travel.values[0])
    rolling = None if geometry is None else share_with_least_slip(vectors, geometry.wheel_radius)
    if track is None:
        return DriveScale(travelled, rolling, None, (-math.inf, math.inf))
    return DriveScale(travelled, rolling, float(track.values[0]), track.intervals[0])


def check_scales(names: Sequence[str], scales: Sequence[DriveScale], robot: Robot) -> None:
    """Refuse drives that cannot be of this robot as its data sheet describes it, and two robots together.

    A track counts against the robot where none in its interval is possible.

    Args:
        names: of the drives.
        scales: of the same drives.
        robot: of the data sheet.

    Raises:
        InputError: wheel radius or track off by more than the data sheet's deviation and slip allow.
    """
    _check_two_robots(names, scales, robot)
    radius = LIKELY_DEVIATIONS * robot.standard_deviations.get("outer_radius", 0.0) / robot.outer_radius
    track = LIKELY_DEVIATIONS * robot.standard_deviations.get("half_track", 0.0) / robot.half_track
    for name, scale in zip(names, scales, strict=True):
        if scale.travel is not None and scale.travel > 1.0 + PUSHED + radius:
            raise _other_radius(name, scale.travel, "", robot)
        if scale.rolling is not None and scale.rolling < LEAST_TRAVEL - radius:
            raise _other_radius(name, scale.rolling, " where they slip least", robot)
        narrowest, widest = scale.track_interval
        if scale.track is not None and (widest < 1.0 - radius - track or narrowest > WIDEST_TRACK):
            raise InputError(
                f"{name}: the gyro turns as if the track were {scale.track:.2f} times that of {robot.name}, which no "
                "ground does: check the signs and units of gyro and encoders (`ddagr check`), or the robot."
            )


def _other_radius(name: str, share: float, where: str, robot: Robot) -> InputError:
    return InputError(
        f"{name}: the poses travel {share:.2f} of what wheels of {robot.outer_radius:g} m roll{where}, which slip and "
        f"the data sheet of {robot.name} do not explain: give drives of this robot, or its own data sheet with "
        "--robot FILE.yaml."
    )


def _check_two_robots(names: Sequence[str], scales: Sequence[DriveScale], robot: Robot) -> None:
    known = [(scale.rolling, name) for name, scale in zip(names, scales, strict=True) if scale.rolling is not None]
    if len(known) < 2:
        return
    (least, first), (most, second) = min(known), max(known)
    if least > 0.0 and most / least > TWO_ROBOTS:
        raise InputError(
            f"{first} and {second} are not of one robot: with the wheel radius of {robot.name} one travels "
            f"{least:.2f} and the other {most:.2f} of what its wheels roll where they slip least; calibrate each robot "
            "with its own drives."
        )


def grounds_of(names: Sequence[str], grounds: Mapping[str, Sequence[int]]) -> tuple[str, ...]:
    """Ground of each drive.

    Args:
        names: of the drives.
        grounds: numbers of the drives by ground; without any, all drives are on one.

    Raises:
        InputError: a drive on two grounds, or on none while others have one.
    """
    if not grounds:
        return (ONE_GROUND,) * len(names)
    found: dict[int, str] = {}
    for ground, numbers in grounds.items():
        for number in numbers:
            if number in found:
                raise InputError(
                    f"{names[number]} is on the grounds {found[number]!r} and {ground!r}: give each drive one ground."
                )
            found[number] = ground
    absent = [name for number, name in enumerate(names) if number not in found]
    if absent:
        raise InputError(f"{absent[0]} has no ground while others have one: add --ground NAME={absent[0]}.")
    return tuple(found[number] for number in range(len(names)))


ONE_GROUND = "ground"
"""Name of the one ground of drives whose grounds are not named."""
