"""Whether the load that resists turning depends on what a drive does: speed, direction, radius, reversal, time.

The logarithm of the load may be a constant and a multiple of one quantity of each command. Readings are linearised in
it, and both numbers are fitted and judged on different steps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.drivetrain.fit import SCALE
from benchmarks.drivetrain.model import predict
from benchmarks.drivetrain.parameters import ANTI_WINDUP, parameter_vector
from benchmarks.drivetrain.scores import by_step, joined, summed
from benchmarks.drivetrain.stretches import Stretch

Array = NDArray[np.float64]

NUDGE = 1.1
"""Factor on the load by which readings are linearised."""
PARTS = 10
"""Parts of the steps that are judged in turn by the others."""
SPEED, TURNING = 10.0, 8.0
"""Mean and half difference of the banks that count as 1 [rad/s]: fast ones of these drives."""


def quantities(before: Array, command: Array, share: float) -> dict[str, float]:
    """What a command is, each about from -1 to 1.

    Args:
        before: command (2,) before it, right and left [rad/s].
        command: (2,) [rad/s].
        share: of the drive's commands that went before.
    """
    mean, half = command.mean(), (command[0] - command[1]) / 2.0
    mean_before, half_before = before.mean(), (before[0] - before[1]) / 2.0
    return {
        "forwards": float(np.sign(mean)),
        "to the left": float(np.sign(half)),
        "to the left going forwards": float(np.sign(mean * half)),
        "speed": abs(mean) / SPEED,
        "turning": abs(half) / TURNING,
        "tightness": abs(half) / max(abs(mean) + abs(half), 1e-9),
        "speed reversed": float(mean * mean_before < 0.0),
        "turning reversed": float(half * half_before < 0.0),
        "change of speed": abs(mean - mean_before) / SPEED,
        "change of turning": abs(half - half_before) / TURNING,
        "from rest": float(not before.any()),
        "time": share - 0.5,
    }


def tried(stretches: Sequence[Stretch], values: Mapping[str, float], windup: str) -> dict[str, dict[str, float]]:
    """Change of the weighted squared residual with a load that depends on one quantity, its deviation, the multiple.

    Args:
        stretches: of one drive.
        values: of the model.
        windup: of ANTI_WINDUP.
    """
    p, form = parameter_vector(values), ANTI_WINDUP[windup]
    count = stretches[-1].first + len(stretches[-1].times)
    residuals, columns = [], []
    names: tuple[str, ...] = ()
    for stretch in stretches:
        as_it_is = predict(p, stretch, form)
        known = [
            quantities(stretch.command_before(k), command, (stretch.first + k) / count)
            for k, command in enumerate(stretch.events)
        ]
        names = tuple(known[0])
        by_command = np.stack([_sensitivity(p, stretch, form, k, as_it_is) for k in range(len(known))], axis=1)
        residuals.append(stretch.value - as_it_is)
        columns.append(by_command @ np.array([[1.0, *item.values()] for item in known]))
    left, x, step = np.concatenate(residuals), np.concatenate(columns), joined(stretches, "step")
    weight = 1.0 / np.sqrt(1.0 + (left / SCALE) ** 2)
    return {name: _judged(left, x[:, [0, k]], weight, step) for k, name in enumerate(names, 1)}


def _sensitivity(p: Array, stretch: Stretch, form: int, number: int, as_it_is: Array) -> Array:
    """Change of the readings (n,) with the logarithm of the load under one command."""
    loads = np.ones(len(stretch.times))
    loads[number] = NUDGE
    return (predict(p, stretch, form, loads=loads) - as_it_is) / np.log(NUDGE)


def _judged(left: Array, columns: Array, weight: Array, step: NDArray[np.int64]) -> dict[str, float]:
    """Change of the weighted squares (n,) of steps that constant and multiple have not seen, and its deviation."""
    after = left.copy()
    part = (step // 2) % PARTS
    for k in range(PARTS):
        mine = part == k
        after[mine] -= columns[mine] @ _fitted(left[~mine], columns[~mine], weight[~mine])
    change, deviation = summed(by_step(step, weight * (after**2 - left**2)))
    return {
        "change": change,
        "deviation": deviation,
        "multiple": float(_fitted(left, columns, weight)[1]),
    }


def _fitted(left: Array, columns: Array, weight: Array) -> Array:
    """Constant and multiple (2,) by weighted least squares."""
    root = np.sqrt(weight)
    return np.asarray(np.linalg.lstsq(columns * root[:, None], left * root, rcond=None)[0])


def all_tried(
    drives: Mapping[str, Sequence[Stretch]], values: Mapping[str, Mapping[str, float]], windup: str
) -> dict[str, Any]:
    """Of all drives, and of them together."""
    found = {drive: tried(stretches, values[drive], windup) for drive, stretches in drives.items()}
    names = next(iter(found.values()))
    together = {
        name: {
            "change": sum(of[name]["change"] for of in found.values()),
            "deviation": float(np.sqrt(sum(of[name]["deviation"] ** 2 for of in found.values()))),
        }
        for name in names
    }
    return {"drives": found, "together": together}
