"""Recordings as everything after them sees them: faults that show in the values themselves are mended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ddagr_gym.diagnosis.preprocessing.channel_faults import ChannelFault, contradictions, find_channel_faults
from ddagr_gym.diagnosis.preprocessing.repeated_readings import (
    RepeatedReadings,
    find_repeated_readings,
    readings_left_out,
    without_repeats,
)
from ddagr_gym.diagnosis.preprocessing.reversed_gyro import ReversedGyro, find_reversed_gyro, with_gyro_reversed
from ddagr_gym.recordings.checks.findings import CheckFinding
from ddagr_gym.recordings.checks.map_lines import with_channels
from ddagr_gym.recordings.schema import Recording


@dataclass(frozen=True, eq=False)
class MendedRecordings:
    """Recordings without the faults that need no model.

    Attributes:
        given: recordings as they were read.
        recordings: the same with repeats as missing samples, readings in the channels to which they belong, and the
            sign of a reversed gyro turned.
        repeated: sensors that repeat their readings.
        reversed_gyro: evidence of a reversed gyro; None where it is right.
        channel_faults: readings that belonged to other channels.
        contradictions: what sources of one motion still say against each other.
        left_out: sensors whose repeats the column map left out.
    """

    given: tuple[Recording, ...]
    recordings: tuple[Recording, ...]
    repeated: tuple[RepeatedReadings, ...] = ()
    reversed_gyro: ReversedGyro | None = None
    channel_faults: tuple[ChannelFault, ...] = ()
    contradictions: tuple[CheckFinding, ...] = ()
    left_out: tuple[RepeatedReadings, ...] = ()

    @property
    def in_their_channels(self) -> tuple[Recording, ...]:
        """Recordings as they were read, repeats too, but for readings of other channels and a reversed gyro."""
        found = self.given
        for fault in self.channel_faults:
            found = tuple(with_channels(recording, fault.takes) for recording in found)
        return found if self.reversed_gyro is None else tuple(with_gyro_reversed(recording) for recording in found)

    @property
    def held(self) -> tuple[RepeatedReadings, ...]:
        """Sensors whose readings repeat, in the file as it is."""
        return (*self.repeated, *self.left_out)

    @property
    def holds(self) -> dict[str, float]:
        """Time for which their readings are repeated, by sensor [s]."""
        return {item.sensor: item.duration for item in self.held}

    @property
    def names(self) -> tuple[str, ...]:
        """Effects and faults that were found in the values themselves."""
        repeated = ("sensor_hold",) if self.held else ()
        faults = tuple(fault.name for fault in self.channel_faults)
        return (*repeated, *faults, *(() if self.reversed_gyro is None else ("gyro_sign",)))


def mend_recordings(recordings: Sequence[Recording], seed: int = 0) -> MendedRecordings:
    """Find and mend repeated readings, readings in the wrong channels and a reversed gyro.

    Args:
        recordings: at least one, of one robot.
        seed: of the intervals behind readings in the wrong channels.
    """
    given = tuple(recordings)
    repeated = find_repeated_readings(given)
    clean = tuple(without_repeats(recording, repeated) for recording in given) if repeated else given
    faults = find_channel_faults(clean, np.random.default_rng(seed))
    for fault in faults:
        clean = tuple(with_channels(recording, fault.takes) for recording in clean)
    reversed_gyro = find_reversed_gyro(clean)
    if reversed_gyro is not None:
        clean = tuple(with_gyro_reversed(recording) for recording in clean)
    left = contradictions(clean, np.random.default_rng(seed))
    return MendedRecordings(given, clean, repeated, reversed_gyro, faults, left, readings_left_out(given))
