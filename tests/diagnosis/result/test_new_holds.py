"""Readings that are repeated for longer than before are a change; those that always were are none."""

from __future__ import annotations

import pytest

from ddagr_gym.diagnosis.preprocessing.mended_recordings import MendedRecordings
from ddagr_gym.diagnosis.preprocessing.repeated_readings import RepeatedReadings
from ddagr_gym.diagnosis.result.channel_fault_findings import new_holds


def mended(**held: float) -> MendedRecordings:
    """Drives whose sensors hold their readings for so long [s]."""
    repeated = tuple(RepeatedReadings(name, 0.8, duration, 500) for name, duration in held.items())
    return MendedRecordings((), (), repeated)


@pytest.mark.parametrize(
    ("after", "before", "new"),
    [
        ({"gyro": 0.2}, {}, ["gyro"]),
        ({"gyro": 0.2}, {"gyro": 0.2}, []),
        ({"gyro": 0.22, "encoders": 0.2}, {"gyro": 0.2}, ["encoders"]),
        ({"gyro": 0.4}, {"gyro": 0.2}, ["gyro"]),
        ({}, {"gyro": 0.2}, []),
    ],
)
def test_a_hold_is_new_where_it_is_longer_than_before(after, before, new):
    assert [item.sensor for item in new_holds(mended(**after), mended(**before).holds)] == new


def test_where_it_is_not_known_what_is_usual_no_hold_is_called_new():
    assert new_holds(mended(gyro=0.2), None) == ()
