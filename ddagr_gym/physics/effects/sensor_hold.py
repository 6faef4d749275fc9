"""Readings that repeat: a sensor slower than the log, or one that freezes now and then."""

import math
from dataclasses import dataclass

from ddagr_gym.physics.effects.base import DriveExtent, Effect, Vector, shape, size
from ddagr_gym.physics.layout import NOISE_CHANNELS, POINT_READINGS, READING, SAMPLE_PERIOD, TIME

_STARTED = NOISE_CHANNELS
_AGE = _STARTED + 1  # samples since each reading was new
_SENSOR_OF_READING = (0, 0, 1, 2, 2, 3, 3, 3)  # accelerometer, gyro, encoders, pose, in the order of layout.READINGS
_PROBED_DURATIONS = (0.05, 0.25)  # [s], ours: as of sensors at 20 Hz and at 4 Hz


def hold_readings(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Repeat the last readings of the chosen sensors while a hold lasts; a NaN (no new fix) stays one.

    Without intervals a reading is held from when it was new: a slow sensor's next one may come between two samples of
    the others.
    """
    period = row[SAMPLE_PERIOD]
    repeats = math.floor(parameters[0] / period + 0.5)
    cycle = math.floor(parameters[1] / period + 0.5)
    since = math.floor(row[TIME] / period + 0.5) - math.floor(parameters[2] / period + 0.5)
    at_intervals = cycle > repeats
    for j in range(NOISE_CHANNELS):
        memory[_AGE + j] += 1.0
        place = since % cycle if at_intervals else memory[_AGE + j]
        known = memory[_STARTED] == 1.0 and not math.isnan(memory[j])
        holding = known and since > 0.0 and 0.0 < place <= repeats
        if holding and parameters[3 + _SENSOR_OF_READING[j]] >= 0.5:
            if not math.isnan(row[READING + j]):
                row[READING + j] = memory[j]
        elif not (known and math.isnan(row[READING + j])):
            memory[j] = row[READING + j]
            memory[_AGE + j] = 0.0
    memory[_STARTED] = 1.0


@dataclass(frozen=True)
class SensorHold(Effect):
    """A reading is repeated for some time, again and again or at intervals.

    Durations are rounded to whole samples, so that there is no derivative.

    Attributes:
        duration: for which a reading is repeated after it was new; least: 0.04 s, a period of a 25 Hz control loop.
        interval: between the starts of holds; 0: one after the other, as of a sensor slower than the log.
        first: time of the start of the first hold.
        accelerometer: 1 when it is held, 0 when not.
        gyro: 1 when it is held, 0 when not.
        encoders: 1 when they are held, 0 when not.
        pose: 1 when it is held, 0 when not.
    """

    name = "sensor_hold"
    title = "Held readings"
    group = "sensors"
    equation = "reading(t_k) = reading(t_j), j the last sample outside a hold"
    source = "zero-order hold (Astrom and Wittenmark, Computer-Controlled Systems)"
    signature = "runs of equal values in a noisy channel; late by half a run on average"
    confused_with = ("command_delay", "pose_latency")
    differentiable = False
    actions = ((POINT_READINGS, hold_readings),)

    duration: float = size("s", 0.0, 60.0, least=0.04, step=0.02)
    interval: float = shape("s", 0.0, 1e6, default=0.0, step=0.1)
    first: float = shape("s", 0.0, 1e6, default=0.0, step=0.1)
    accelerometer: float = shape("-", 0.0, 1.0, default=1.0, step=-1.0)
    gyro: float = shape("-", 0.0, 1.0, default=1.0, step=-1.0)
    encoders: float = shape("-", 0.0, 1.0, default=1.0, step=-1.0)
    pose: float = shape("-", 0.0, 1.0, default=1.0, step=-1.0)

    @classmethod
    def probes(cls, extent: DriveExtent) -> tuple[Effect, ...]:
        """Each sensor alone, held for a short time and for a long one, without pause."""
        alone = [tuple(float(i == j) for i in range(4)) for j in range(4)]
        return tuple(cls(duration, 0.0, 0.0, *flags) for duration in _PROBED_DURATIONS for flags in alone)
