"""Recordings as everything after them sees them: faults that show in the values themselves are mended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ddagr_gym.diagnosis.preprocessing.repeated_readings import (
    RepeatedReadings,
    find_repeated_readings,
    without_repeats,
)
from ddagr_gym.diagnosis.preprocessing.reversed_gyro import ReversedGyro, find_reversed_gyro, with_gyro_reversed
from ddagr_gym.recordings.schema import Recording


@dataclass(frozen=True, eq=False)
class MendedRecordings:
    """Recordings without the faults that need no model.

    Attributes:
        given: recordings as they were read.
        recordings: the same with repeats as missing samples, and the sign of a reversed gyro turned.
        repeated: sensors that repeat their readings.
        reversed_gyro: evidence of a reversed gyro; None where it is right.
    """

    given: tuple[Recording, ...]
    recordings: tuple[Recording, ...]
    repeated: tuple[RepeatedReadings, ...] = ()
    reversed_gyro: ReversedGyro | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Effects that were found in the values themselves."""
        repeated = ("sensor_hold",) if self.repeated else ()
        return repeated if self.reversed_gyro is None else (*repeated, "gyro_sign")


def mend_recordings(recordings: Sequence[Recording]) -> MendedRecordings:
    """Find and mend repeated readings and a reversed gyro.

    Args:
        recordings: at least one, of one robot.
    """
    given = tuple(recordings)
    repeated = find_repeated_readings(given)
    clean = tuple(without_repeats(recording, repeated) for recording in given) if repeated else given
    reversed_gyro = find_reversed_gyro(clean)
    if reversed_gyro is not None:
        clean = tuple(with_gyro_reversed(recording) for recording in clean)
    return MendedRecordings(given, clean, repeated, reversed_gyro)
