"""Wheels that saturate: speeds that stop growing where their commands go on.

Each command that is held long enough gives one steady speed of each bank. Steady speeds follow their commands up to a
limit: |speed| = min(g |command|, limit), fitted by least absolute deviations, which braking by the other side does
not mislead. The share of the commands that ask for more than the limit says how much of the drive saturates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ddagr_gym.recordings.checks.blocks import interval_of, resample
from ddagr_gym.recordings.checks.command_gains import settled
from ddagr_gym.recordings.checks.findings import CheckFinding, Interval, Question, not_testable
from ddagr_gym.recordings.schema import BoolArray, FloatArray, Recording

CHECK = "wheel_limit"

SATURATED = Question(
    CHECK,
    (0.0, 0.35),
    "-",
    "Those commands tell nothing about the ground: drive below the limit, or fit motor_saturation.",
    ("motor_saturation",),
)
"""Share of the held commands beyond the bank's limit [-]: 0.15 to 0.4 on ordinary drives of Warthogs, whose protocol
asks for 16 rad/s of wheels that reach 13."""
FEWEST = 12
"""Held commands of a bank below which no limit is looked for (ours)."""
SLOWEST = 0.5
"""Commands below it say nothing about a limit [rad/s] (ours)."""
NARROWEST = 0.1
"""Share by which the largest commands go beyond the limit at least, so that it can be seen beside droop [-] (ours)."""
LEAST_GAIN = 0.1
"""Share of the deviations that a limit has to take away [-] (ours): a curve of chance takes a few percent."""
_LIMITS = 60
"""Limits that are tried, between a tenth of the fastest speed and the fastest."""


@dataclass(frozen=True)
class BankLimit:
    """Limit of a bank's speed.

    Attributes:
        speed: the limit [rad/s]; infinite where there is none.
        error: its standard error [rad/s].
        share: of the held commands that ask for more [-].
        interval: 99 % interval of the share.
        largest: command [rad/s].
        commands: number of held commands.
    """

    speed: float
    error: float
    share: float
    interval: Interval
    largest: float
    commands: int


def bank_limits(recording: Recording, rng: np.random.Generator) -> list[CheckFinding]:
    """Findings on the limits of both banks.

    Args:
        recording: any.
        rng: of the resampling.
    """
    held = recording.held_commands()
    steady = settled(recording, held)
    findings = []
    for bank, command in zip(("right", "left"), held, strict=True):
        channel = f"command_{bank} to encoder_{bank}"
        limit = limit_of(*steady_speeds(recording, command, recording[f"encoder_{bank}"], steady), rng)
        if limit is None:
            why = "Too few commands were held until the bank was steady."
            findings.append(not_testable(CHECK, channel, why, "Hold commands of many sizes for more than 2 s."))
        else:
            findings.append(SATURATED.answer(channel, limit.share, limit.interval, meaning=_sentence(bank, limit)))
    return findings


def _sentence(bank: str, limit: BankLimit) -> str:
    if not math.isfinite(limit.speed):
        return f"The {bank} bank follows its commands up to the largest, {limit.largest:.3g} rad/s."
    stops = "stops" if limit.interval[0] > 0 else "may stop"
    return (
        f"The {bank} bank {stops} at {limit.speed:.3g} rad/s (standard error {limit.error:.2g}), and "
        f"{100 * limit.share:.0f} % of {limit.commands} held commands ask for more, up to {limit.largest:.3g} rad/s."
    )


def steady_speeds(
    recording: Recording, command: FloatArray, encoder: FloatArray, steady: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Sizes of held commands and of the mean steady speeds that follow them, (commands,) each [rad/s].

    Args:
        recording: any.
        command: of a bank, held (n,) [rad/s].
        encoder: of the bank (n,) [rad/s].
        steady: rows in which the commands have been held for long (n,).
    """
    rows = np.flatnonzero(steady & np.isfinite(encoder) & (np.abs(command) >= SLOWEST))
    if not rows.size:
        return np.empty(0), np.empty(0)
    changed = (np.diff(command[rows]) != 0) | (np.cumsum(~steady)[rows[1:]] != np.cumsum(~steady)[rows[:-1]])
    number = np.concatenate([[0], np.cumsum(changed)])
    count = np.bincount(number)
    mean = np.bincount(number, encoder[rows] * np.sign(command[rows])) / count
    return np.bincount(number, np.abs(command[rows])) / count, np.maximum(mean, 0.0)


def limit_of(command: FloatArray, speed: FloatArray, rng: np.random.Generator) -> BankLimit | None:
    """Limit of the speeds that follow commands; None for too few.

    Args:
        command: sizes (n,) [rad/s].
        speed: that followed (n,) [rad/s].
        rng: of the resampling.
    """
    if command.size < FEWEST or not speed.any():
        return None
    slow = command <= np.median(command)
    gain = float(np.median(speed[slow] / command[slow]))
    wanted = gain * command
    limits = np.append(np.linspace(0.1, 1.0, _LIMITS) * speed.max(), np.inf)
    limits = limits[(limits * (1 + NARROWEST) <= wanted.max()) | np.isinf(limits)]
    deviations = np.abs(speed[:, None] - np.minimum(wanted[:, None], limits))

    def values(totals: FloatArray) -> FloatArray:
        best = np.argmin(totals, axis=1)
        least = totals[np.arange(len(totals)), best]
        best = np.where(least <= (1 - LEAST_GAIN) * totals[:, -1], best, len(limits) - 1)
        return np.stack([np.mean(wanted[:, None] > limits[best], axis=0), limits[best]], axis=1)

    found, resampled = resample(deviations, values, rng)
    finite = resampled[np.isfinite(resampled[:, 1]), 1]
    error = float(np.std(finite)) if finite.size > 1 else 0.0
    interval = interval_of(float(found[0]), resampled[:, 0], command.size)
    return BankLimit(float(found[1]), error, float(found[0]), interval, float(command.max()), command.size)
