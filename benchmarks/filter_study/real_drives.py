"""How far the filter predicts real drives, beside the kinematic models, judged by the lidar pose and the gyro."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.estimation import FilterModel, FilterRun, roll_out
from ddagr_gym.estimation.layout import OMEGA
from ddagr_gym.evaluation.recording_filter import filter_recording, set_up_filter
from ddagr_gym.frames import wrap_angle
from ddagr_gym.identification.data_split import clusters, held_out, training
from ddagr_gym.identification.windows import CHANNELS, WindowSet
from ddagr_gym.parameters import Robot
from ddagr_gym.presets import get_robot
from ddagr_gym.recordings.load import load_recording
from ddagr_gym.replay_analysis.horizons import LAST, SPEED_TIME, horizon_errors
from ddagr_gym.replay_analysis.intervals import compare, error_statistics
from ddagr_gym.replay_analysis.kinematic import KinematicModel, bank_speeds_at_samples
from ddagr_gym.replay_analysis.models import Baselines, fit_baselines
from ddagr_gym.replay_analysis.prepare import Prepared, prepare
from ddagr_gym.replay_analysis.report import EFFECTIVE_TRACK

Array = NDArray[np.float64]

HORIZONS = (1.0, 5.0)
"""[s]"""
FIT_WINDOW = 2.0
MOST_WINDOWS = 150
FILTER, ODOMETRY = "filter", "encoders_and_gyro"
COMMANDS, WHEEL_SPEEDS, DEAD_RECKONING = DRIVES = ("commands", "wheel_speeds", "dead_reckoning")
"""What is known after the start of a window: commands; wheel speeds; all of gyro and encoders."""
METRICS = {
    "forward_speed": "m/s",
    "lateral_speed": "m/s",
    "position": "m",
    "heading_pose": "rad",
    "heading": "rad",
}
"""Errors and units: mean body speeds over the last second, position and heading by the lidar pose; heading also by the
integrated gyro, which is exact over seconds (it says nothing of models that use it)."""
IMPOSED_MOTOR_RATE = 100.0
"""Of a robot whose wheels turn as recorded [1/s]."""

_X, _Y, _YAW = (CHANNELS.index(name) for name in ("pose_x", "pose_y", "pose_yaw"))


@dataclass(frozen=True)
class Errors:
    """Errors (W,) by model and metric over windows, and which windows hang together (W,)."""

    by_model: Mapping[str, Mapping[str, Array]]
    clusters: NDArray[np.int64]


def real_drive(path: Path, robot_name: str, seed: int) -> dict[str, Any]:
    """Prediction errors on one recording, both halves judged by what was fitted to the other.

    ``commands``: wheel speeds follow from commands through a motor fitted to the other half. ``wheel_speeds``: recorded
    wheel speeds are imposed. In both the filter has seen everything up to the start of a window and nothing after.
    ``dead_reckoning``: models use all readings of gyro and encoders as they come.

    Args:
        path: recording.
        robot_name: preset that drove.
        seed: of intervals.

    Returns:
        For the study's JSON document.
    """
    robot = get_robot(robot_name)
    recording = load_recording(path, None, robot_name)
    folds = [prepare([recording], robot, np.random.default_rng(seed), swapped) for swapped in (False, True)]
    set_up = set_up_filter(robot, folds[0].recordings, folds[0].noise)
    run = filter_recording(set_up, folds[0].recordings[0])
    found: dict[str, list[dict[float, Errors]]] = {}
    ratios = []
    for fold in folds:
        for drive in ("commands", "encoders"):
            seen = fold.windows(FIT_WINDOW, drive, part=training, most=MOST_WINDOWS)
            baselines = fit_baselines(fold, robot, drive, seen)
            ratios += [] if baselines.effective_track is None else [baselines.effective_track.track_ratio]
            for label, errors in _errors_by_label(fold, robot, set_up.model, run, drive, baselines).items():
                found.setdefault(label, []).append(errors)
    return {
        "robot": robot_name,
        "filter": {
            "uses_commands": set_up.use_commands,
            "bank_noise": None if set_up.use_commands else set_up.model.noise.unknown_command,
            "acceleration_noise": set_up.model.noise.acceleration,
        },
        "track_ratios": ratios,
        "drives": {label: _tables(_pooled(parts), _judged(label), seed) for label, parts in found.items()},
    }


def _errors_by_label(
    fold: Prepared, robot: Robot, model: FilterModel, run: FilterRun, drive: str, baselines: Baselines
) -> dict[str, dict[float, Errors]]:
    """Errors by label and horizon."""
    found: dict[str, dict[float, Errors]] = {}
    for horizon in HORIZONS:
        windows = fold.windows(horizon, drive, stride=max(1.0, horizon / 6.0), part=held_out)
        if windows is None:
            continue
        kinematic = {name: item.predict(windows) for name, item in baselines.models().items()}
        predictions = {
            COMMANDS if drive == "commands" else WHEEL_SPEEDS: kinematic
            | {FILTER: motion_channels(windows, _rolled(windows, robot, model, run, baselines))}
        }
        if drive == "encoders":
            loop = np.stack([run.states[first : first + windows.samples + 1] for first in windows.start])
            predictions[DEAD_RECKONING] = kinematic | {
                ODOMETRY: _odometry(windows, baselines.no_slip),
                FILTER: motion_channels(windows, loop),
            }
        together = clusters(windows, fold.splits)
        for label, by_model in predictions.items():
            errors = {name: prediction_errors(windows, item) for name, item in by_model.items()}
            found.setdefault(label, {})[horizon] = Errors(errors, together)
    return found


def _rolled(windows: WindowSet, robot: Robot, model: FilterModel, run: FilterRun, baselines: Baselines) -> Array:
    """(W, T + 1, 12) from the filter's state at the start of each window on, without readings."""
    motor = baselines.motor
    if motor is None:
        driven, drive = replace(robot, motor_rate=IMPOSED_MOTOR_RATE), windows.drive(baselines.delay)
    else:
        driven = replace(robot, motor_rate=motor.rate)
        drive = np.clip(windows.drive(motor.delay), -motor.maximum_speed, motor.maximum_speed)
    rolled = []
    for window, first in enumerate(windows.start):
        state = run.states[first].copy()
        # every model starts from the same wheel speeds
        state[OMEGA : OMEGA + 2] = windows.initial[window, 6:8]
        later = roll_out(replace(model, robot=driven), state, drive[window])
        rolled.append(np.concatenate([state[None], later]))
    return np.stack(rolled)


def motion_channels(windows: WindowSet, states: Array) -> Array:
    """Channels (W, T, 8) from filter states (W, T + 1, 12) and the windows' first pose; specific force stays 0."""
    return _integrated(windows, states[..., 0], states[..., 1], states[..., 2], states[..., OMEGA : OMEGA + 2])


def _odometry(windows: WindowSet, model: KinematicModel) -> Array:
    """Forward speed from the encoders, yaw rate from the gyro."""
    speeds = bank_speeds_at_samples(windows, model.delay)
    forward = 0.5 * model.wheel_radius * speeds.sum(axis=-1)
    gyro = windows.measured[..., CHANNELS.index("yaw_rate")]
    turning = np.concatenate([windows.initial[:, 5:6], np.where(np.isfinite(gyro), gyro, 0.0)], axis=1)
    return _integrated(windows, forward, np.zeros_like(forward), turning, speeds)


def _integrated(windows: WindowSet, v_x: Array, v_y: Array, turning: Array, speeds: Array) -> Array:
    def steps(values: Array) -> Array:
        return 0.5 * windows.period * (values[:, 1:] + values[:, :-1])

    turned = steps(turning)
    heading = windows.initial[:, 2:3] + np.cumsum(turned, axis=1)
    middle = heading - 0.5 * turned
    along, across = steps(v_x), steps(v_y)
    channels = np.zeros((windows.count, windows.samples, len(CHANNELS)))
    channels[..., CHANNELS.index("yaw_rate")] = turning[:, 1:]
    channels[..., CHANNELS.index("encoder_right")] = speeds[:, 1:, 0]
    channels[..., CHANNELS.index("encoder_left")] = speeds[:, 1:, 1]
    channels[..., _X] = windows.initial[:, 0:1] + np.cumsum(along * np.cos(middle) - across * np.sin(middle), axis=1)
    channels[..., _Y] = windows.initial[:, 1:2] + np.cumsum(along * np.sin(middle) + across * np.cos(middle), axis=1)
    channels[..., _YAW] = heading
    return channels


def prediction_errors(windows: WindowSet, prediction: Array) -> dict[str, Array]:
    """Errors (W,) by METRICS at the end of each window; NaN where nothing measures them."""
    known = horizon_errors(windows, prediction)
    forward, lateral = _body_speeds(windows, prediction)
    return {"forward_speed": forward, "lateral_speed": lateral} | {
        name: known[name] for name in ("position", "heading_pose", "heading")
    }


def _body_speeds(windows: WindowSet, prediction: Array) -> tuple[Array, Array]:
    """Errors of the mean forward and lateral speed between the last pose and that a second before, each in the axes of
    its own mean heading, so that neither the start's heading nor its error matters."""
    errors = np.full((2, windows.count), np.nan)
    reach, back = round(LAST / windows.period), round(SPEED_TIME / windows.period)
    for w in range(windows.count):
        rows = np.flatnonzero(np.isfinite(windows.measured[w][:, [_X, _Y, _YAW]]).all(axis=-1))
        if rows.size < 3 or rows[-1] < windows.samples - 1 - reach:
            continue
        end = rows[-1]
        earlier = rows[np.argmin(np.abs(rows - (end - back)))]
        if end - earlier >= reach:
            time = (end - earlier) * windows.period
            ours, true = (_displacement(part[w], earlier, end) for part in (prediction, windows.measured))
            errors[:, w] = (ours - true) / time
    return errors[0], errors[1]


def _displacement(poses: Array, first: int, last: int) -> Array:
    """(2,) forward and left, in the axes of the mean heading [m]."""
    x, y = poses[last, [_X, _Y]] - poses[first, [_X, _Y]]
    heading = poses[first, _YAW] + 0.5 * float(wrap_angle(poses[last, _YAW] - poses[first, _YAW]))
    return np.array([x * np.cos(heading) + y * np.sin(heading), y * np.cos(heading) - x * np.sin(heading)])


def _pooled(folds: list[dict[float, Errors]]) -> dict[float, Errors]:
    joined = {}
    for horizon in sorted(set.intersection(*(set(fold) for fold in folds))):
        parts = [fold[horizon] for fold in folds]
        offsets = np.cumsum([0] + [int(part.clusters.max()) + 1 for part in parts[:-1]])
        models = set.intersection(*(set(part.by_model) for part in parts))
        errors = {
            model: {m: np.concatenate([part.by_model[model][m] for part in parts]) for m in METRICS}
            for model in sorted(models)
        }
        together = np.concatenate([part.clusters + first for part, first in zip(parts, offsets, strict=True)])
        joined[horizon] = Errors(errors, together)
    return joined


def _judged(label: str) -> tuple[str, ...]:
    """Metrics that say something; the gyro does not judge models that use it."""
    return tuple(name for name in METRICS if not (name == "heading" and label == DEAD_RECKONING))


def _tables(horizons: Mapping[float, Errors], metrics: tuple[str, ...], seed: int) -> dict[str, Any]:
    """{horizon: {metric: {model: {value, interval, windows}, "filter_over_effective_track": ...}}}."""
    return {
        f"{horizon:g}": {metric: _metric_table(errors, metric, seed) for metric in metrics}
        for horizon, errors in horizons.items()
    }


def _metric_table(errors: Errors, metric: str, seed: int) -> dict[str, Any]:
    table: dict[str, Any] = {"unit": METRICS[metric]}
    for model, found in errors.by_model.items():
        size = error_statistics(found[metric], errors.clusters, np.random.default_rng(seed))
        table[model] = {"value": size.rms, "interval": size.rms_interval, "windows": size.count}
    if EFFECTIVE_TRACK in errors.by_model:
        ours, theirs = (errors.by_model[name][metric] for name in (FILTER, EFFECTIVE_TRACK))
        pair = compare(FILTER, ours, EFFECTIVE_TRACK, theirs, errors.clusters, np.random.default_rng(seed))
        if pair is not None:
            table["filter_over_effective_track"] = {"value": pair.rms_ratio, "interval": pair.rms_ratio_interval}
    return table
