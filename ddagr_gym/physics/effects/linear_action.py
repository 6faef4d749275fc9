"""What an effect's action does to entries of a row of the simulator, found by calling it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.parameters import STANDARD_GRAVITY
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects.base import Action, Effect

Array = NDArray[np.float64]

_PERIOD = 0.008


@dataclass(frozen=True, eq=False)
class LinearPart:
    """What an action makes of entries: offset, and what a unit of each adds to that.

    Attributes:
        matrix: (n, n).
        offset: (n,).
        remembers: whether the action wrote to its memory; the rest then holds for a first call only.
    """

    matrix: Array
    offset: Array
    remembers: bool


def linear_part(action: Action, effect: Effect, place: int, size: int) -> LinearPart:
    """What an action makes of ``size`` entries from ``place`` on, of a robot at rest on level ground."""
    offset, remembers = acted_on(action, effect, place, np.zeros(size))
    columns = [acted_on(action, effect, place, unit) for unit in np.eye(size)]
    matrix = np.column_stack([values - offset for values, _ in columns])
    return LinearPart(matrix, offset, remembers or any(own for _, own in columns))


def acted_on(action: Action, effect: Effect, place: int, values: Array, motion: float = 0.0) -> tuple[Array, bool]:
    """Entries after an action with an empty memory, and whether it wrote to that.

    Args:
        action: of the effect.
        effect: with its parameters.
        place: of the first entry in the row.
        values: (n,) of the entries before.
        motion: of the robot: its speeds and accelerations.
    """
    row, memory = np.zeros(layout.SIZE), np.zeros(layout.EFFECT_MEMORY)
    row[layout.SAMPLE_PERIOD], row[layout.GRAVITY + 2] = _PERIOD, -STANDARD_GRAVITY
    row[layout.ACCELEROMETER_SCALE : layout.ACCELEROMETER_SCALE + 2] = 1.0
    row[[layout.V_X, layout.YAW_RATE, layout.MEAN_YAW_ACCELERATION, layout.OMEGA]] = motion
    row[place : place + len(values)] = values
    action(row, effect.vector(), memory)
    return row[place : place + len(values)].copy(), bool(memory.any())
