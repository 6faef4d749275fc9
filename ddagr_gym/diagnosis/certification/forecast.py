"""Predictions from states that are known at their start: what a model is worth on a drive that it was not fitted to.

A *forecast* starts where :data:`PAST` seconds of readings end. The state there comes from a fit to these readings with
the very model that then predicts; nothing of what follows is used, except the recorded commands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.setting import HISTORY
from ddagr_gym.errors import InputError
from ddagr_gym.frames import wrap_angle
from ddagr_gym.identification.block_means import block_windows, located
from ddagr_gym.identification.data_split import evenly
from ddagr_gym.identification.least_squares import Elimination
from ddagr_gym.identification.noise import noise_from_differences
from ddagr_gym.identification.problem import Point, Problem
from ddagr_gym.identification.window_model import STATE_ENTRIES
from ddagr_gym.identification.windows import CHANNELS, STATE, WindowSet, cut_windows
from ddagr_gym.recordings.channels import CHANNELS as SCHEMA
from ddagr_gym.recordings.schema import Recording, RobotGeometry

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

PAST = 2.0
"""Readings before a start from which its state is estimated [s]."""

LAST = 0.5
"""Time before a horizon over which errors are averaged [s]: two poses at 5 Hz, and vibration averages out."""

_STATE_STEPS = 2
"""Gauss-Newton steps from the first guess of a state (ours: states act nearly linearly)."""

SPEED_TIME = 1.0
"""Time over which a speed is taken from poses [s]."""

UNITS = {name: SCHEMA[name].unit for name in CHANNELS} | {"position": "m", "speed": "m/s", "heading_by_gyro": "rad"}
"""What is compared at a horizon: every channel, the distance and the speed by the poses, the gyro's integral."""

MOTION = ("position", "speed", "pose_yaw", "heading_by_gyro", "yaw_rate")
"""Those that say where the robot is going."""

_XY = [CHANNELS.index("pose_x"), CHANNELS.index("pose_y")]
_YAW = CHANNELS.index("pose_yaw")
_GYRO = CHANNELS.index("yaw_rate")
_GYRO_SHARE = 0.9  # of the samples that an integral needs


@dataclass(frozen=True, eq=False)
class Forecasts:
    """Starts of forecasts, with what was read before and after them.

    Attributes:
        past: problem of the readings before the starts.
        future: windows from the starts on.
    """

    past: Problem
    future: WindowSet

    def subset(self, chosen: Flags) -> Forecasts:
        """Only the chosen ones."""
        return Forecasts(self.past.subset(chosen), self.future.subset(chosen))


def part_of(windows: WindowSet, first: int, samples: int) -> WindowSet:
    """Samples ``first`` to ``first + samples`` of every window; the first guess is only right for ``first`` 0."""
    stop = windows.history + first + samples + windows.ahead
    return replace(
        windows,
        start=windows.start + first,
        time=windows.time + first * windows.period,
        commands=windows.commands[:, first:stop],
        measured=windows.measured[:, first : first + samples],
        unknown=np.maximum(windows.unknown - first, 0),
        speeds=windows.speeds[:, first : windows.history + first + samples],
    )


def cut_forecasts(
    problem: Problem, recordings: Sequence[Recording], horizon: float, stride: float, most: int = 240
) -> Forecasts | None:
    """Forecasts of one horizon, every ``stride`` seconds but at most ``most``; None where no drive is long enough.

    Args:
        problem: whose model and uncertainties are used.
        recordings: those of the problem, in its order.
        horizon: [s].
        stride: between starts [s].
        most: forecasts, evenly chosen.
    """
    shape = RobotGeometry.of(problem.robot)
    try:
        whole = cut_windows(
            recordings, PAST + horizon, stride=stride, wheel_radius=shape.wheel_radius,
            half_track=shape.half_track, history=HISTORY,
        )  # fmt: skip
    except InputError:
        return None
    whole = located(whole.subset(evenly(whole.count, most)), recordings, shape.wheel_radius)
    samples = round(PAST / whole.period)
    noise = noise_from_differences(recordings, shape.wheel_radius)
    past = block_windows(part_of(whole, 0, samples), noise, shape.wheel_radius)
    return Forecasts(problem.on(past), part_of(whole, samples, whole.samples - samples))


def past_elimination(forecasts: Forecasts, point: Point) -> Elimination:
    """Basis of what the unknowns before each start explain; ``point`` gives the model, its states do not count."""
    past = forecasts.past
    point = replace(point, states=past.starts(point.values))
    reference = past.reference(point)
    local = past.local_columns(point, reference)
    return past.eliminate(point, past.predict(point), local, reference)


def start_states(forecasts: Forecasts, point: Point, elimination: Elimination) -> Array:
    """(W, 8) states at the starts, by Gauss-Newton on the readings before them.

    A step that does not lower a window's cost is not taken there.

    Args:
        forecasts: where to start.
        point: model; its states do not count.
        elimination: of :func:`past_elimination` at this model or one like it.
    """
    past = forecasts.past
    here = replace(point, states=past.starts(point.values))
    readings, record = past.model.predict_recorded(here.values, here.states, STATE_ENTRIES, here.effects)
    residual = past.residual(here, readings)[..., None]
    cost, ends = _window_cost(elimination, residual), record[:, -1]
    for _ in range(_STATE_STEPS):
        tried = replace(here, states=here.states + elimination.explain(residual)[:, : len(STATE), 0])
        readings, record = past.model.predict_recorded(tried.values, tried.states, STATE_ENTRIES, tried.effects)
        after = past.residual(tried, readings)[..., None]
        after_cost = _window_cost(elimination, after)
        better = after_cost < cost
        here = replace(tried, states=np.where(better[:, None], tried.states, here.states))
        residual = np.where(better[:, None, None], after, residual)
        ends = np.where(better[:, None], record[:, -1], ends)
        cost = np.where(better, after_cost, cost)
    return np.asarray(ends)


def _window_cost(elimination: Elimination, residual: Array) -> Array:
    total = (elimination.project(residual) ** 2).sum(axis=(1, 2))
    return np.where(np.isfinite(total), total, np.inf)


def roll_out(forecasts: Forecasts, point: Point, states: Array) -> tuple[Array, Array]:
    """Readings (W, T, 8) and states (W, T, 8) from the starts on, with the recorded commands."""
    model = forecasts.past.model_of(forecasts.future)
    return model.predict_recorded(point.values, states, STATE_ENTRIES, point.effects)


def errors_at(windows: WindowSet, prediction: Array, horizon: float) -> dict[str, Array]:
    """Errors (W,) of a forecast at a horizon, predicted less measured, by name of UNITS; NaN where nothing measures.

    Channels are averaged over the last half second; distances and speeds come from the poses.

    Args:
        windows: from the starts on, at least as long as the horizon.
        prediction: (W, T, 8).
        horizon: [s].
    """
    stop = round(horizon / windows.period)
    difference = prediction[:, :stop] - windows.measured[:, :stop]
    difference[..., _YAW] = wrap_angle(difference[..., _YAW])
    last = difference[:, max(stop - round(LAST / windows.period), 0) :]
    found = {name: _mean(last[..., k]) for k, name in enumerate(CHANNELS)}
    found["position"] = np.hypot(found["pose_x"], found["pose_y"])
    found["speed"] = _speed_error(windows, prediction, stop)
    gyro = difference[..., _GYRO]
    enough = np.isfinite(gyro).mean(axis=1) >= _GYRO_SHARE
    found["heading_by_gyro"] = np.where(enough, _mean(gyro) * stop * windows.period, np.nan)
    return found


def _mean(values: Array) -> Array:
    known = np.isfinite(values)
    count = known.sum(axis=1)
    return np.asarray(np.where(count > 0, np.nansum(values, axis=1) / np.maximum(count, 1), np.nan))


def _speed_error(windows: WindowSet, prediction: Array, stop: int) -> Array:
    """Distance between the last pose and the one a second before it, predicted less measured, over the time between."""
    known = np.asarray(np.isfinite(windows.measured[:, :stop][..., _XY]).all(axis=-1))
    back, reach = round(SPEED_TIME / windows.period), round(LAST / windows.period)
    error = np.full(windows.count, np.nan)
    for w in range(windows.count):
        rows = np.flatnonzero(known[w])
        if rows.size < 2 or rows[-1] < stop - 1 - reach:
            continue
        end, first = rows[-1], rows[np.argmin(np.abs(rows - (rows[-1] - back)))]
        if end > first:
            gone = [np.hypot(*(track[w, end, _XY] - track[w, first, _XY])) for track in (prediction, windows.measured)]
            error[w] = (gone[0] - gone[1]) / ((end - first) * windows.period)
    return error
