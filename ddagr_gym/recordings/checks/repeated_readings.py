"""Channels that repeat their value without the map saying so."""

from __future__ import annotations

import numpy as np

from ddagr_gym.recordings.checks.findings import CheckFinding, Question, not_testable
from ddagr_gym.recordings.checks.signals import moving_mask
from ddagr_gym.recordings.schema import BoolArray, FloatArray, Recording

CHECK = "held"
"""Of the findings in reports, whose schema has it."""

CHECKED = (
    "encoder_right",
    "encoder_left",
    "specific_force_x",
    "specific_force_y",
    "specific_force_z",
    "yaw_rate",
    "pose_x",
    "pose_y",
    "pose_yaw",
)
REPEAT = Question(
    CHECK,
    (0.0, 0.05),
    "-",
    "If the logger repeats this channel, declare it under held in the map; else look at the sensor.",
    ("sensor_hold",),
)
"""Share of repeats while driving beyond what the resolution explains [-]; 0.002 at most on the open recordings."""
FROZEN = Question("frozen", (0.0, 1.0), "s", "Look for a sensor that hangs; leave that piece out.", ("sensor_hold",))
"""Longest time for which a fine-grained channel may show one value while driving [s] (ours)."""
QUANTA = 3.0
"""A channel whose changes are mostly this many quanta or fewer repeats itself naturally (ours)."""


def repeated_readings(recording: Recording) -> list[CheckFinding]:
    """Findings on repeated samples, one for each channel that is not under ``held`` in the map.

    Exact zeros are left out: a locked bank repeats them, and :mod:`.extremes` looks at them.
    """
    driving = moving_mask(recording)
    findings = []
    for name in CHECKED:
        if _undeclared(recording, name):
            steps = np.abs(changes(recording, name, driving))
            findings.append(_repeats(name, steps))
            if steps.size >= 50 and natural_repeats(steps) < 0.5:
                findings.append(_frozen(recording, name, driving))
    return findings


def _undeclared(recording: Recording, name: str) -> bool:
    return recording.has(name) and name not in recording.meta.held


def changes(recording: Recording, name: str, driving: BoolArray) -> FloatArray:
    """Differences between successive samples of a channel while driving, without those between two zeros."""
    values = recording[name]
    parts = []
    for span in recording.spans():
        rows = span.start + np.flatnonzero(np.isfinite(values[span]))
        keep = driving[rows[1:]] & driving[rows[:-1]] & ((values[rows[1:]] != 0) | (values[rows[:-1]] != 0))
        parts.append(np.diff(values[rows])[keep])
    return np.concatenate(parts) if parts else np.empty(0)


def natural_repeats(steps: FloatArray) -> float:
    """Share of repeats that a channel's resolution alone explains [-].

    Differences scatter evenly about zero, so no change is about as frequent as one quantum up or one down. A channel
    that changes by a few quanta at most repeats itself at any rate: 1.

    Args:
        steps: sizes of the differences between successive samples (n,).
    """
    moved = steps[steps > 0]
    if not moved.size:
        return 0.0
    # The smallest changes are one quantum but for rounding in the file.
    quantum = float(np.quantile(moved, 0.02))
    if float(np.median(moved)) <= QUANTA * quantum:
        return 1.0
    return 0.5 * float(np.mean((steps > 0) & (steps <= 1.5 * quantum)))


def _repeats(name: str, steps: FloatArray) -> CheckFinding:
    if steps.size < 50:
        return not_testable(CHECK, name, "The channel has too few samples while driving.", "Record a longer drive.")
    share, natural = float(np.mean(steps == 0)), natural_repeats(steps)
    excess = max(0.0, share - natural)
    return REPEAT.answer(
        name,
        excess,
        meaning=f"{100 * share:.2g} % of its samples repeat the one before while driving; "
        f"its resolution explains {100 * min(natural, share):.2g} %.",
    )


def longest_freeze(recording: Recording, name: str, driving: BoolArray) -> float:
    """Longest time for which a channel shows one value other than 0 while driving [s].

    Args:
        recording: any.
        name: channel.
        driving: (n,) rows in which the robot moves.
    """
    longest = 0.0
    for span in recording.spans():
        rows = span.start + np.flatnonzero(np.isfinite(recording[name][span]) & driving[span])
        values = recording[name][rows]
        # A row starts a new value where it differs from the row before or where driving paused in between.
        starts = np.flatnonzero(np.concatenate([[True], (np.diff(values) != 0) | (np.diff(rows) > 1)]))
        stops = np.concatenate([starts[1:], [rows.size]]) - 1
        if rows.size:
            lasted = recording.t[rows[stops]] - recording.t[rows[starts]]
            longest = max(longest, float(np.max(np.where(values[starts] != 0, lasted, 0.0))))
    return longest


def _frozen(recording: Recording, name: str, driving: BoolArray) -> CheckFinding:
    longest = longest_freeze(recording, name, driving)
    return FROZEN.answer(name, longest, meaning=f"While driving it shows one value for {longest:.2f} s at most.")
