"""The arrays behind a diagnosis, for its pictures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.evidence import NAME, Evidence
from ddagr_gym.diagnosis.gates.thresholds import Thresholds
from ddagr_gym.diagnosis.localisation.effect_timeline import (
    as_it_stands,
    in_blocks,
    piece_length,
    pieces_of,
    projected_residual,
    score_processes,
)
from ddagr_gym.diagnosis.localisation.localise import piece_values
from ddagr_gym.diagnosis.localisation.residual_wrench import residual_wrench
from ddagr_gym.diagnosis.search.scanned_model import SearchResult
from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.identification.problem import Problem

__all__ = ["NAME", "Evidence", "gather_evidence"]

Array = NDArray[np.float64]


def gather_evidence(problem: Problem, found: SearchResult, thresholds: Thresholds | None = None) -> Evidence:
    """Collect what the page draws; a handful of simulations.

    Args:
        problem: windows and model.
        found: of the search.
        thresholds: whose gates end the null band; without them it is not drawn.
    """
    windows, chosen = problem.blocked.windows, found.chosen.fitted
    pieces = piece_values(problem, chosen)
    shape = (windows.count, int(pieces_of(problem)[-1]) + 1)
    processes = score_processes(problem, chosen)
    raw = as_it_stands(problem, found.nominal.fitted)
    wrench = residual_wrench(problem, raw, chosen, found.chosen.dispersion)
    measured = _means(problem, np.nan_to_num(windows.measured))
    gains = {item.name: item.gain for item in found.nominal.gains}
    left = {item.name: item.gain for item in found.chosen.gains}
    gates = [np.nan if thresholds is None else thresholds.of(name).gain for name in gains]

    def stacked(field: str) -> Array:
        return np.array([getattr(item, field) for item in processes]).reshape(len(processes), *shape)

    return Evidence(
        problem.blocked.weights.shape[2] * windows.period,
        piece_length(problem),
        windows.recording,
        windows.time,
        _means(problem, chosen.prediction)[..., 5:8],
        np.where(np.isfinite(problem.blocked.sigma), measured, np.nan),
        _shown(problem, raw, measured),
        _shown(problem, found.nominal.fitted, measured),
        _shown(problem, chosen, measured),
        problem.blocked.sigma,
        tuple(gains),
        np.array(list(gains.values())),
        np.array([left.get(name, np.nan) for name in gains]),
        np.array(gates),
        tuple(pieces.values),
        np.array([item.reshape(shape) for item in pieces.values.values()]),
        np.stack([pieces.x.reshape(shape), pieces.y.reshape(shape)], axis=2),
        tuple(item.name for item in processes),
        stacked("score"),
        stacked("information"),
        stacked("gain"),
        wrench.before,
        wrench.after,
        wrench.deviation,
    )


def _means(problem: Problem, values: Array) -> Array:
    """(W, B, 8) block means of samples (W, T, 8): of all samples where a channel has none."""
    weights = problem.blocked.weights
    count, blocks, length, channels = weights.shape
    kept = values[:, : blocks * length].reshape(count, blocks, length, channels)
    plain = np.full(weights.shape, 1.0 / length)
    return np.asarray((np.where(weights.sum(axis=2, keepdims=True) > 0.0, weights, plain) * kept).sum(axis=2))


def _shown(problem: Problem, fitted: Fitted, measured: Array) -> Array:
    """What a model says at the best of what is unknown in each window: measured less the projected residual."""
    residual = in_blocks(problem, projected_residual(problem, fitted))
    known = np.isfinite(problem.blocked.sigma)
    return np.where(known, measured - np.where(known, problem.blocked.sigma, 0.0) * residual, np.nan)
