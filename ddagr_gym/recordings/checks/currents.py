"""Motor currents and supply voltages: do they change, have they the sign of the torque, and do the wheels weaken?

A robot that drives straight has to push itself. Over rows in which both banks turn the same way, the current of each
bank is a line in how much faster than the other bank it turns,

    i = i_0 + b x,    x = (w - w_other) sgn(w) / (|w| + |w_other|),                                                 (1)

and i_0 is what it draws driving straight. Forwards i_0 is positive. Driving backwards, what motors draw from their
supply follows the same line, because it has the sign of the power; the motors' own current has the sign of the torque
and follows the line with the signs reversed.
"""

from __future__ import annotations

from enum import StrEnum

import numpy as np

from ddagr_gym.recordings.channels import CURRENTS, VOLTAGES
from ddagr_gym.recordings.checks.command_gains import settled
from ddagr_gym.recordings.checks.extremes import stuck
from ddagr_gym.recordings.checks.findings import CheckFinding, Question, not_testable
from ddagr_gym.recordings.checks.regression import Estimate, blocks_in_spans, estimate, normal_equations, solve
from ddagr_gym.recordings.checks.signals import filled, moving_mask
from ddagr_gym.recordings.schema import BoolArray, FloatArray, Recording

DIRECTION = Question(
    "current_sign",
    (0.0, np.inf),
    "A",
    "The current has the wrong sign: say sign: -1 for it in the column map.",
)
"""Mean current of a bank that drives straight and forwards [A]."""

SAG = Question(
    "voltage_sag",
    (0.0, 0.2),
    "-",
    "The supply breaks down under load: charge or replace the battery, and look at its cables.",
    ("motor_saturation", "motor_droop"),
)
"""Share by which the voltage falls: from its 95th percentile to its 5th, over its median [-] (ours: lead-acid
batteries fall by a tenth of their voltage under their rated load)."""

WEAKENING = Question(
    "voltage_to_speed",
    (-np.inf, 0.3),
    "-",
    "The wheels turn more slowly at a lower voltage: their limits are the battery's, so drive at one state of charge.",
    ("motor_saturation", "motor_droop"),
)
"""Exponent e of speed over command ~ voltage^e [-]: 0 where a speed loop makes up for the voltage, 1 where wheels run
at the speed that the voltage allows."""

SLOWEST = 0.1
"""Bank speed from which a bank counts as driving [rad/s] (ours)."""

LARGEST_DIFFERENCE = 0.6
"""Size of x up to which rows count (ours): beyond it a turn says more than the push forwards."""

FEWEST = 15
"""Current samples of one direction below which nothing is said (ours)."""

LEAST_RANGE = 0.01
"""Range of the voltage over its median from which its influence can be asked for (ours): noise of a voltmeter."""

WIDEST = 2.0
"""Width of the exponent's interval beyond which nothing is known of it [-] (ours): 0 and 1 are what it may be."""

FASTEST_SHARE = 0.3
"""Of the fastest command, from which a held command counts for the influence of the voltage (ours)."""


class CurrentKind(StrEnum):
    """What a current channel measures."""

    MOTOR = "motor"
    """Current of the motors: has the sign of the torque."""
    SUPPLY = "supply"
    """What motors draw from their supply: has the sign of the power."""


def currents(recording: Recording, rng: np.random.Generator) -> list[CheckFinding]:
    """Findings on currents and voltages, for those that a recording has.

    Args:
        recording: any.
        rng: of the resampling.
    """
    findings = []
    for name in (n for n in CURRENTS if recording.has(n)):
        values = recording[name][np.isfinite(recording[name])]
        if values.size >= FEWEST and moving_mask(recording).any():
            findings.append(stuck(name, values))
        findings.append(_direction(recording, name, rng))
    for name in (n for n in VOLTAGES if recording.has(n)):
        findings += _voltage(recording, name, rng)
    return findings


def current_kind(recording: Recording, rng: np.random.Generator) -> CurrentKind | None:
    """What the current channels of a recording measure; None where the drive does not say it surely.

    Equation (1) is fitted twice to all rows in which the robot drives: as it stands, and with the signs that the
    currents of motors have. The interval of the difference of what both leave decides.

    Args:
        recording: any.
        rng: of the resampling.
    """
    readings = [_driven(recording, name) for name in CURRENTS if recording.has(name)]
    sums = []
    for _, block in blocks_in_spans(recording):
        parts = [_kind_sums(*(column[block] for column in reading)) for reading in readings]
        if parts and np.sum(parts, axis=0)[0, 0, 0] > 0.0:
            sums.append(np.stack(parts))
    found = estimate(sums, _explained_difference, rng) if sums else None
    if found is None or found.intervals[0][0] <= 0.0 <= found.intervals[0][1]:
        return None
    return CurrentKind.SUPPLY if found.values[0] > 0.0 else CurrentKind.MOTOR


def _driven(recording: Recording, name: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Current, x of equation (1) and the direction of the bank (n,); the current is NaN where it does not drive."""
    own, other = _speeds(recording, name)
    with np.errstate(invalid="ignore", divide="ignore"):
        x = (own - other) * np.sign(own) / (np.abs(own) + np.abs(other))
        driven = (np.abs(own) > SLOWEST) & np.isfinite(x)
    return np.where(driven, recording[name], np.nan), x, np.sign(own)


def _kind_sums(current: FloatArray, x: FloatArray, direction: FloatArray) -> FloatArray:
    """(2, 2, 4) of a block: normal equations of both models, and behind them the power of the current."""
    known = np.isfinite(current)
    plain = np.stack([np.ones(known.sum()), x[known]], axis=1)
    power = np.full((2, 1), 0.5 * float(np.sum(current[known] ** 2)))
    both = (plain, plain * direction[known][:, None])
    return np.stack([np.concatenate([normal_equations(d, current[known]), power], axis=1) for d in both])


def _explained_difference(totals: FloatArray) -> FloatArray:
    """(m, 1) share of the power that a current of the supply explains less that of a current of the motors.

    Args:
        totals: (m, channels, 2, 2, 4).
    """
    difference = np.zeros(len(totals))
    for channel in range(totals.shape[1]):
        power = totals[:, channel, 0, :, 3].sum(axis=1)
        for model, sign in ((0, 1.0), (1, -1.0)):
            equations = totals[:, channel, model, :, :3]
            explained = np.einsum("mk,mk->m", solve(equations), equations[..., 2])
            difference += sign * explained / power
    return np.asarray(difference[:, None] / totals.shape[1])


def wrong_sign(recording: Recording, name: str, rng: np.random.Generator) -> bool:
    """Whether a current channel surely goes against the push of a robot that drives straight."""
    found = straight_current(recording, name, current_kind(recording, rng), rng)
    return found is not None and found.intervals[0][1] < 0.0


def straight_current(
    recording: Recording, name: str, kind: CurrentKind | None, rng: np.random.Generator
) -> Estimate | None:
    """i_0 and b of equation (1) [A], forwards; None for too few samples.

    Args:
        recording: any.
        name: of CURRENTS.
        kind: of the channel, by which driving backwards counts too; None leaves it out.
        rng: of the resampling.
    """
    current, x, direction = _driven(recording, name)
    with np.errstate(invalid="ignore"):
        chosen = np.isfinite(current) & (np.abs(x) <= LARGEST_DIFFERENCE)
    if kind is None:
        chosen &= direction > 0.0
    if np.count_nonzero(chosen) < FEWEST:
        return None
    sums = []
    for _, block in blocks_in_spans(recording):
        rows = block.start + np.flatnonzero(chosen[block])
        if rows.size:
            design = np.stack([np.ones(rows.size), x[rows]], axis=1)
            signs = direction[rows][:, None] if kind is CurrentKind.MOTOR else 1.0
            sums.append(normal_equations(design * signs, current[rows]))
    return estimate(sums, solve, rng)


def _speeds(recording: Recording, name: str) -> tuple[FloatArray, FloatArray]:
    """Speeds of the bank of a channel and of the other bank [rad/s]."""
    right, left = filled(recording, "encoder_right"), filled(recording, "encoder_left")
    return (right, left) if name.endswith("right") else (left, right)


_MEASURES = {
    CurrentKind.MOTOR: "; its sign goes with the torque, so it is the motors' own current",
    CurrentKind.SUPPLY: "; its sign goes with the power, so it is what the motors draw from their supply",
    None: "",
}


def _direction(recording: Recording, name: str, rng: np.random.Generator) -> CheckFinding:
    kind = current_kind(recording, rng)
    found = straight_current(recording, name, kind, rng)
    if found is None:
        why = "There are too few samples of the current while driving straight."
        return not_testable(DIRECTION.check, name, why, "Drive straight pieces forwards and backwards.")
    said = f"Driving straight and forwards, the bank's current is {found.values[0]:.3g} A{_MEASURES[kind]}."
    return DIRECTION.answer(name, float(found.values[0]), found.intervals[0], meaning=said)


def _voltage(recording: Recording, name: str, rng: np.random.Generator) -> list[CheckFinding]:
    values = recording[name][np.isfinite(recording[name])]
    low, middle, high = (float(v) for v in np.quantile(values, [0.05, 0.5, 0.95]))
    if middle <= 0.0:
        why = f"Its median is {middle:.3g} V."
        return [not_testable(SAG.check, name, why, "Look at the column and its sign in the map.")]
    sag = (high - low) / middle
    said = f"Nine tenths of its samples lie between {low:.4g} and {high:.4g} V."
    return [SAG.answer(name, sag, meaning=said), _weakening(recording, name, sag, rng)]


def _weakening(recording: Recording, name: str, sag: float, rng: np.random.Generator) -> CheckFinding:
    """Whether wheels turn more slowly at a lower voltage."""
    if sag < LEAST_RANGE:
        why = f"The voltage changes by {100 * sag:.2g} % only, so that its influence on the wheels cannot be seen."
        return not_testable(WEAKENING.check, name, why, "Record a drive from a full to a nearly empty battery.")
    found = speed_exponent(recording, name, rng)
    if found is None:
        why = "Too few large commands were held until the wheels were steady."
        return not_testable(WEAKENING.check, name, why, "Hold large commands for more than 2 s at several voltages.")
    exponent = float(found.values[0])
    low, high = found.intervals[0]
    if high - low > WIDEST:
        why = f"The voltage changes by {100 * sag:.2g} %, too little beside what else changes the speed of the wheels."
        return not_testable(WEAKENING.check, name, why, "Record a drive from a full to a nearly empty battery.")
    said = f"Steady wheel speed goes with the voltage to the power of {exponent:.2f} ({low:.2f} to {high:.2f})."
    return WEAKENING.answer(name, exponent, found.intervals[0], meaning=said)


def speed_exponent(recording: Recording, name: str, rng: np.random.Generator) -> Estimate | None:
    """Exponent e of speed over command ~ voltage^e, over held commands of some size; None for too few.

    Args:
        recording: any.
        name: of VOLTAGES.
        rng: of the resampling.
    """
    held = recording.held_commands()
    steady = settled(recording, held)
    voltage = filled(recording, name)
    usable = steady & np.isfinite(voltage) & (np.nan_to_num(voltage) > 0.0)
    banks = [bank for bank in ("right", "left") if not name.endswith(("right", "left")) or name.endswith(bank)]
    sums = []
    for _, block in blocks_in_spans(recording):
        parts = [_log_ratio(recording, held[bank != "right"], f"encoder_{bank}", usable, block) for bank in banks]
        rows, ratio = (np.concatenate(column) for column in zip(*parts, strict=True))
        if rows.size:
            logarithm = np.log(voltage[rows.astype(np.int64)] / np.nanmedian(voltage[usable]))
            sums.append(normal_equations(np.stack([logarithm, np.ones(rows.size)], axis=1), ratio))
    return estimate(sums, solve, rng)


def _log_ratio(
    recording: Recording, command: FloatArray, encoder: str, usable: BoolArray, block: slice
) -> tuple[FloatArray, FloatArray]:
    """Rows of a block with a large held command, and the logarithm of speed over command there."""
    speed = recording[encoder]
    fastest = float(np.nanmax(np.abs(command))) if np.isfinite(command).any() else 0.0
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = speed / command
        chosen = usable & (np.abs(command) >= max(FASTEST_SHARE * fastest, SLOWEST)) & (ratio > 0.0)
    rows = block.start + np.flatnonzero(chosen[block])
    return rows.astype(np.float64), np.log(ratio[rows])
