"""A gyro that turns the wrong way, found before anything is fitted: the windows' first guesses come from its readings.

A skid-steer robot turns the way its banks differ, on any ground; a gyro that says the opposite throughout is mounted
or logged with the other sign.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.recordings.schema import Recording

Banks = tuple[NDArray[np.float64], NDArray[np.float64]]

LEAST_CORRELATION = 0.5
"""Negative correlation of yaw rate and difference of bank speeds from which on the gyro is reversed (ours: ordinary
drives have +0.9 and more, a dead gyro none)."""

FEWEST = 200
"""Samples that a correlation needs (ours: its standard error is then 0.07)."""


OLDEST = 0.5
"""Age up to which a reading of one bank stands beside the other's, where they are read in turn [s] (ours: twice the
period of encoders at 4 Hz)."""


@dataclass(frozen=True)
class ReversedGyro:
    """Evidence of a reversed gyro.

    Attributes:
        correlation: of yaw rate and difference of bank speeds [-].
        samples: that it is from.
    """

    correlation: float
    samples: int


def find_reversed_gyro(recordings: Sequence[Recording]) -> ReversedGyro | None:
    """Correlation over all recordings, where it is strongly negative in all that show it.

    Encoders speak where there are some, else commands. Where commands agree with the gyro it is the encoders that are
    swapped or reversed; where recordings contradict each other the gyro is not the one thing that is wrong.
    """
    measured = [_turning(recording, _measured_banks(recording)) for recording in recordings]
    driven = [_turning(recording, recording.held_commands()) for recording in recordings]
    rate, difference = np.concatenate(measured, axis=1)
    correlation = _correlation(rate, difference)
    if correlation is None or correlation >= -LEAST_CORRELATION:
        return None
    others = [_correlation(*one) for one in measured] + [_correlation(*np.concatenate(driven, axis=1))]
    if any(other is not None and other > LEAST_CORRELATION for other in others):
        return None
    return ReversedGyro(correlation, len(rate))


def _measured_banks(recording: Recording) -> Banks:
    """Bank speeds (right, left), or what they are asked to be where no encoder says."""
    if not recording.has("encoder_right", "encoder_left"):
        return recording.held_commands()
    right, left = recording["encoder_right"], recording["encoder_left"]
    together = np.isfinite(right) & np.isfinite(left)
    return (right, left) if together.sum() >= FEWEST else recording.held_encoders(OLDEST)


def _turning(recording: Recording, banks: Banks) -> NDArray[np.float64]:
    """(2, N) yaw rate and difference of bank speeds where all are known."""
    rows = np.stack([recording["yaw_rate"], banks[0] - banks[1]])
    return rows[:, np.isfinite(rows).all(axis=0)]


def _correlation(rate: NDArray[np.float64], difference: NDArray[np.float64]) -> float | None:
    """Of the two; None where there are too few samples or one of them never changes."""
    if len(rate) < FEWEST or rate.std() == 0.0 or difference.std() == 0.0:
        return None
    return float(np.corrcoef(rate, difference)[0, 1])


def with_gyro_reversed(recording: Recording) -> Recording:
    """Recording with the sign of the yaw rate mended."""
    return replace(recording, channels={**recording.channels, "yaw_rate": -recording["yaw_rate"]})
