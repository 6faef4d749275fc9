"""Encoders against commands: at which share of a held command a bank settles."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from ddagr_gym.recordings.checks.blocks import FEWEST_BLOCKS, cut_blocks, quantile_interval
from ddagr_gym.recordings.checks.findings import CheckFinding, Interval, Question, not_testable
from ddagr_gym.recordings.checks.regression import Estimate, estimate
from ddagr_gym.recordings.checks.travel import CHECK
from ddagr_gym.recordings.schema import BoolArray, FloatArray, Recording

GAIN = Question(
    CHECK,
    (0.6, 1.15),
    "-",
    "Check units and signs; if they are right, the motors droop or saturate.",
    ("encoder_scale", "motor_droop", "motor_saturation", "command_gain"),
)
"""Steady bank speed over its command [-]: motors droop under load and do not overshoot for long."""
GAIN_BALANCE = Question(
    "balance",
    (0.9, 1.11),
    "-",
    "Compare the banks' encoder scales, loads and gains of their motor controllers.",
    ("encoder_scale", "command_gain", "soil_split", "centre_of_mass_offset"),
)
"""Right bank's gain over the left's [-]."""
STRAIGHT_GAIN = Question(
    CHECK,
    (0.6, 1.04),
    "-",
    "Check the encoders' unit and scale, and the wheel radius by which body speeds become commands of the wheels.",
    ("encoder_scale", "command_gain"),
)
"""Steady mean speed of both banks over its command, nearly straight ahead, where it is followed best [-]: 0.97 to 1.01
on six ordinary drives (ours). No load, friction or limit makes wheels faster than they were told."""
SETTLED = 2.0
"""Time after a command's change from which the bank counts as steady [s]."""
NEARLY_STRAIGHT = 0.5
"""Turning speed of one bank over the mean speed up to which a command is nearly straight [-] (ours)."""
SLOWEST = 0.25
"""Mean speed of a hold over the fastest from which its gain counts [-] (ours): slower ones are noise."""
FOLLOWED_BEST = 0.75
"""Quantile of the gains of holds that counts (ours): limits and loads make others less."""
SAME_SPEED = 0.01
"""Part by which the mean of both commands may change while it counts as held (ours): a robot that follows a row keeps
its speed, but never its steering."""
SHORTEST_HOLD = 0.8
"""Time behind the settling from which a hold counts [s] (ours)."""
LONGEST_PIECE = 8.0
"""Of a hold that lasts [s] (ours)."""
_READINGS = 2
"""Of each bank in a hold, at least."""


def command_gains(recording: Recording, rng: np.random.Generator) -> Estimate | None:
    """Steady bank speed over command: right, left, right over left, (3,).

    Returns:
        None without steady driving by command.
    """
    commands = recording.held_commands()
    steady = settled(recording, commands)
    sums = []
    for block in cut_blocks(recording):
        row = []
        for name, command in zip(("encoder_right", "encoder_left"), commands, strict=True):
            rows = block.start + np.flatnonzero(steady[block] & np.isfinite(recording[name][block]))
            row += [float(command[rows] @ recording[name][rows]), float(command[rows] @ command[rows])]
        if row[1] > 0 and row[3] > 0:
            sums.append(np.array(row))

    def values(totals: FloatArray) -> FloatArray:
        right, left = totals[:, 0] / totals[:, 1], totals[:, 2] / totals[:, 3]
        return np.stack([right, left, right / left], axis=1)

    return estimate(sums, values, rng)


def settled(recording: Recording, commands: tuple[FloatArray, FloatArray]) -> BoolArray:
    """Rows in which both commands have not changed for :data:`SETTLED` seconds inside the span."""
    steady = np.zeros(len(recording), dtype=bool)
    for span in recording.spans():
        pair = np.stack([c[span] for c in commands])
        known = np.all(np.isfinite(pair), axis=0)
        changed = np.ones(pair.shape[1], dtype=bool)
        changed[1:] = np.any(pair[:, 1:] != pair[:, :-1], axis=0) | ~known[1:]
        since = recording.t[span][np.maximum.accumulate(np.where(changed, np.arange(changed.size), 0))]
        steady[span] = known & (recording.t[span] - since >= SETTLED)
    return steady


def straight_gain(recording: Recording) -> tuple[float, Interval] | None:
    """Steady mean speed of both banks over its command, nearly straight ahead, where it is followed best [-].

    Returns:
        Upper quartile over the holds and its 99 % interval, of order statistics, None without such holds.
    """
    commanded, reached = _straight_holds(recording)
    fast = np.abs(commanded) >= SLOWEST * np.abs(commanded).max(initial=0.0)
    if np.count_nonzero(fast) < FEWEST_BLOCKS:
        return None
    gains = np.sort(reached[fast] / commanded[fast])
    return float(np.quantile(gains, FOLLOWED_BEST)), quantile_interval(gains, FOLLOWED_BEST)


def _straight_holds(recording: Recording) -> FloatArray:
    """Mean speed of both banks, as commanded and as read, of every settled piece nearly straight ahead (2, n)."""
    right, left = recording.held_commands()
    readings = np.stack([recording["encoder_right"], recording["encoder_left"]])
    mean = 0.5 * (right + left)
    straight = (mean != 0.0) & (0.5 * np.abs(right - left) <= NEARLY_STRAIGHT * np.abs(mean))
    pieces = [
        piece
        for span in recording.spans()
        for hold in _stretches(np.where(straight, mean, np.nan), span)
        for piece in _settled_pieces(recording.t, hold)
        if np.isfinite(readings[:, piece]).sum(axis=1).min() >= _READINGS
    ]
    holds = [(mean[piece].mean(), np.nanmean(readings[:, piece], axis=1).mean()) for piece in pieces]
    return np.array(holds).reshape(-1, 2).T


def _stretches(speed: FloatArray, span: slice) -> Iterator[slice]:
    """Stretches of a span in which a speed keeps to that of their begin; it is never the same where it is NaN."""
    start = span.start
    for row in range(span.start, span.stop):
        if row > start and not abs(speed[row] - speed[start]) <= SAME_SPEED * abs(speed[start]):
            yield slice(start, row)
            start = row
    yield slice(start, span.stop)


def _settled_pieces(t: FloatArray, hold: slice) -> list[npt.NDArray[np.int64]]:
    """Rows of a hold in which it is settled, cut where they last long, none where that is too short."""
    rows = hold.start + np.flatnonzero(t[hold] - t[hold.start] >= SETTLED)
    lasts = float(t[rows[-1]] - t[rows[0]]) if rows.size else 0.0
    return np.array_split(rows, math.ceil(lasts / LONGEST_PIECE)) if lasts >= SHORTEST_HOLD else []


def gain_findings(recording: Recording, rng: np.random.Generator) -> list[CheckFinding]:
    """Findings on encoders against commands.

    Args:
        recording: any.
        rng: for the resampling.
    """
    found = command_gains(recording, rng)
    if found is None:
        why = "No command was held long enough for the banks to settle."
        remedy = f"Hold commands for more than {SETTLED:g} s."
        return [not_testable(CHECK, "command to encoder", why, remedy), *straight_finding(recording)]
    balance = float(found.values[2])
    return [
        *(_gain_of(bank, float(found.values[k]), found.intervals[k]) for k, bank in enumerate(("right", "left"))),
        GAIN_BALANCE.answer(
            "command to encoder, right to left",
            balance,
            found.intervals[2],
            meaning=f"The right bank reaches {balance:.3f} times the share of its command that the left reaches.",
        ),
        *straight_finding(recording),
    ]


def _gain_of(bank: str, gain: float, interval: Interval) -> CheckFinding:
    meaning = f"The {bank} bank settles at {gain:.3f} of its command."
    return GAIN.answer(f"command_{bank} to encoder_{bank}", gain, interval, meaning=meaning)


def straight_finding(recording: Recording) -> list[CheckFinding]:
    """Whether both banks are faster than they were told; nothing where no commands were held nearly straight ahead.

    Args:
        recording: any.
    """
    found = straight_gain(recording)
    if found is None:
        return []
    meaning = f"Straight ahead the banks settle at {found[0]:.3f} of their command where they follow it best."
    return [STRAIGHT_GAIN.answer("command to encoder, straight", *found, meaning=meaning)]
