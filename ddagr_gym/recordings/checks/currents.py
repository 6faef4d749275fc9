"""Motor currents and supply voltages: do they change, have they the sign of the torque, and do the wheels weaken?

A robot that drives straight has to push itself. Over rows in which both banks turn the same way, the current of each
bank is a line in how much faster than the other bank it turns,

    i = i_0 + b x,    x = (w - w_other) sgn(w) / (|w| + |w_other|),                                                 (1)

and i_0 is what it draws driving straight. Forwards i_0 is positive. Backwards its sign says what was measured: the
motors' own current has the sign of the torque and is negative; what motors draw from their supply has the sign of the
power and is positive.
"""

from __future__ import annotations

from enum import StrEnum

import numpy as np

from ddagr_gym.recordings.channels import CURRENTS, VOLTAGES
from ddagr_gym.recordings.checks.extremes import stuck
from ddagr_gym.recordings.checks.findings import CheckFinding, Question, not_testable
from ddagr_gym.recordings.checks.regression import Estimate, blocks_in_spans, estimate, normal_equations, solve
from ddagr_gym.recordings.checks.signals import filled, moving_mask
from ddagr_gym.recordings.checks.travel import settled
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
    """What the current channels of a recording measure; None where their signs do not say it surely.

    Args:
        recording: any.
        rng: of the resampling.
    """
    found = {kind for kind in (_kind(recording, name, rng) for name in CURRENTS) if kind is not None}
    return found.pop() if len(found) == 1 else None


def wrong_sign(recording: Recording, name: str, rng: np.random.Generator) -> bool:
    """Whether a current channel surely goes against the push forwards."""
    found = straight_current(recording, name, 1, rng)
    return found is not None and found.intervals[0][1] < 0.0


def straight_current(recording: Recording, name: str, direction: int, rng: np.random.Generator) -> Estimate | None:
    """i_0 and b of equation (1) [A]; None for too few samples.

    Args:
        recording: any.
        name: of CURRENTS.
        direction: 1 forwards, -1 backwards.
        rng: of the resampling.
    """
    own, other = _speeds(recording, name)
    measured = recording[name]
    with np.errstate(invalid="ignore", divide="ignore"):
        x = (own - other) * np.sign(own) / (np.abs(own) + np.abs(other))
        chosen = np.isfinite(measured) & (np.minimum(direction * own, direction * other) > 0)
        chosen &= (np.abs(own) > SLOWEST) & (np.abs(other) > SLOWEST) & (np.abs(x) <= LARGEST_DIFFERENCE)
    if np.count_nonzero(chosen) < FEWEST:
        return None
    sums = []
    for _, block in blocks_in_spans(recording):
        rows = block.start + np.flatnonzero(chosen[block])
        if rows.size:
            design = np.stack([np.ones(rows.size), x[rows]], axis=1)
            sums.append(normal_equations(design, measured[rows]))
    return estimate(sums, solve, rng)


def _speeds(recording: Recording, name: str) -> tuple[FloatArray, FloatArray]:
    """Speeds of the bank of a channel and of the other bank [rad/s]."""
    right, left = filled(recording, "encoder_right"), filled(recording, "encoder_left")
    return (right, left) if name.endswith("right") else (left, right)


def _kind(recording: Recording, name: str, rng: np.random.Generator) -> CurrentKind | None:
    """Of one channel, by its sign backwards against that forwards."""
    signs = []
    for direction in (1, -1):
        found = straight_current(recording, name, direction, rng)
        if found is None or found.intervals[0][0] <= 0.0 <= found.intervals[0][1]:
            return None
        signs.append(np.sign(found.values[0]))
    return CurrentKind.SUPPLY if signs[0] == signs[1] else CurrentKind.MOTOR


_MEASURES = {
    CurrentKind.MOTOR: "; backwards it has the other sign, so it is the motors' own current",
    CurrentKind.SUPPLY: "; backwards it has the same sign, so it is what the motors draw from their supply",
    None: "",
}


def _direction(recording: Recording, name: str, rng: np.random.Generator) -> CheckFinding:
    found = straight_current(recording, name, 1, rng)
    if found is None:
        why = "There are too few samples of the current while driving straight and forwards."
        return not_testable(DIRECTION.check, name, why, "Drive straight pieces forwards and backwards.")
    kind = _MEASURES[_kind(recording, name, rng)]
    return DIRECTION.answer(
        name,
        float(found.values[0]),
        found.intervals[0],
        meaning=f"Driving straight and forwards, the bank's current is {found.values[0]:.3g} A{kind}.",
    )


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
