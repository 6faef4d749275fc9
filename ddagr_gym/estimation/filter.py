"""The filter over a batch of robots, over one robot, and over a recording: the same kernel, to the bit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.estimation.columns import sample_times, stack_columns
from ddagr_gym.estimation.filter_kernels import filter_rows, filter_series, roll_out_kernel
from ddagr_gym.estimation.filter_model import FilterModel
from ddagr_gym.estimation.layout import CHANNEL_SIZE, CHANNELS, COMMANDS, STATE_SIZE, WORK_SIZE
from ddagr_gym.estimation.steps import gravity_along_body, positive_duration

Array = NDArray[np.float64]

_LEVEL = np.zeros((1, 1, 2))  # gravity along the body where no attitude is known [m/s^2]


class BatchFilter:
    """Extended Kalman filters of N robots that share one model.

    Args:
        model: what the filters know.
        count: N.

    Attributes:
        states: (N, 12), see :mod:`ddagr_gym.estimation`.
        covariances: (N, 12, 12).
    """

    REMEMBERED = ("states", "covariances", "_counts")
    """Arrays that it goes on from."""

    def __init__(self, model: FilterModel, count: int = 1) -> None:
        if count < 1:
            raise InputError(f"count is {count}: give at least one robot.")
        self.model = model
        self.count = count
        self.states = np.empty((count, STATE_SIZE))
        self.covariances = np.empty((count, STATE_SIZE, STATE_SIZE))
        self._packed = model.pack()
        self._initial = model.initial()
        self._counts = np.zeros(count, dtype=np.int64)
        self._work = np.zeros(WORK_SIZE)
        self._period = np.array([model.sample_period])
        self.reset()

    def reset(self, chosen: ArrayLike | None = None, motion: ArrayLike | None = None) -> None:
        """Forget everything and start from the model's prior.

        Args:
            chosen: indices or mask of robots, all by default.
            motion: (len(chosen), 5) v_x, v_y [m/s], yaw rate, bank speeds right and left [rad/s]; at rest by default.
        """
        indices = np.arange(self.count) if chosen is None else np.atleast_1d(np.asarray(chosen))
        if indices.dtype == np.bool_:
            indices = np.flatnonzero(indices)
        self.states[indices], self.covariances[indices] = self._initial
        self._counts[indices] = 0
        if motion is not None:
            values = np.asarray(motion, dtype=np.float64)
            if values.shape != (len(indices), 5) or not np.isfinite(values).all():
                raise InputError(f"motion has shape {values.shape}: give finite values of shape ({len(indices)}, 5).")
            self.states[indices, :5] = values

    def step(
        self, commands: ArrayLike, readings: ArrayLike, attitude: ArrayLike | None = None, duration: float | None = None
    ) -> Array:
        """Predict and correct through one sample or several.

        Args:
            commands: (N, 2) constant, or (N, K, 2) right and left bank speed commands [rad/s]; NaN: unknown.
            readings: (N, 5) or (N, K, 5) in the order of ``CHANNELS``; NaN where a channel has no sample.
            attitude: (N, 2) or (N, K, 2) roll and pitch [rad] where known.
            duration: between samples [s]; the model's sample period by default.

        Returns:
            Standardised innovations, (N, 5) or (N, K, 5) as ``readings``; NaN where nothing was measured.

        Raises:
            InputError: shapes that do not fit.
        """
        given = np.ascontiguousarray(readings, dtype=np.float64)
        samples = _three_axes(given, CHANNEL_SIZE, self.count, "readings")
        drive = _three_axes(np.ascontiguousarray(commands, dtype=np.float64), 2, self.count, "commands")
        slopes = _LEVEL
        if attitude is not None:
            angles = _three_axes(np.asarray(attitude, dtype=np.float64), 2, self.count, "attitude")
            slopes = np.ascontiguousarray(gravity_along_body(angles[..., 0], angles[..., 1]))
        for name, array in (("commands", drive), ("attitude", slopes)):
            if array.shape[1] not in (1, samples.shape[1]):
                raise InputError(
                    f"{name} have {array.shape[1]} samples, readings {samples.shape[1]}: give as many, or 1."
                )
        standardised = np.empty(samples.shape)
        durations = self._period if duration is None else np.array([positive_duration(duration)])
        filter_rows(
            self._packed, self.states, self.covariances, self._counts, drive, samples, slopes, durations, standardised,
            self._work,
        )  # fmt: skip
        return standardised.reshape(given.shape)


class Filter:
    """Extended Kalman filter of one robot: a batch of one.

    Args:
        model: what the filter knows.
    """

    def __init__(self, model: FilterModel) -> None:
        self._batch = BatchFilter(model, 1)

    @property
    def model(self) -> FilterModel:
        """What the filter knows."""
        return self._batch.model

    @property
    def state(self) -> Array:
        """(12,), see :mod:`ddagr_gym.estimation`; a view."""
        return self._batch.states[0]

    @property
    def covariance(self) -> Array:
        """(12, 12); a view."""
        return self._batch.covariances[0]

    def reset(self, motion: ArrayLike | None = None) -> None:
        """Start again from the prior, at rest or at ``motion`` (5,): v_x, v_y, yaw rate, bank speeds right, left."""
        self._batch.reset(motion=None if motion is None else np.asarray(motion, dtype=np.float64)[None])

    def step(
        self, command: ArrayLike, reading: ArrayLike, attitude: ArrayLike | None = None, duration: float | None = None
    ) -> Array:
        """Predict and correct through one sample: command (2,), reading (5,), attitude (2,).

        Returns:
            Standardised innovations (5,); NaN where nothing was measured.
        """
        angles = None if attitude is None else np.asarray(attitude, dtype=np.float64)[None]
        return self._batch.step(np.asarray(command)[None], np.asarray(reading)[None], angles, duration)[0]


class FilterRun(NamedTuple):
    """A recording as the filter saw it.

    Attributes:
        t: (T,) [s].
        states: (T, 12) after each sample.
        covariances: (T, 12, 12).
        standardised: (T, 5) innovations in the order of ``CHANNELS``, NaN where nothing was measured.
    """

    t: Array
    states: Array
    covariances: Array
    standardised: Array

    @property
    def deviations(self) -> Array:
        """Standard deviations of the states, (T, 12)."""
        return np.sqrt(np.diagonal(self.covariances, axis1=1, axis2=2))


def run_filter(
    model: FilterModel,
    columns: Mapping[str, ArrayLike],
    motion: ArrayLike | None = None,
    start: tuple[ArrayLike, ArrayLike] | None = None,
) -> FilterRun:
    """Filter a recording.

    Args:
        model: what the filter knows; steps are taken from ``t``, the first is one sample period.
        columns: ``t``, and of ``command_right``, ``command_left``, ``CHANNELS``, ``roll``, ``pitch`` those there are,
            each (T,); NaN where a channel has no sample.
        motion: (5,) initial v_x, v_y, yaw rate, bank speeds right, left; at rest by default.
        start: state (12,) and covariance (12, 12) to start from instead of the prior.

    Raises:
        InputError: no time, time that does not increase, columns of different lengths, no measured channel, or both
            ``motion`` and ``start``.
    """
    if motion is not None and start is not None:
        raise InputError("motion and start are both given: put the motion into the start's state.")
    t, durations = sample_times(columns, model.sample_period)
    if not any(name in columns for name in CHANNELS):
        raise InputError(f"columns hold none of {', '.join(CHANNELS)}: the filter has nothing to correct by.")
    attitude = stack_columns(columns, ("roll", "pitch"), 0.0)
    slopes = np.nan_to_num(gravity_along_body(attitude[:, 0], attitude[:, 1]))
    one = Filter(model)
    one.reset(motion)
    if start is not None:
        one.state[:], one.covariance[:] = start
    states, covariances = np.empty((t.size, STATE_SIZE)), np.empty((t.size, STATE_SIZE, STATE_SIZE))
    standardised = np.empty((t.size, CHANNEL_SIZE))
    filter_series(
        model.pack(), one.state, one.covariance, stack_columns(columns, COMMANDS, np.nan),
        stack_columns(columns, CHANNELS, np.nan), slopes, durations, states, covariances, standardised,
        np.zeros(WORK_SIZE),
    )  # fmt: skip
    return FilterRun(t, states, covariances, standardised)


def roll_out(model: FilterModel, state: ArrayLike, commands: ArrayLike, attitude: ArrayLike = (0.0, 0.0)) -> Array:
    """Predict the state over a series of commands without measurements.

    Args:
        model: its sample period is the step.
        state: (12,).
        commands: (T, 2) right and left bank speed commands [rad/s].
        attitude: (2,) or (T, 2) roll and pitch [rad].

    Returns:
        (T, 12) states after each command.
    """
    x = np.array(state, dtype=np.float64)
    drive = np.ascontiguousarray(commands, dtype=np.float64)
    if x.shape != (STATE_SIZE,) or drive.ndim != 2 or drive.shape[1] != 2:
        raise InputError(f"state and commands have shapes {x.shape}, {drive.shape}: give ({STATE_SIZE},) and (T, 2).")
    angles = np.atleast_2d(np.asarray(attitude, dtype=np.float64))
    states = np.empty((len(drive), STATE_SIZE))
    slopes = np.ascontiguousarray(gravity_along_body(angles[:, 0], angles[:, 1]))
    roll_out_kernel(model.pack(), x, drive, slopes, model.sample_period, states, np.zeros(WORK_SIZE))
    return states


def _three_axes(array: Array, width: int, count: int, name: str) -> Array:
    shaped = array[:, None, :] if array.ndim == 2 else array
    if shaped.ndim != 3 or shaped.shape[0] != count or shaped.shape[2] != width:
        raise InputError(f"{name} have shape {array.shape}: give ({count}, {width}) or ({count}, K, {width}).")
    return shaped
