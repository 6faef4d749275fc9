"""What the motors get of the commands that are sent: late, and mapped as named effects map them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.control.timing import CONTROL_PERIOD
from ddagr_gym.evaluation.known_physics import KnownPhysics

Array = NDArray[np.float64]

_LONGEST = 256
"""Samples of commands that are kept: two seconds at the sensors' nominal rate, longer than any delay."""


class ReceivedCommands:
    """The commands of an episode as they arrive.

    Args:
        known: delay of either bank, and the map of commands.
    """

    def __init__(self, known: KnownPhysics) -> None:
        self._known = known
        self.reset()

    def reset(self) -> None:
        """Forget what was sent."""
        self._sent = np.zeros((0, 2))

    def through(self, command: Array, count: int) -> Array:
        """Commands (count, 2) that the motors get at each sample of a control interval under ``command`` (2,) [rad/s].

        Of wheels that differ in radius they are those of wheels of the mean radius.
        """
        self._sent = np.concatenate([self._sent, np.repeat(command[None], count, axis=0)])[-_LONGEST:]
        late = np.round(np.array(self._known.delay) * count / CONTROL_PERIOD).astype(int)
        banks = []
        for bank in range(2):
            rows = len(self._sent) - count + np.arange(count) - late[bank]
            banks.append(np.where(rows >= 0, self._sent[np.maximum(rows, 0), bank], 0.0))
        got = np.column_stack(banks) @ self._known.commands.matrix.T + self._known.commands.offset
        return np.asarray(got * self._known.radius_factors)
