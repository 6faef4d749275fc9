"""Where sensors disagree, a third source decides, and the channel at fault is named.

Three steps, each of which uses only what the one before found sound:

1. *Driving*: encoders, commands and pose say which way forward is (:mod:`.votes`).
2. *Turning*: gyro, heading, direction of travel, encoders, commands and centripetal force say which way left is.
3. With a speed and a turn rate that the majority vouches for: which wheels each encoder and command belongs to
   (:mod:`.wheels`), and how the IMU is mounted (:mod:`.imu_axes`).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ddagr_gym.recordings.checks.clock_offsets import offsets
from ddagr_gym.recordings.checks.findings import CheckFinding, Question, Status, not_testable
from ddagr_gym.recordings.checks.imu_axes import MountingFit, fit_mounting
from ddagr_gym.recordings.checks.imu_findings import mounting_finding
from ddagr_gym.recordings.checks.motion_windows import (
    COMMANDS,
    COURSE,
    ENCODERS,
    FORCE,
    GYRO,
    HEADING,
    POSITION,
    STEP,
    MotionWindows,
    motion_windows,
)
from ddagr_gym.recordings.checks.regression import Estimate
from ddagr_gym.recordings.checks.votes import Pair, Votes, votes, with_other_majority
from ddagr_gym.recordings.checks.wheels import (
    followed_commands,
    followed_findings,
    wheel_findings,
    wheel_shares,
    wheels_followed,
    wheels_of,
)
from ddagr_gym.recordings.schema import FloatArray, Recording

CHECK = "arbitration"

SOUND = (0.0, 1.0)
"""Correlation of a source with the majority of the sources of the same motion [-]: a wrong sign makes it negative."""
_SOURCES = {
    GYRO: ("yaw_rate", "the gyro", "Negate yaw_rate in the map (sign: -1).", ("gyro_sign",)),
    HEADING: ("pose_yaw", "the heading", "Negate pose_yaw in the map: counter-clockwise is positive.", ()),
    COURSE: ("pose_x and pose_y", "the path", "Negate pose_y in the map, or exchange both axes.", ()),
    POSITION: ("pose_x and pose_y", "the path", "Add pi to pose_yaw: it points backwards.", ()),
    ENCODERS: (
        "encoders",
        "the encoders",
        "Correct the encoders in the map as said of each wheel.",
        ("encoder_scale",),
    ),
    COMMANDS: ("commands", "the commands", "Correct the commands in the map as said of each wheel.", ()),
    FORCE: ("specific_force_y", "the sideways specific force", "", ()),
}
"""Channel, words, remedy and suspects of each source; the accelerometer's faults are those of the mounting."""
_SINGULAR = (GYRO, HEADING, COURSE, POSITION)
_ASK = "Drive turns to both sides and back and forth, with a pose if there is one."


@dataclass(frozen=True)
class Arbitration:
    """What the sources of motion say of each other.

    Attributes:
        windows: that were compared.
        driving: votes on forward.
        turning: votes on left.
        mounting: of the IMU; None where it cannot be told.
        wheels: shares of motion that go with each channel, by encoders and commands; None where they cannot be told.
        followed: how far encoders follow the commands of each bank; None where they cannot be told.
    """

    windows: MotionWindows
    driving: Votes
    turning: Votes
    mounting: MountingFit | None
    wheels: Mapping[str, Estimate | None]
    followed: Estimate | None = None

    def accused(self, source: str) -> bool:
        """Whether it is the encoders, or the commands, that are wrong where both differ.

        Either other sources go against them and not against the other two, or with the other two in all motions and
        not with them.
        """
        motions, other = (self.turning, self.driving), COMMANDS if source == ENCODERS else ENCODERS
        against = any(source in votes.minority for votes in motions)
        spared = not any(other in votes.minority for votes in motions)
        alone = any(source not in votes.majority for votes in motions)
        trusted = all(other in votes.majority for votes in motions)
        return (against and spared) or (alone and trusted)


def arbitration(recording: Recording, rng: np.random.Generator) -> list[CheckFinding]:
    """Findings on channels that other sources speak against.

    Args:
        recording: any; not testable without the robot's wheel radius and track.
        rng: of the resampling.
    """
    found = arbitrated(recording, rng)
    if found is None:
        return [_not_arbitrated(recording)]
    return arbitration_findings(found)


def _not_arbitrated(recording: Recording) -> CheckFinding:
    if recording.meta.geometry is None:
        return not_testable(CHECK, "all", "The wheel radius is not known.", "Name the robot with --robot.")
    why = "The drive is too short or its rows come too seldom to show how the robot moves."
    return not_testable(CHECK, "all", why, "Record for longer, with several rows a second.")


def arbitration_findings(found: Arbitration) -> list[CheckFinding]:
    """What an arbitration says, in words."""
    return [
        *_vote_findings("driving", found.driving),
        *_vote_findings("turning", found.turning),
        *itertools.chain(*(_wheel_findings(found, source) for source in found.wheels)),
        mounting_finding(found.mounting),
    ]


def _wheel_findings(found: Arbitration, source: str) -> list[CheckFinding]:
    """By the motion of the robot where that tells, else by what encoders and commands say of each other."""
    wheels = wheels_followed(found.followed)
    if wheels_of(found.wheels[source]) is None and found.accused(source) and found.followed and wheels:
        return followed_findings(source, found.followed, wheels)
    return wheel_findings(source, found.wheels[source])


def arbitrated(recording: Recording, rng: np.random.Generator) -> Arbitration | None:
    """What the sources of motion in a recording say of each other; None without the robot's wheel radius and track.

    Args:
        recording: any.
        rng: of the resampling.
    """
    windows = motion_windows(recording, offsets(recording, rng))
    return None if windows is None else arbitrate(windows, rng)


def arbitrate(windows: MotionWindows, rng: np.random.Generator) -> Arbitration:
    """Votes and mounting from the windows of a drive.

    Args:
        windows: of the drive.
        rng: of the resampling.
    """
    forward = windows.forward
    driving = votes({pair: (forward[pair[0]], forward[pair[1]]) for pair in _pairs(forward)}, windows.block, rng)
    speed, acceleration = _forward_reference(windows, driving)
    turning = votes(_turn_signals(windows, speed), windows.block, rng)
    if any(turning.camps) and (not turning.decided or set(turning.majority) == {GYRO, FORCE}):
        turning = _decided_by_gravity(windows, turning, speed, acceleration, rng)
    turn = turn_reference(windows, turning)
    mounting = None if turn is None else fit_mounting(windows, speed, acceleration, turn, rng)
    found = Arbitration(windows, driving, turning, mounting, {})
    wheels = {source: _wheels(found, source, turn, rng) for source in (ENCODERS, COMMANDS)}
    return replace(found, wheels=wheels, followed=followed_commands(windows, rng))


def _decided_by_gravity(
    windows: MotionWindows, turning: Votes, speed: FloatArray, acceleration: FloatArray, rng: np.random.Generator
) -> Votes:
    """The IMU alone against the wheels, which gravity decides.

    An IMU that shows both turn rate and sideways force reversed is upside down, and gravity says whether it is. If it
    is not, no mounting explains both, and right and left are exchanged in the wheels.
    """
    camp = next((camp for camp in turning.camps if GYRO in camp), ())
    if set(camp) != {GYRO, FORCE}:
        return turning
    reversed_turn = -windows.turn[GYRO] / STEP, -windows.turn_change[GYRO]
    fit = fit_mounting(windows, speed, acceleration, reversed_turn, rng)
    if fit is None or not np.isfinite(fit.errors[2, 2]):
        return turning
    wheels = next(other for other in turning.camps if other is not camp)
    upside_down = fit.decided and fit.best.upside_down
    if not upside_down and fit.best.faults < 2:
        return turning
    decided = replace(turning, camps=(wheels, camp) if upside_down else (camp, wheels), third="gravity")
    return decided if decided.camps == turning.camps else with_other_majority(decided)


def _pairs(signals: Mapping[str, FloatArray]) -> list[Pair]:
    return list(itertools.combinations(signals, 2))


def _turn_signals(windows: MotionWindows, speed: FloatArray) -> dict[Pair, tuple[FloatArray, FloatArray]]:
    """What each pair of sources says of turning; the sideways force is compared with speed times turn rate."""
    turn = windows.turn
    signals = {pair: (turn[pair[0]], turn[pair[1]]) for pair in _pairs(turn)}
    force = windows.force[:, 1]
    centred = force - np.nanmean(force) if np.isfinite(force).any() else force
    return signals | {(source, FORCE): (speed * angle / STEP, centred) for source, angle in turn.items()}


def _forward_reference(windows: MotionWindows, driving: Votes) -> tuple[FloatArray, FloatArray]:
    """Speed [m/s] and its change [m/s^2] by the first of encoders, pose and commands that the majority holds sound."""
    source = next((s for s in (ENCODERS, POSITION, COMMANDS) if s in driving.majority), ENCODERS)
    return windows.forward[source] / STEP, windows.forward_change[source]


def turn_reference(windows: MotionWindows, turning: Votes) -> tuple[FloatArray, FloatArray] | None:
    """Turn rate [rad/s] and its change [rad/s^2] with the majority's sign; None where nothing is decided."""
    for source in (HEADING, GYRO, ENCODERS):
        if turning.decided and source in (*turning.majority, *turning.minority):
            sign = 1.0 if source in turning.majority else -1.0
            return sign * windows.turn[source] / STEP, sign * windows.turn_change[source]
    return None


def travel_reference(found: Arbitration, source: str) -> FloatArray | None:
    """Distance along x in windows [m] by the first source other than ``source`` that takes part; None without.

    Args:
        found: votes and windows.
        source: encoders or commands, which are held against it.
    """
    driving = found.driving
    for other in (POSITION, COMMANDS):
        if driving.decided and other != source and other in (*driving.majority, *driving.minority):
            sign = 1.0 if other in driving.majority else -1.0
            return np.asarray(sign * found.windows.forward[other])
    return None


def _wheels(
    found: Arbitration, source: str, turn: tuple[FloatArray, FloatArray] | None, rng: np.random.Generator
) -> Estimate | None:
    """Which wheels encoders or commands belong to; None where nothing else vouches for turns and travel."""
    travel = travel_reference(found, source)
    if turn is None or travel is None or found.turning.majority == (source,):
        return None
    return wheel_shares(found.windows, source, turn[0] * STEP, travel, rng)


def _vote_findings(motion: str, found: Votes) -> list[CheckFinding]:
    """One finding for each source that takes part; one for the whole where nothing is decided."""
    first, second = found.camps
    if len(first) + len(second) < 2:
        return [not_testable(CHECK, motion, f"No two sources of {motion} share enough motion.", _ASK)]
    if not found.decided:
        return [_tie(motion, found)]
    if len(first) + len(second) == 2:
        why = f"Only {_listed(first)} tell of {motion}, and they agree; a third source would confirm them."
        return [not_testable(CHECK, motion, why, _ASK)]
    return [_source_finding(motion, source, found) for source in (*first, *second) if source != FORCE]


def _tie(motion: str, found: Votes) -> CheckFinding:
    one, other = (_listed(camp) for camp in found.camps)
    return CheckFinding(
        CHECK,
        motion,
        Status.SUSPICIOUS,
        f"In {motion}, {one} go against {other}, and no further source decides which of them is reversed.",
        "Record a pose, or look which way the numbers go in a turn to the left.",
    )


def _source_finding(motion: str, source: str, found: Votes) -> CheckFinding:
    channel, words, remedy, suspects = _SOURCES[source]
    at_fault = source in found.minority
    values = _listed(
        [other for other in found.majority if other != source],
        lambda other: f" ({found.correlation[_pair(found, source, other)]:.2f})",
    )
    meaning = f"In {motion}, {words} and {values} go together."
    if at_fault:
        by = f", as {found.third} confirms" if found.third else ", which agree with each other"
        meaning = f"In {motion}, {words} go{'es' if source in _SINGULAR else ''} against {values}{by}."
    value, interval = found.support.get(source, 0.0), found.support_interval.get(source, SOUND)
    return Question(CHECK, SOUND, "-", remedy, suspects).answer(
        f"{channel}, {motion}", value, interval, meaning=meaning
    )


def _pair(found: Votes, one: str, other: str) -> Pair:
    return (one, other) if (one, other) in found.correlation else (other, one)


def _listed(sources: Sequence[str], value: Callable[[str], str] = lambda _: "") -> str:
    """Sources in words, each with what ``value`` says of it."""
    words = [f"{_SOURCES[source][1]}{value(source)}" for source in sources]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
