"""What the models of a search leave along the drives: simulated once, for the localisation and for the pictures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.localisation.effect_timeline import (
    ScoreProcess,
    as_it_stands,
    by_piece,
    piece_length,
    pieces_of,
    score_processes,
)
from ddagr_gym.diagnosis.localisation.operating_conditions import Pieces
from ddagr_gym.diagnosis.localisation.residual_wrench import ResidualWrench, residual_wrench
from ddagr_gym.diagnosis.preprocessing.session import DiagnosisSession
from ddagr_gym.diagnosis.search.scanned_model import SearchResult
from ddagr_gym.frames import wrap_angle
from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.identification.misfit import projected_residual
from ddagr_gym.identification.problem import Problem
from ddagr_gym.physics import layout

Array = NDArray[np.float64]

_RECORDED = (*range(layout.SLIP_RATIO, layout.SLIP_RATIO + 4), layout.YAW_RATE, layout.V_X, layout.YAW)


@dataclass(frozen=True, eq=False)
class MismatchTraces:
    """Residuals of the models, what the robot did, and what the named effects do, along the drives.

    Attributes:
        pieces: what the robot did, by the chosen model.
        processes: score of each effect of the chosen model.
        wrench: that would explain the residuals.
        raw: (W, B, 8) weighted residual of the nominal model as it stands, the windows' unknowns eliminated.
        nominal: (W, B, 8) the same of the refitted nominal model.
        chosen: (W, B, 8) the same of the chosen model.
    """

    pieces: Pieces
    processes: tuple[ScoreProcess, ...]
    wrench: ResidualWrench
    raw: Array
    nominal: Array
    chosen: Array


def trace_mismatch(session: DiagnosisSession, found: SearchResult) -> MismatchTraces:
    """Simulate the models of a search along the drives: five simulations, and one for each effect.

    Args:
        session: of the diagnosis.
        found: of the search; nominal and chosen model may be the same.
    """
    problem, nominal, chosen = session.problem, found.nominal.fitted, found.chosen.fitted
    raw = as_it_stands(problem, nominal)
    return MismatchTraces(
        piece_values(problem, chosen),
        score_processes(problem, chosen),
        residual_wrench(problem, raw, chosen, found.chosen.dispersion),
        *(problem.blocked.by_channel(projected_residual(problem, model)) for model in (raw, nominal, chosen)),
    )


def piece_values(problem: Problem, fitted: Fitted) -> Pieces:
    """What the robot did in each piece of each window, (W * Q,), by the fitted model; one simulation."""
    windows, pieces = problem.blocked.windows, pieces_of(problem)
    prediction, record = problem.model.predict_recorded(
        fitted.point.values, fitted.point.states, _RECORDED, fitted.point.effects
    )
    length = problem.blocked.weights.shape[2]
    sample_piece = np.repeat(pieces, length)
    kept = len(sample_piece)

    def mean(values: Array) -> Array:
        return by_piece(values[:, :kept], sample_piece) / np.bincount(sample_piece)

    heading = np.arctan2(mean(np.sin(record[..., 6])), mean(np.cos(record[..., 6])))
    commands = windows.commands[:, windows.history : windows.history + kept]
    start = windows.time[:, None] + piece_length(problem) * np.arange(int(pieces[-1]) + 1)
    values = {
        "speed": mean(record[..., 5]),
        "slip": mean(np.abs(record[..., :4]).mean(axis=-1)),
        "turning": mean(np.abs(record[..., 4])),
        "yaw_rate": mean(record[..., 4]),
        "heading": wrap_angle(heading),
        "command": mean(np.abs(commands).max(axis=2)),
        "command_change": _command_change(problem, sample_piece),
        "time": start,
    }
    if windows.frames_apart:
        del values["heading"]
    shape = values["speed"].shape
    recording = np.repeat(windows.recording[:, None], shape[1], axis=1).ravel()
    x, y = mean(prediction[..., 5]), mean(prediction[..., 6])
    raveled = {name: item.ravel() for name, item in values.items()}
    return Pieces(recording, raveled, x.ravel(), y.ravel(), windows.frames_apart)


def _command_change(problem: Problem, sample_piece: NDArray[np.int64]) -> Array:
    """(W, Q) largest less smallest command of either bank in each piece and the one before [rad/s]."""
    windows = problem.blocked.windows
    count = int(sample_piece[-1]) + 1
    first = windows.history + np.searchsorted(sample_piece, np.arange(count))
    last = windows.history + np.searchsorted(sample_piece, np.arange(count), side="right")
    length = int(np.bincount(sample_piece)[0])
    ranges = [
        np.ptp(windows.commands[:, max(a - length, 0) : b], axis=1).max(axis=1)
        for a, b in zip(first.tolist(), last.tolist(), strict=True)
    ]
    return np.stack(ranges, axis=1)
