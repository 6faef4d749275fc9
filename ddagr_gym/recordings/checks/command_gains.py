"""Encoders against commands: at which share of a held command a bank settles."""

from __future__ import annotations

import numpy as np

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
SHORTEST_HOLD = 0.8
"""Time behind the settling from which a hold counts [s] (ours)."""
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
    holds = _holds(recording)
    mean, turning = 0.5 * (holds[0] + holds[1]), 0.5 * (holds[0] - holds[1])
    fast = (mean != 0.0) & (np.abs(mean) >= SLOWEST * np.abs(mean).max(initial=0.0))
    told = fast & (np.abs(turning) <= NEARLY_STRAIGHT * np.abs(mean))
    if np.count_nonzero(told) < FEWEST_BLOCKS:
        return None
    gains = np.sort(0.5 * (holds[2] + holds[3])[told] / mean[told])
    return float(np.quantile(gains, FOLLOWED_BEST)), quantile_interval(gains, FOLLOWED_BEST)


def _holds(recording: Recording) -> FloatArray:
    """Commands of the right and the left bank and the mean readings of both, of every settled hold (4, n)."""
    commands = np.stack(recording.held_commands())
    readings = np.stack([recording["encoder_right"], recording["encoder_left"]])
    steady, holds = settled(recording, (commands[0], commands[1])), []
    for span in recording.spans():
        rows = np.arange(span.start, span.stop)[steady[span]]
        breaks = np.any(np.diff(commands[:, rows]) != 0.0, axis=0) | (np.diff(rows) > 1)
        for hold in np.split(rows, np.flatnonzero(breaks) + 1):
            known = np.isfinite(readings[:, hold])
            if known.sum(axis=1).min() >= _READINGS and recording.t[hold[-1]] - recording.t[hold[0]] >= SHORTEST_HOLD:
                means = np.nanmean(readings[:, hold], axis=1)
                holds.append(np.concatenate([commands[:, hold[0]], means]))
    return np.array(holds).reshape(-1, 4).T


def gain_findings(recording: Recording, rng: np.random.Generator) -> list[CheckFinding]:
    """Findings on encoders against commands.

    Args:
        recording: any.
        rng: for the resampling.
    """
    found = command_gains(recording, rng)
    if found is None:
        why = "No command was held long enough for the banks to settle."
        return [not_testable(CHECK, "command to encoder", why, f"Hold commands for more than {SETTLED:g} s.")]
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
