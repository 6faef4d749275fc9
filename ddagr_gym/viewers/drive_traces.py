"""What the models of a diagnosis predict along each drive, and what they leave, as series over time.

N samples of a drive that were compared; channels in the order of :data:`ddagr_gym.identification.windows.CHANNELS`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.localisation.effect_timeline import as_it_stands
from ddagr_gym.frames import wrap_angle
from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.identification.misfit import projected_residual
from ddagr_gym.identification.problem import Problem
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]

NOMINAL, REFITTED, CORRECTED = "nominal", "refitted", "corrected"
MODELS = (NOMINAL, REFITTED, CORRECTED)
"""The nominal simulator; with its robot and soil fitted to the drives; with the named effects as well."""

POSE = tuple(CHANNELS.index(name) for name in ("pose_x", "pose_y", "pose_yaw"))

PAUSE = 1.0
"""Between drives that are laid one after the other [s] (ours)."""

_LATEST = 4.2e9
"""Clock reading up to which viewers can show it, seconds in 32 bits [s]."""


@dataclass(frozen=True, eq=False)
class DriveTraces:
    """One drive with its predictions.

    Attributes:
        recording: as it was read.
        stamp: of its time 0 in a viewer [s].
        time: (N,) of the samples that were compared, in the recording's time [s].
        window: (N,) number of each sample's window. In every one the models start anew from a fitted state.
        measured: (N, 8) as it was compared, NaN where there is no sample; headings from -pi to pi.
        predictions: (N, 8) by model; headings likewise.
        residuals: (N, 8) by model, over the noise and without what the unknowns of each window explain; NaN where there
            is no sample.
    """

    recording: Recording
    stamp: float
    time: Array
    window: NDArray[np.int64]
    measured: Array
    predictions: Mapping[str, Array]
    residuals: Mapping[str, Array]

    @property
    def end(self) -> float:
        """Time of the last row of the recording [s]."""
        return float(self.recording.t[-1])

    @property
    def paths(self) -> Mapping[str, tuple[Array, ...]]:
        """Places and headings (n, 3) [m, m, rad] by name: measured in one piece, of each model one for each window."""
        poses = self.measured[:, POSE]
        found = {"measured": (poses[np.isfinite(poses).all(axis=1)],)}
        for model in MODELS:
            values = self.predictions[model][:, POSE]
            pieces = (values[self.window == number] for number in np.unique(self.window))
            found[model] = tuple(piece[np.isfinite(piece).all(axis=1)] for piece in pieces)
        return found


def drive_traces(
    problem: Problem, refitted: Fitted, corrected: Fitted, recordings: Sequence[Recording]
) -> tuple[DriveTraces, ...]:
    """Traces of every drive of a diagnosis; one simulation.

    Several drives are laid one after the other in time, as they may begin at the same clock reading or years apart; a
    single one keeps its clock.

    Args:
        problem: windows and weights.
        refitted: the simulator with its parameters fitted.
        corrected: the same with the named effects.
        recordings: as they were read, in the order in which the windows count them.
    """
    models = dict(zip(MODELS, (as_it_stands(problem, refitted), refitted, corrected), strict=True))
    blocked = problem.blocked
    predictions = {name: blocked.means_of_all(model.prediction) for name, model in models.items()}
    residuals = {name: _residuals(problem, model) for name, model in models.items()}
    known = np.isfinite(blocked.sigma)
    measured = np.where(known, blocked.means_of_all(np.nan_to_num(blocked.windows.measured)), np.nan)
    time, first = _times(problem), _clock(recordings[0])
    found = []
    for number, recording in enumerate(recordings):
        rows = _of_recording(problem, number)
        found.append(
            DriveTraces(
                recording,
                first,
                time[rows].ravel(),
                np.repeat(rows, time.shape[1]),
                _with_wrapped_heading(_along(measured[rows])),
                {name: _with_wrapped_heading(_along(values[rows])) for name, values in predictions.items()},
                {name: _along(values[rows]) for name, values in residuals.items()},
            )
        )
        first = first + float(recording.t[-1]) + PAUSE
    return tuple(found)


def _along(values: Array) -> Array:
    """(w * B, 8) of (w, B, 8)."""
    return values.reshape(-1, values.shape[2])


def _with_wrapped_heading(values: Array) -> Array:
    """(N, 8) with headings from -pi to pi: a model counts turns from its start, a receiver often does not."""
    found = values.copy()
    heading = found[:, POSE[2]]
    # a model that breaks down may leave any number
    found[:, POSE[2]] = wrap_angle(np.where(np.isfinite(heading), heading, np.nan))
    return found


def _clock(recording: Recording) -> float:
    """Clock reading at time 0 of a recording; 0 for one that no viewer can show."""
    start = recording.meta.start_time
    return start if 0.0 <= start < _LATEST else 0.0


def _residuals(problem: Problem, model: Fitted) -> Array:
    """(W, B, 8) over the noise, NaN where there is no sample."""
    projected = problem.blocked.by_channel(projected_residual(problem, model))
    return np.where(np.isfinite(problem.blocked.sigma), projected, np.nan)


def _times(problem: Problem) -> Array:
    """(W, B) recording time in the middle of each block [s]; the first sample comes a period after the start."""
    windows = problem.blocked.windows
    _, blocks, length, _ = problem.blocked.weights.shape
    return np.asarray(windows.time[:, None] + windows.period * (length * np.arange(blocks) + 0.5 * (length + 1)))


def _of_recording(problem: Problem, number: int) -> NDArray[np.int64]:
    """Windows of a recording in the order of time; they do not overlap."""
    windows = problem.blocked.windows
    rows = np.flatnonzero(windows.recording == number)
    return rows[np.argsort(windows.time[rows], kind="stable")]
