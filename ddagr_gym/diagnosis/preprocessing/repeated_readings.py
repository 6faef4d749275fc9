"""Repeated readings, found in the values themselves: a noisy sensor hardly ever reads exactly the same twice.

No model is needed, and none could say it as surely. Repeats are then treated as what they are, "no new sample", and the
rest of the diagnosis sees the readings that were new.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.physics.effects.sensor_hold import SensorHold
from ddagr_gym.recordings.schema import Recording

Flags = NDArray[np.bool_]
Rows = NDArray[np.int64]

SENSORS = {
    "accelerometer": ("specific_force_x", "specific_force_y"),
    "gyro": ("yaw_rate",),
    "encoders": ("encoder_right", "encoder_left"),
    "pose": ("pose_x", "pose_y", "pose_yaw"),
}
"""Channels by flag of the effect."""

LEAST_SHARE = 0.2
"""Share of repeats that counts as holding; white noise of 100 quanta repeats in 0.3 percent, a hold every other sample
in 50 (ours, between the two)."""

FEWEST = 30
"""Samples that a share needs (ours)."""

_REACH = 5
"""Samples before and after one over which its reading must change for a repeat to be informative (ours)."""

_QUANTA = 20.0
"""Quanta by which it must change over these 2 x 5 samples: two per sample, so that an honest count hardly repeats
(ours)."""


_TOGETHER = 0.1
"""Share of the changes below which two channels do not change together (ours): 0.1 percent of them do where the wheels
of a Warthog are read in turn, nearly all where both are read at once."""


_BEYOND = 1.5
"""Times the stated period from which a sensor is slower than its map says (ours)."""


@dataclass(frozen=True)
class RepeatedReadings:
    """A sensor that repeats its readings.

    Attributes:
        sensor: of SENSORS.
        share: of samples that repeat the one before.
        duration: mean time for which a reading that is repeated is repeated after it was new [s].
        samples: that were looked at.
    """

    sensor: str
    share: float
    duration: float
    samples: int


def _repeats(recording: Recording, names: Sequence[str]) -> tuple[Flags, Flags]:
    """Samples in which all channels of a sensor repeat, and which of them say something, in the order of new samples.

    A steady robot's encoders repeat the same count: only samples in which the reading changes by two quanta per sample
    are looked at.
    """
    rows, repeat = repeated_rows(recording, names)
    values = np.stack([recording[name][rows] for name in names], axis=1)
    if len(values) < 2 * _REACH + 2:
        return np.zeros(0, dtype=bool), np.zeros(0, dtype=bool)
    informative = np.zeros(len(values), dtype=bool)
    steps = np.abs(np.diff(values, axis=0))
    quantum = np.array([np.min(s[s > 0.0], initial=np.inf) for s in steps.T])
    change = np.abs(values[2 * _REACH :] - values[: -2 * _REACH])
    informative[_REACH:-_REACH] = (change > _QUANTA * quantum).any(axis=1)
    return repeat, informative


def channel_groups(recording: Recording, sensor: str) -> tuple[tuple[str, ...], ...]:
    """Channels of a sensor that are read together: all of them, or each by itself where they change in turn.

    Args:
        recording: with all of them.
        sensor: of SENSORS.
    """
    names = SENSORS[sensor]
    values = np.stack([recording[name] for name in names], axis=1)
    changed = np.diff(values[np.isfinite(values).all(axis=1)], axis=0) != 0.0
    at_once, at_all = int(changed.all(axis=1).sum()), int(changed.any(axis=1).sum())
    return tuple((name,) for name in names) if at_once < _TOGETHER * at_all else (names,)


def find_repeated_readings(recordings: Sequence[Recording]) -> tuple[RepeatedReadings, ...]:
    """Sensors that repeat their readings in more than :data:`LEAST_SHARE` of the samples that say something."""
    found = []
    for sensor, names in SENSORS.items():
        read = [(r, group) for r in recordings if r.has(*names) for group in channel_groups(r, sensor)]
        pairs = [_repeats(recording, group) for recording, group in read]
        informative = sum(int(t.sum()) for _, t in pairs)
        if informative < FEWEST:
            continue
        share = sum(int((repeat & t).sum()) for repeat, t in pairs) / informative
        if share > LEAST_SHARE:
            found.append(RepeatedReadings(sensor, share, _duration(read), informative))
    return tuple(found)


def readings_left_out(recordings: Sequence[Recording]) -> tuple[RepeatedReadings, ...]:
    """Sensors of which the column map has left out repeated readings in more than :data:`LEAST_SHARE` of the samples.

    A simulator whose sensors read anew at every sample lacks that as much as where the map says nothing. A sensor whose
    period the map states is known to be slow, and nothing is missing while it keeps it.

    Args:
        recordings: as they were read.
    """
    found = []
    for sensor, names in SENSORS.items():
        held = [r for r in recordings if r.has(*names) and any(_repeats_unstated(r, name) for name in names)]
        if not held:
            continue
        rows = sum(len(r) for r in held)
        read = float(np.mean([np.isfinite(r[name]).sum() for r in held for name in names])) * len(held)
        between = float(np.median([1.0 / rate for r in held for name in names if (rate := r.rate(name)) > 0.0]))
        repeat = between - float(np.median([r.period for r in held]))
        share = 1.0 - read / rows
        if share > LEAST_SHARE and repeat > 0.0:
            found.append(RepeatedReadings(sensor, share, repeat, rows))
    return tuple(found)


def _repeats_unstated(recording: Recording, name: str) -> bool:
    """Whether a channel is held for a time that its map does not state, or far beyond the one that it states."""
    stated = recording.meta.held.get(name)
    rate = recording.rate(name)
    return stated is not None and rate > 0.0 and 1.0 / rate > _BEYOND * stated


def repeat_runs(repeat: Flags) -> tuple[Rows, Rows]:
    """Of each run of repeats the sample that is repeated, -1 where that is before the first one, and the last repeat.

    Args:
        repeat: (n,) whether a sample repeats the one before.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], repeat, [False]]).astype(int)))
    return edges[::2] - 1, edges[1::2] - 1


def _duration(read: Sequence[tuple[Recording, Sequence[str]]]) -> float:
    """Mean time over which runs of repeats last [s], of channels that are read together in each recording.

    Samples are informative only near a change, so that the share of repeats says nothing of longer holds. Runs
    without such a sample do not count: successive holds of a steady reading look like one.
    """
    found = []
    for recording, names in read:
        _, informative = _repeats(recording, names)
        if informative.any():
            rows, repeat = repeated_rows(recording, names)
            first, last = repeat_runs(repeat)
            hits = np.cumsum(repeat & informative)
            found.append((recording.t[rows[last]] - recording.t[rows[first]])[hits[last] > hits[first]])
    lengths = np.concatenate(found)
    # where nothing but zeros repeats there are none
    return float(lengths.mean() if len(lengths) else 1.0 / np.median([r.rate(names[0]) for r, names in read]))


def repeated_rows(recording: Recording, names: Sequence[str]) -> tuple[NDArray[np.int64], Flags]:
    """Rows (n,) with a reading of all channels, and whether each repeats the reading before.

    Encoders of a robot at rest read zero all the time: zeros are no repeats.
    """
    values = np.stack([recording[name] for name in names], axis=1)
    rows = np.flatnonzero(np.isfinite(values).all(axis=1))
    same = np.zeros(len(rows), dtype=bool)
    same[1:] = (values[rows[1:]] == values[rows[:-1]]).all(axis=1)
    return rows, same & ~(values[rows] == 0.0).all(axis=1)


def without_repeats(recording: Recording, repeated: Sequence[RepeatedReadings]) -> Recording:
    """Recording in which repeated readings of the given sensors are missing samples."""
    channels = dict(recording.channels)
    for item in repeated:
        for names in _groups_present(recording, item.sensor):
            rows, same = repeated_rows(recording, names)
            for name in names:
                changed = channels[name].copy()
                changed[rows[same]] = np.nan
                channels[name] = changed
    return replace(recording, channels=channels)


def _groups_present(recording: Recording, sensor: str) -> tuple[tuple[str, ...], ...]:
    """Channels of a sensor that are read together, as far as the recording has them."""
    names = tuple(name for name in SENSORS[sensor] if recording.has(name))
    if names == SENSORS[sensor]:
        return channel_groups(recording, sensor)
    return (names,) if names else ()


def hold_effect(repeated: Sequence[RepeatedReadings]) -> SensorHold:
    """The finding as an effect of the library, with the longest duration of any sensor that it allows."""
    flags = {sensor: float(any(item.sensor == sensor for item in repeated)) for sensor in SENSORS}
    longest = min(max(item.duration for item in repeated), SensorHold.parameter("duration").metadata["high"])
    return SensorHold(longest, **flags)
