"""Which wheels a channel of encoders or commands belongs to, and in which direction: turning and driving tell.

The right wheels turn the robot to the left and drive it forward; the left wheels turn it to the right. Least squares
of turn and travel on the right and the left channel give two coefficients for each channel, whose signs are (+, +) for
the right wheels, (-, +) for the left ones, and the opposite where the channel counts backwards.
"""

from __future__ import annotations

import numpy as np

from ddagr_gym.recordings.checks.findings import CheckFinding, Question, not_testable
from ddagr_gym.recordings.checks.motion_windows import MotionWindows
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


def wheel_findings(source: str, shares: Estimate | None) -> list[CheckFinding]:
    """Findings on the two channels of encoders or commands.

    Args:
        source: encoders or commands.
        shares: of :func:`wheel_shares`; None where they cannot be told.
    """
    findings = []
    for k, bank in enumerate(RIGHT_AND_LEFT):
        channel = f"{source.removesuffix('s')}_{bank}"
        interval = (-np.inf, np.inf) if shares is None else shares.intervals[4 + k]
        if shares is None or not interval[1] - interval[0] <= WIDEST:
            why = "No turns and travel that other sources vouch for tell which wheels it belongs to."
            findings.append(not_testable(CHECK, channel, why, "Drive arcs to both sides, back and forth, with a pose."))
            continue
        turn, travel = float(shares.values[2 * k]), float(shares.values[2 * k + 1])
        found = moves_as(turn, travel, bank)
        meaning = f"It moves as the {found.removesuffix(' backwards')} wheels do"
        meaning += ", but counts backwards" if found.endswith("backwards") else ""
        meaning += f": {turn:.2f} of the turning and {travel:.2f} of the travel of sound {bank} wheels without slip."
        findings.append(SHARE.answer(channel, float(shares.values[4 + k]), interval, meaning=meaning))
    return findings


def moves_as(turn: float, travel: float, bank: str) -> str:
    """What a channel moves as: "right", "left", with " backwards" where it counts against the motion.

    Args:
        turn: its share of turning, positive for a sound channel.
        travel: likewise of travel.
        bank: whose channel it is said to be.
    """
    other = "left" if bank == "right" else "right"
    if turn > 0:
        return bank if travel > 0 else f"{other} backwards"
    return other if travel > 0 else f"{bank} backwards"
