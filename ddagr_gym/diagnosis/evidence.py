"""The arrays behind a diagnosis, for its pictures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.evidence import Evidence
from ddagr_gym.diagnosis.localisation.effect_timeline import piece_length, pieces_of
from ddagr_gym.diagnosis.localisation.mismatch_traces import MismatchTraces
from ddagr_gym.diagnosis.preprocessing.session import DiagnosisSession
from ddagr_gym.diagnosis.search.scanned_model import SearchResult
from ddagr_gym.identification.problem import Problem

Array = NDArray[np.float64]


def gather_evidence(session: DiagnosisSession, found: SearchResult, traces: MismatchTraces) -> Evidence:
    """Collect what the page draws.

    Args:
        session: of the diagnosis.
        found: of the search.
        traces: of its models along the drives.
    """
    problem, chosen, pieces, processes = session.problem, found.chosen.fitted, traces.pieces, traces.processes
    windows = problem.blocked.windows
    shape = (windows.count, int(pieces_of(problem)[-1]) + 1)
    measured = problem.blocked.means_of_all(np.nan_to_num(windows.measured))
    gains = {item.name: item.gain for item in found.nominal.gains}
    left = {item.name: item.gain for item in found.chosen.gains}

    def stacked(field: str) -> Array:
        return np.array([getattr(item, field) for item in processes]).reshape(len(processes), *shape)

    return Evidence(
        problem.blocked.weights.shape[2] * windows.period,
        piece_length(problem),
        windows.recording,
        windows.time,
        problem.blocked.means_of_all(chosen.prediction)[..., 5:8],
        np.where(np.isfinite(problem.blocked.sigma), measured, np.nan),
        _shown(problem, traces.raw, measured),
        _shown(problem, traces.nominal, measured),
        _shown(problem, traces.chosen, measured),
        problem.blocked.sigma,
        tuple(gains),
        np.array(list(gains.values())),
        np.array([left.get(name, np.nan) for name in gains]),
        np.array([session.gates.of(name).gain for name in gains]),
        tuple(pieces.values),
        np.array([item.reshape(shape) for item in pieces.values.values()]),
        np.stack([pieces.x.reshape(shape), pieces.y.reshape(shape)], axis=2),
        tuple(item.name for item in processes),
        stacked("score"),
        stacked("information"),
        stacked("gain"),
        traces.wrench.before,
        traces.wrench.after,
        traces.wrench.deviation,
    )


def _shown(problem: Problem, residual: Array, measured: Array) -> Array:
    """What a model says at the best of what is unknown in each window: measured less the projected residual."""
    known = np.isfinite(problem.blocked.sigma)
    return np.where(known, measured - np.where(known, problem.blocked.sigma, 0.0) * residual, np.nan)
