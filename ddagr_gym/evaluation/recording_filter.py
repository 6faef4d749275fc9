"""The filter over a real recording: noise from the recording itself, soil carried from span to span."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.estimation import CHANNELS, STATE, FilterModel, FilterNoise, FilterRun, channel_statistics, run_filter
from ddagr_gym.estimation.layout import COMMANDS
from ddagr_gym.identification.recording_noise import RecordingNoise
from ddagr_gym.parameters import Robot
from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]

REACH = 0.5
"""Time within which the first samples of a span say how the robot moves at its start [s]."""
UNKNOWN_SPEED = 0.3
"""Relative deviation of the speed at the start of a span from that of the wheels [-] (ours: skid-steer robots slip)."""
PROCESS_NOISE = (3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0)
"""Candidates for the noise of both accelerations [m/s^2/sqrt(Hz)], yaw [rad/s^2/sqrt(Hz)]: from smooth soil up."""
BANK_NOISE = (0.2, 0.5, 1.0, 2.0, 5.0)
"""Candidates for the random walk of bank speeds whose commands are not used [rad/s/sqrt(s)]."""
LARGEST_NIS = 1.2
"""Innovations up to this size agree with the noise that the filter assumes (ours)."""

_MOTION, _REST = slice(0, 5), slice(5, 12)


@dataclass(frozen=True)
class FilterSetUp:
    """How a recording is filtered.

    Attributes:
        model: what the filter knows.
        use_commands: False where the robot's motors do not follow its motor model; banks wander instead.
        attitude: use the recorded roll and pitch; only right where they count from the horizon.
    """

    model: FilterModel
    use_commands: bool = True
    attitude: bool = False


def set_up_filter(
    robot: Robot,
    recordings: Sequence[Recording],
    noise: Sequence[RecordingNoise],
    *,
    attitude: bool = False,
    **others: Any,
) -> FilterSetUp:
    """Filter with the instruments' noise as found in recordings, and as much process noise as their readings need.

    Robots on rough ground are shaken by more than the wheel forces that the filter knows, and motors are not of first
    order. Commands are used if the encoders' innovations then agree with the filter (NIS up to LARGEST_NIS); else the
    least random walk of the banks with which they do. The accelerations' noise is the least of PROCESS_NOISE with
    which the gyro's do. The largest is taken where none does.

    Args:
        robot: that drove.
        recordings: of one sample period.
        noise: of each.
        attitude: use the recorded roll and pitch.
        others: further fields of the model.
    """
    sigma = np.max([item.sigma[:5] for item in noise], axis=0)
    readings = FilterNoise(accelerometer=float(sigma[:2].max()), gyro=float(sigma[2]), encoder=float(sigma[3:].max()))
    model = FilterModel(robot, noise=readings, sample_period=recordings[0].period, **others)
    candidates = [FilterSetUp(model, True, attitude)]
    candidates += [
        FilterSetUp(replace(model, noise=replace(readings, unknown_command=walk)), False, attitude)
        for walk in BANK_NOISE
    ]
    best = _first_consistent(candidates, recordings, ("encoder_right", "encoder_left"))
    shaken = [
        replace(
            best,
            model=replace(best.model, noise=replace(best.model.noise, acceleration=density, yaw_acceleration=density)),
        )
        for density in PROCESS_NOISE
    ]
    return _first_consistent(shaken, recordings, ("yaw_rate",))


def _first_consistent(
    candidates: Sequence[FilterSetUp], recordings: Sequence[Recording], channels: tuple[str, ...]
) -> FilterSetUp:
    for candidate in candidates:
        innovations = np.concatenate([filter_recording(candidate, item).standardised for item in recordings])
        found = channel_statistics(innovations, lags=1)
        if all(found[name].nis <= LARGEST_NIS for name in channels if name in found):
            return candidate
    return candidates[-1]


def filter_recording(set_up: FilterSetUp, recording: Recording) -> FilterRun:
    """Filter a recording span by span.

    Time and motion start anew with a span; what was learnt of soil and biases stays.

    Args:
        set_up: how.
        recording: with a gyro or encoders.

    Returns:
        Of every row, in the recording's order.

    Raises:
        InputError: no channel that the filter can use, or no rows.
    """
    if not any(recording.has(name) for name in CHANNELS):
        raise InputError(f"{recording.meta.source} has none of {', '.join(CHANNELS)}: the filter needs one.")
    columns = _columns(set_up, recording)
    parts: list[FilterRun] = []
    known = set_up.model.initial()
    for span in recording.spans():
        start = _start(set_up.model, recording, span, known)
        run = run_filter(set_up.model, {name: values[span] for name, values in columns.items()}, start=start)
        known = run.states[-1], run.covariances[-1]
        parts.append(run)
    return FilterRun(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def _columns(set_up: FilterSetUp, recording: Recording) -> dict[str, Array]:
    columns = {"t": recording.t} | {name: recording[name] for name in CHANNELS}
    if set_up.use_commands:
        columns |= dict(zip(COMMANDS, recording.held_commands(), strict=True))
    if set_up.attitude:
        columns |= {name: _carried_forward(recording, recording[name]) for name in ("roll", "pitch")}
    return columns


def _carried_forward(recording: Recording, values: Array) -> Array:
    """Last reading of the span, before the first one that one; 0 without any."""
    carried = np.zeros(len(recording))
    for span in recording.spans():
        part = values[span]
        known = np.flatnonzero(np.isfinite(part))
        if known.size:
            last = np.searchsorted(known, np.arange(part.size), side="right") - 1
            carried[span] = part[known[np.maximum(last, 0)]]
    return carried


def _first(recording: Recording, name: str, span: slice) -> float:
    rows = slice(span.start, min(span.stop, span.start + max(round(REACH / recording.period), 1)))
    found = recording[name][rows][np.isfinite(recording[name][rows])]
    return float(found[0]) if found.size else np.nan


def _start(model: FilterModel, recording: Recording, span: slice, known: tuple[Array, Array]) -> tuple[Array, Array]:
    """State and covariance at the start of a span: motion from its first samples, the rest as known."""
    right, left = (_first(recording, f"encoder_{bank}", span) for bank in ("right", "left"))
    turning = _first(recording, "yaw_rate", span)
    wheels = np.nan_to_num(np.array([right, left]))
    unsure = UNKNOWN_SPEED * model.outer_radius * float(np.abs(wheels).max())
    state, covariance = known[0].copy(), np.zeros((len(STATE), len(STATE)))
    state[_MOTION] = [0.5 * model.outer_radius * wheels.sum(), 0.0, np.nan_to_num(turning), *wheels]
    rate = 3.0 * model.noise.gyro if np.isfinite(turning) else unsure / model.robot.half_track
    wheel = 3.0 * model.noise.encoder if np.isfinite(right + left) else 1.0
    deviations = [max(unsure, model.velocity_deviation)] * 2 + [max(rate, model.yaw_rate_deviation), wheel, wheel]
    covariance[_MOTION, _MOTION] = np.diag(np.square(deviations))
    covariance[_REST, _REST] = known[1][_REST, _REST]
    return state, covariance
