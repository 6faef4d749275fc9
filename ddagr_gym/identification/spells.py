"""Which windows an effect is present in, where it begins or ends in a drive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.windows import WindowSet

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Spell:
    """An effect that begins at a time of a recording, or ends there; recordings follow each other as they are given.

    Attributes:
        recording: number, from 0.
        time: of that recording [s].
        ends: whether it is present before the time instead of from it on.
    """

    recording: int
    time: float
    ends: bool = False

    def holds(self, recording: NDArray[np.int64], start: Array, end: Array) -> NDArray[np.bool_]:
        """(W,) windows in which the effect is present: those whose larger part is on its side of the time.

        Args:
            recording: (W,) of each window.
            start: (W,) time of the recording [s].
            end: (W,) the same.
        """
        own = recording == self.recording
        later = (recording > self.recording) | (own & (0.5 * (start + end) >= self.time))
        return np.asarray(~later if self.ends else later)

    def in_windows(self, windows: WindowSet) -> NDArray[np.bool_]:
        """The same of a set of windows."""
        return self.holds(windows.recording, windows.time, windows.time + windows.duration)
