"""What effects of the sensors make of a change that all readings of a channel have: a bias, before they act on it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.physics import layout
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.linear_action import linear_part

Array = NDArray[np.float64]
Chosen = NDArray[np.bool_]

INERTIAL = 3
"""The first channels: specific force and yaw rate, which have biases."""


def bias_change(
    shape: Sequence[int],
    channel: int,
    chosen: Chosen | slice = slice(None),
    effects: Sequence[Effect] = (),
    present: Callable[[str], Chosen] | None = None,
) -> Array:
    """Change (W, T, 8) of readings by one unit that is added to a channel before effects of the sensors act on it.

    Args:
        shape: of the readings.
        channel: number.
        chosen: (W,) windows in which it is added.
        effects: of the model, in their order.
        present: says by name in which windows an effect is, (W,); in all of them by default.
    """
    change = np.zeros(shape)
    change[chosen, :, channel] = 1.0
    for effect in effects:
        gain = reading_gain(effect)
        if not np.array_equal(gain, np.eye(INERTIAL)):
            rows = slice(None) if present is None else present(effect.name)
            change[rows, :, :INERTIAL] = change[rows, :, :INERTIAL] @ gain.T
    return change


def reading_gain(effect: Effect) -> Array:
    """(3, 3) derivative of inertial readings by a constant that is added to each before an effect acts.

    Of an effect that remembers readings it is taken for 1: a constant has gone through.
    """
    gain = np.eye(INERTIAL)
    for point, action in effect.acting:
        if point == layout.POINT_READINGS:
            part = linear_part(action, effect, layout.READING, INERTIAL)
            gain = gain if part.remembers else part.matrix @ gain
    return gain
