"""A gyro that turns the wrong way, found before anything is fitted: the windows' first guesses come from its readings.

A skid-steer robot turns the way its banks differ, on any ground; a gyro that says the opposite throughout is mounted
or logged with the other sign.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ddagr_gym.recordings.schema import Recording

LEAST_CORRELATION = 0.5
"""Negative correlation of yaw rate and difference of bank speeds that says so (ours: ordinary drives have 0.9 and more,
a dead gyro none)."""

FEWEST = 200
"""Samples that a correlation needs."""


@dataclass(frozen=True)
class Flipped:
    """Evidence of a reversed gyro.

    Attributes:
        correlation: of yaw rate and difference of bank speeds [-].
        samples: that it is from.
    """

    correlation: float
    samples: int


def find_flipped_gyro(recordings: Sequence[Recording]) -> Flipped | None:
    """Correlation over all recordings, where it is strongly negative."""
    rates, differences = [], []
    for recording in recordings:
        banks = recording["encoder_right"], recording["encoder_left"]
        if not recording.has("encoder_right", "encoder_left"):
            banks = recording.held_commands()
        both = np.isfinite(recording["yaw_rate"]) & np.isfinite(banks[0]) & np.isfinite(banks[1])
        rates.append(recording["yaw_rate"][both])
        differences.append((banks[0] - banks[1])[both])
    rate, difference = np.concatenate(rates), np.concatenate(differences)
    if len(rate) < FEWEST or rate.std() == 0.0 or difference.std() == 0.0:
        return None
    correlation = float(np.corrcoef(rate, difference)[0, 1])
    return Flipped(correlation, len(rate)) if correlation < -LEAST_CORRELATION else None


def with_gyro_turned(recording: Recording) -> Recording:
    """Recording with the sign of the yaw rate mended."""
    return replace(recording, channels={**recording.channels, "yaw_rate": -recording["yaw_rate"]})
