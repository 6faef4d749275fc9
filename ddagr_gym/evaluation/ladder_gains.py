"""Gains of the ladder's closed loops, as the search wrote them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from ddagr_gym.config import configs_dir, load_config
from ddagr_gym.control.model_predictive import PredictiveSettings
from ddagr_gym.control.tracker_settings import LoopSettings, TrackerSettings


@dataclass(frozen=True)
class LadderGains:
    """What the search on the validation set found.

    Attributes:
        yaw_rate: of B2, curvature per yaw rate.
        radial: of B3, curvature per distance.
        force_balance: of B4.
        predictive: of B5.
        path_tracker: of B6, curvature per cross-track error.
        path_tracker_course: its curvature per course error [1/(m rad)].
        path_tracker_ahead: time by which its errors run ahead [s].
        path_tracker_side_slip: share of the side slip in its course [-].
        path_tracker_aligning: distance over which its nose turns into the next row [m].
        path_tracker_largest_slip: side slip that counts at most [rad]; not searched.
        true_curvature: of the upper bound of that name.
        true_soil: likewise.
        true_path: likewise, curvature per lateral error.
        true_path_heading: its curvature per heading error [1/(m rad)].
    """

    yaw_rate: LoopSettings
    radial: LoopSettings
    force_balance: LoopSettings
    predictive: PredictiveSettings
    true_curvature: LoopSettings
    true_soil: LoopSettings
    true_path: LoopSettings
    path_tracker: LoopSettings
    true_path_heading: float = 3.0
    path_tracker_course: float = 4.0
    path_tracker_ahead: float = 0.0
    path_tracker_side_slip: float = 1.0
    path_tracker_aligning: float = 0.0
    path_tracker_largest_slip: float = 0.5


@lru_cache(maxsize=1)
def ladder_gains() -> LadderGains:
    """Gains of ``configs/evaluation/ladder_gains.yaml``, where the search writes its result."""
    return load_config(gains_file(), LadderGains)


def tracker_settings() -> TrackerSettings:
    """Gains of B6, of :func:`ladder_gains`."""
    gains = ladder_gains()
    return TrackerSettings(
        gains.path_tracker, gains.path_tracker_course, gains.path_tracker_ahead, gains.path_tracker_side_slip,
        gains.path_tracker_aligning, gains.path_tracker_largest_slip,
    )  # fmt: skip


def gains_file() -> Path:
    """Where :func:`ladder_gains` reads."""
    return configs_dir() / "evaluation" / "ladder_gains.yaml"
