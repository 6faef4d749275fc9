"""Stamps that go back while messages arrive: a clock that was set back in mid-drive, or a simulator that began anew."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.schema import FloatArray

LARGEST_DISORDER = 1.0
"""Fall of stamps in the order of arrival [s] up to which messages were merely delivered out of order (ours)."""
SHORTEST_STRETCH = 20
"""Messages between falls (mean) below which a file is in no order at all rather than by a clock that was set (ours)."""
MOST_CHANGES = 10
"""Changes from one stretch to another for each fall, in the order of stamps, up to which they are whole blocks (ours):
1.5 s of a slow topic, 5 Hz, that come again give 14."""


@dataclass(frozen=True)
class StepBack:
    """Where stamps go back.

    Attributes:
        fall: by how much [s].
        after: time of receipt of the last message before it, from the topic's first [s].
        received_too: whether the times of receipt go back with them.
    """

    fall: float
    after: float
    received_too: bool

    def refusal(self, place: str) -> InputError:
        """What is said of it; ``place`` names file and topic."""
        stamps, remedy = "header stamps go", "set stamps: receive in the topic map, or cut the bag there"
        if self.received_too:
            stamps, remedy = "stamps and times of receipt go", "cut the bag there"
        return InputError(
            f"{place}: its {stamps} back by {self.fall:.4g} s, {self.after:.4g} s after its first message, as when a "
            f"clock is set or a simulator begins anew: {remedy}."
        )


def step_back(t: FloatArray, received: FloatArray) -> StepBack | None:
    """Where the stamps of a topic go back by more than disorder explains; None where sorting them is right.

    Times of receipt tell the order of arrival of files that were written in any order. Where the recorder's clock was
    set too, only the order of the file is left to tell.

    Args:
        t: stamps [s], (n,), in the order of the file.
        received: times of receipt [s], (n,).
    """
    if not _falls(t).size:
        return None
    order = np.argsort(received, kind="stable")
    falls = _falls(t[order])
    if falls.size:
        return _largest(t[order], received[order], falls, received_too=False)
    falls = _falls(t)
    return _largest(t, received, falls, received_too=True) if _would_interleave(t, falls) else None


def _falls(t: FloatArray) -> npt.NDArray[np.int64]:
    """Places behind which stamps are earlier by more than disorder."""
    return np.flatnonzero(np.diff(t) < -LARGEST_DISORDER)


def _largest(t: FloatArray, received: FloatArray, falls: npt.NDArray[np.int64], *, received_too: bool) -> StepBack:
    place = falls[np.argmax(t[falls] - t[falls + 1])]
    return StepBack(float(t[place] - t[place + 1]), float(received[place] - received[0]), received_too)


def _would_interleave(t: FloatArray, falls: npt.NDArray[np.int64]) -> bool:
    """Whether sorting mixes long stretches of a file, as it does not with blocks in another order."""
    if t.size < SHORTEST_STRETCH * (falls.size + 1):
        return False
    stretch = np.zeros(t.size, dtype=np.int64)
    stretch[falls + 1] = 1
    changes = np.diff(np.cumsum(stretch)[np.argsort(t, kind="stable")])
    return int(np.count_nonzero(changes)) > MOST_CHANGES * falls.size
