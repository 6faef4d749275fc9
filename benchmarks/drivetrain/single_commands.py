"""What a number of its own for every command could mend: when the command acts, and the load that resists turning.

Both are fitted in sample, one number for some forty readings: no forecast can know them. What they leave bounds what a
better model of lateness or load could gain.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.drivetrain.model import STEP, predict
from benchmarks.drivetrain.parameters import ANTI_WINDUP, parameter_vector
from benchmarks.drivetrain.scores import loss, rms, summed
from benchmarks.drivetrain.stretches import Stretch

Array = NDArray[np.float64]

SHIFTS = np.arange(-0.30, 0.501, 0.04)
"""Shifts that are tried [s], about the mean delay of 0.2 s."""
FINER = np.array([-0.02, -0.01, 0.0, 0.01, 0.02])
LOADS = np.array([0.0, 0.25, 0.5, 0.7, 0.85, 1.0, 1.15, 1.3, 1.6, 2.0, 3.0])
"""Factors on the turning load that are tried."""
ROUNDS = 2
"""Rounds over the commands of a stretch; the third changes no shift by more than FINER."""
HORIZON = 5.0
"""Time over which the error of the turning is summed [s], that of the forecasts of headings."""
SHORTEST = 4.0
"""Steps that are shorter are not judged [s]."""
HALF = 3.0
"""Time since a command from which readings judge a load that those before it chose [s]: half of a step."""
FEWEST = 8
"""Readings that either half needs: one second of both banks."""


def chosen_by_command(
    first: int, start: Array, trials: Callable[[int, float], Array], left: Callable[[Array], Array]
) -> Array:
    """A number (m,) for every command that suits the readings best, one command after the other, in rounds.

    Args:
        first: command that is the first to be changed.
        start: (m,) numbers.
        trials: numbers that are tried, by round and the present one.
        left: residuals (n,) with some numbers.
    """
    found = start.copy()
    for number in range(ROUNDS):
        for event in range(first, len(found)):
            tried = trials(number, found[event])
            costs = []
            for trial in tried:
                found[event] = trial
                costs.append(float(loss(left(found)).sum()))
            found[event] = tried[int(np.argmin(costs))]
    return found


def with_shifts(stretch: Stretch, shifts: Array) -> Stretch:
    """A stretch whose commands (m,) act so much later [s]; none overtakes another."""
    return replace(stretch, times=np.maximum.accumulate(stretch.times + shifts))


def best_shifts(stretch: Stretch, values: Mapping[str, float], windup: str) -> Array:
    """Shift (m,) of each command that suits the readings best [s]."""
    p, form = parameter_vector(values), ANTI_WINDUP[windup]
    return chosen_by_command(
        1 if stretch.known else 0,
        np.zeros(len(stretch.times)),
        lambda number, shift: SHIFTS if number == 0 else shift + FINER,
        lambda shifts: stretch.value - predict(p, with_shifts(stretch, shifts), form),
    )


def best_loads(stretch: Stretch, values: Mapping[str, float], windup: str) -> Array:
    """Factor (m,) on the turning load under each command that suits the readings best."""
    p, form = parameter_vector(values), ANTI_WINDUP[windup]
    return chosen_by_command(
        0,
        np.ones(len(stretch.times)),
        lambda number, load: LOADS,
        lambda loads: stretch.value - predict(p, stretch, form, loads=loads),
    )


def turning_errors(stretch: Stretch, left: Array) -> Array:
    """Half the difference of both banks' residuals, summed over 5 s of every step that is long enough (k,) [rad].

    Args:
        stretch: that is read; between readings a bank's residual is a straight line.
        left: residuals (n,) of its readings [rad/s].
    """
    ends = np.append(stretch.times[1:], stretch.duration)
    found = []
    for start, end in zip(stretch.times, ends, strict=True):
        if end - start < SHORTEST:
            continue
        t = np.arange(start, min(start + HORIZON, end), STEP)
        right, other = (np.interp(t, stretch.time[mine], left[mine]) for mine in (stretch.bank == 0, stretch.bank == 1))
        found.append(STEP * float((right - other).sum()) / 2.0)
    return np.array(found)


def second_halves(stretch: Stretch, values: Mapping[str, float], windup: str) -> tuple[Array, Array]:
    """Losses (k,) of the second halves of steps, with the load of all and with what suits the first half best.

    Args:
        stretch: whose steps are long enough, or skipped.
        values: of the model.
        windup: of ANTI_WINDUP.
    """
    p, form = parameter_vector(values), ANTI_WINDUP[windup]
    as_it_is = stretch.value - predict(p, stretch, form)
    pairs = []
    for event in range(len(stretch.times)):
        mine = stretch.step == stretch.first + event
        early, late = mine & (stretch.since < HALF), mine & (stretch.since >= HALF)
        if min(early.sum(), late.sum()) < FEWEST:
            continue
        loads = np.ones(len(stretch.times))
        tried = []
        for loads[event] in LOADS:
            tried.append(stretch.value - predict(p, stretch, form, loads=loads))
        best = min(tried, key=lambda left, early=early: float(loss(left[early]).sum()))
        pairs.append((float(loss(as_it_is[late]).sum()), float(loss(best[late]).sum())))
    before, after = np.array(pairs).reshape(-1, 2).T
    return before, after


def summary(stretches: Sequence[Stretch], values: Mapping[str, float], windup: str) -> dict[str, Any]:
    """What one number a command mends in a drive, in sample, and whether a load is found again.

    Args:
        stretches: of one drive.
        values: of the model.
        windup: of ANTI_WINDUP.
    """
    p, form = parameter_vector(values), ANTI_WINDUP[windup]
    shifts = [best_shifts(s, values, windup) for s in stretches]
    late = [with_shifts(s, shift) for s, shift in zip(stretches, shifts, strict=True)]
    loads = [best_loads(s, values, windup) for s in stretches]
    both = [best_loads(s, values, windup) for s in late]
    moved = {
        "as_fitted": (stretches, None),
        "own_lateness": (late, None),
        "own_load": (stretches, loads),
        "both": (late, both),
    }
    errors = {name: _errors(stretches, of, factors, p, form) for name, (of, factors) in moved.items()}
    halves = [second_halves(s, values, windup) for s in stretches]
    before, after = (np.concatenate(losses) for losses in zip(*halves, strict=True))
    in_a_row = np.concatenate([np.log(np.maximum(f, LOADS[1])) for f in loads])
    return {
        "lateness": _quantiles(np.concatenate([s[1:] for s in shifts])),
        "load": _quantiles(np.concatenate(loads)),
        "wheel_speeds_rms": {name: rms(residual) for name, (residual, _) in errors.items()},
        "turning_rms": {name: rms(turning) for name, (_, turning) in errors.items()},
        "steps": len(errors["as_fitted"][1]),
        "loads_of_neighbours_correlation": float(np.corrcoef(in_a_row[:-1], in_a_row[1:])[0, 1]),
        "second_halves_loss": {
            "as_fitted": float(before.sum()),
            "load_of_first_half": float(after.sum()),
            "deviation_of_change": summed(after - before)[1],
        },
    }


def _errors(
    stretches: Sequence[Stretch], moved: Sequence[Stretch], loads: Sequence[Array] | None, p: Array, form: int
) -> tuple[Array, Array]:
    """Residuals (n,) [rad/s] and errors of the turning (k,) [rad] of a drive with some commands' numbers changed."""
    residuals, turnings = [], []
    for number, (stretch, driven) in enumerate(zip(stretches, moved, strict=True)):
        left = stretch.value - predict(p, driven, form, loads=None if loads is None else loads[number])
        residuals.append(left)
        turnings.append(turning_errors(stretch, left))
    return np.concatenate(residuals), np.concatenate(turnings)


def _quantiles(numbers: Array) -> dict[str, Any]:
    """5, 25, 50, 75 and 95 % of them, a robust standard deviation, and how many there are."""
    found = np.percentile(numbers, [5, 25, 50, 75, 95])
    return {
        "quantiles_5_25_50_75_95": found.tolist(),
        "robust_deviation": float(0.741 * (found[3] - found[1])),
        "commands": len(numbers),
    }
