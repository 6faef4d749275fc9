"""Which wheels a channel of encoders or commands belongs to, and in which direction: turning and driving tell.

The right wheels turn the robot to the left and drive it forward; the left wheels turn it to the right. Least squares
of turn and travel on the right and the left channel give two coefficients for each channel, whose signs are (+, +) for
the right wheels, (-, +) for the left ones, and the opposite where the channel counts backwards.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ddagr_gym.recordings.checks.findings import CheckFinding, Question, not_testable
from ddagr_gym.recordings.checks.map_lines import Takes, map_lines
from ddagr_gym.recordings.checks.motion_windows import COMMANDS, ENCODERS, MotionWindows
from ddagr_gym.recordings.checks.regression import Estimate, estimate, normal_equations, solve
from ddagr_gym.recordings.schema import FloatArray

CHECK = "wheels"

SHARE = Question(
    CHECK,
    (0.0, np.inf),
    "-",
    "Correct the map: each channel belongs to the wheels that it moves as, forward positive.",
    ("encoder_scale",),
)
"""The smaller of the shares of turning and of travel that go with a channel [-]: 0.5 to 1 on the open recordings for
encoders, 0.1 to 0.5 for commands; negative where the channel is exchanged or counts backwards."""
WIDEST = 1.5
"""Interval of a share beyond which it says nothing [-] (ours)."""
RIGHT_AND_LEFT = ("right", "left")
BACKWARDS = " backwards"
"""Behind the bank that a channel moves as, where it counts against the motion."""
_EXPECTED = np.array([[1.0, 1.0], [-1.0, 1.0]])
"""Signs of turn and travel by the right and the left wheels."""


def wheel_shares(
    windows: MotionWindows, source: str, turn: FloatArray, travel: FloatArray, rng: np.random.Generator
) -> Estimate | None:
    """Turn and travel by each channel over what it would do without slip, (6,).

    In order: turn and travel by the right channel, the same by the left one, the smaller of both of the right one and
    of the left one. All are positive for sound channels.

    Args:
        windows: of the drive.
        source: encoders or commands.
        turn: angle turned in half a window by other sources (n,) [rad].
        travel: distance along x by other sources (n,) [m].
        rng: of the resampling.
    """
    banks = windows.banks[source]
    design = np.concatenate([banks, np.ones((len(banks), 1))], axis=1)
    known = np.all(np.isfinite(design), axis=1) & np.isfinite(turn) & np.isfinite(travel)
    targets = (2 * windows.half_track * turn, 2 * travel)
    rows = [np.flatnonzero(known & (windows.block == k)) for k in np.unique(windows.block[known])]
    sums = [np.array([normal_equations(design[r], y[r]) for y in targets]) for r in rows if r.size > 3]
    return estimate(sums, _shares, rng)


def _shares(totals: FloatArray) -> FloatArray:
    """Shares (m, 6) from the sums (m, 2, 3, 4) of turn and travel."""
    m = len(totals)
    found = solve(totals.reshape(2 * m, 3, 4)).reshape(m, 2, 3)[..., :2]
    by_channel = found.swapaxes(1, 2) * _EXPECTED
    return np.concatenate([by_channel.reshape(m, 4), by_channel.min(axis=2)], axis=1)


def followed_commands(windows: MotionWindows, rng: np.random.Generator) -> Estimate | None:
    """How far each encoder follows the command of its own bank and of the other one, (6,) [-].

    In order: the right encoder on the right and on the left command, the left one on the left and on the right
    command, and for each the first less the size of the second, which is positive for sound channels.

    Args:
        windows: of the drive.
        rng: of the resampling.
    """
    commands, encoders = windows.banks[COMMANDS], windows.banks[ENCODERS]
    known = np.all(np.isfinite(commands), axis=1) & np.all(np.isfinite(encoders), axis=1)
    rows = [np.flatnonzero(known & (windows.block == k)) for k in np.unique(windows.block[known])]
    sums = [np.array([normal_equations(commands[r], y) for y in encoders[r].T]) for r in rows if r.size > 3]
    return estimate(sums, _followed, rng)


def _followed(totals: FloatArray) -> FloatArray:
    """Coefficients (m, 6) from the sums (m, 2, 2, 3) of the right and the left encoder on both commands."""
    m = len(totals)
    found = solve(totals.reshape(2 * m, 2, 3)).reshape(m, 2, 2)
    own, other = found[:, (0, 1), (0, 1)], found[:, (0, 1), (1, 0)]
    pairs = np.stack([own, other], axis=-1).reshape(m, 4)
    return np.concatenate([pairs, own - np.abs(other)], axis=1)


def wheels_followed(followed: Estimate | None) -> tuple[str, str] | None:
    """Whose commands the right and the left encoder follow, in the words of :func:`moves_as`; None where not certain.

    Args:
        followed: of :func:`followed_commands`.
    """
    if followed is None or any(low <= 0 <= high for low, high in followed.intervals[4:]):
        return None
    found = []
    for k, bank in enumerate(RIGHT_AND_LEFT):
        own, other = (float(v) for v in followed.values[2 * k : 2 * k + 2])
        crossed = abs(other) > abs(own)
        moved = RIGHT_AND_LEFT[1 - k] if crossed else bank
        found.append(moved + (BACKWARDS if (other if crossed else own) < 0 else ""))
    return found[0], found[1]


def followed_findings(source: str, followed: Estimate, wheels: tuple[str, str]) -> list[CheckFinding]:
    """Findings on encoders or commands that do not go with each other, where votes tell which of both is wrong.

    Args:
        source: encoders or commands, which other sources of motion speak against.
        followed: of :func:`followed_commands`.
        wheels: of :func:`wheels_followed`.
    """
    takes = wheel_takes(source, wheels)
    question = replace(SHARE, remedy=map_lines(takes)) if takes else SHARE
    other = COMMANDS if source == ENCODERS else ENCODERS
    findings = []
    for k, bank in enumerate(RIGHT_AND_LEFT):
        own, crossed = (float(v) for v in followed.values[2 * k : 2 * k + 2])
        meaning = (
            f"The {bank} encoder goes with {own:.2f} of the {bank} command and {crossed:.2f} of the other one, and "
            f"other sources of motion go with the {other}, not with the {source}."
        )
        value, interval = float(followed.values[4 + k]), followed.intervals[4 + k]
        findings.append(question.answer(f"{source.removesuffix('s')}_{bank}", value, interval, meaning=meaning))
    return findings


def wheel_findings(source: str, shares: Estimate | None) -> list[CheckFinding]:
    """Findings on the two channels of encoders or commands.

    Args:
        source: encoders or commands.
        shares: of :func:`wheel_shares`; None where they cannot be told.
    """
    findings, wheels = [], wheels_of(shares)
    takes = {} if wheels is None else wheel_takes(source, wheels)
    question = replace(SHARE, remedy=map_lines(takes)) if takes else SHARE
    for k, bank in enumerate(RIGHT_AND_LEFT):
        channel = f"{source.removesuffix('s')}_{bank}"
        if shares is None or not _told(shares, k):
            why = "No turns and travel that other sources vouch for tell which wheels it belongs to."
            findings.append(not_testable(CHECK, channel, why, "Drive arcs to both sides, back and forth, with a pose."))
            continue
        turn, travel = float(shares.values[2 * k]), float(shares.values[2 * k + 1])
        found = moves_as(turn, travel, bank)
        meaning = f"It moves as the {found.removesuffix(BACKWARDS)} wheels do"
        meaning += ", but counts backwards" if found.endswith(BACKWARDS) else ""
        meaning += f": {turn:.2f} of the turning and {travel:.2f} of the travel of sound {bank} wheels without slip."
        findings.append(question.answer(channel, float(shares.values[4 + k]), shares.intervals[4 + k], meaning=meaning))
    return findings


def _told(shares: Estimate, bank: int) -> bool:
    """Whether the drive tells what a channel moves as."""
    low, high = shares.intervals[4 + bank]
    return high - low <= WIDEST


def wheels_of(shares: Estimate | None) -> tuple[str, str] | None:
    """What the right and the left channel move as, in the words of :func:`moves_as`; None where that is not certain.

    Args:
        shares: of :func:`wheel_shares`; certain where both told and no interval of turn or travel holds 0.
    """
    if shares is None or not all(_told(shares, k) for k in (0, 1)):
        return None
    if any(low <= 0 <= high for low, high in shares.intervals[:4]):
        return None
    turn_right, travel_right, turn_left, travel_left = (float(v) for v in shares.values[:4])
    return moves_as(turn_right, travel_right, "right"), moves_as(turn_left, travel_left, "left")


def wheel_takes(source: str, wheels: tuple[str, str]) -> Takes:
    """Which readings belong to each bank; nothing where all are where they belong, or both move as one bank.

    Args:
        source: encoders or commands.
        wheels: of :func:`wheels_of`.
    """
    by_bank = {moved.removesuffix(BACKWARDS): k for k, moved in enumerate(wheels)}
    if len(by_bank) < 2:
        return {}
    kind, takes = source.removesuffix("s"), {}
    for bank in RIGHT_AND_LEFT:
        now, sign = RIGHT_AND_LEFT[by_bank[bank]], -1.0 if wheels[by_bank[bank]].endswith(BACKWARDS) else 1.0
        if now != bank or sign < 0:
            takes[f"{kind}_{bank}"] = (f"{kind}_{now}", sign)
    return takes


def moves_as(turn: float, travel: float, bank: str) -> str:
    """What a channel moves as: "right", "left", with " backwards" where it counts against the motion.

    Args:
        turn: its share of turning, positive for a sound channel.
        travel: likewise of travel.
        bank: whose channel it is said to be.
    """
    other = "left" if bank == "right" else "right"
    if turn > 0:
        return bank if travel > 0 else f"{other}{BACKWARDS}"
    return other if travel > 0 else f"{bank}{BACKWARDS}"
