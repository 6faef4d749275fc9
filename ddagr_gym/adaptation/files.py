"""``adaptation.json``: what was adapted to what, and what it is worth, for other programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from ddagr_gym.adaptation.corrected import Corrected
from ddagr_gym.adaptation.run import Adapted
from ddagr_gym.adaptation.turns import DrivenTurn, sizes
from ddagr_gym.evaluation.statistics import Interval, median_interval, wilson_interval

NAME = "adaptation.json"
SCHEMA = "ddagr-adaptation/1"

NOT_REACHED = 1.0
"""Deviation that stands for a row that was not reached [m] (ours)."""


def deviations(driven: Sequence[DrivenTurn], half_wheelbase: float) -> np.ndarray:
    """Deviation at the next row's start line of turns [m]; at most, and where it is not reached, 1 m."""
    return np.array(
        [
            NOT_REACHED
            if item.lateral is None or item.heading is None
            else min(abs(item.lateral) + half_wheelbase * abs(np.sin(item.heading)), NOT_REACHED)
            for item in driven
        ]
    )


def summary(driven: Sequence[DrivenTurn], half_wheelbase: float) -> dict[str, Any]:
    """Median radius error and exit deviation, and success, with 95 % intervals."""
    return {
        "turns": len(driven),
        "radius_error": _entry(median_interval(sizes(driven))),
        "exit_deviation": _entry(median_interval(deviations(driven, half_wheelbase))),
        "success": _entry(wilson_interval(sum(item.success for item in driven), len(driven))),
    }


def _entry(found: Interval) -> dict[str, Any]:
    values = (found.estimate, found.low, found.high)
    return dict(zip(("value", "low", "high"), (float(f"{value:.5g}") for value in values), strict=True))


def as_json(adapted: Adapted, corrected: Corrected) -> dict[str, Any]:
    """Content of ``adaptation.json``."""
    reach = corrected.robot.half_wheelbase
    return {
        "schema": SCHEMA,
        "verdict": list(corrected.verdict),
        "complete": corrected.complete,
        "sentence": corrected.sentence,
        "kept": adapted.kept,
        "scores": adapted.scores,
        "effects": [item.as_mapping() for item in corrected.all_effects],
        "known_to_the_controller": list(adapted.used),
        "before": summary(adapted.before, reach) if adapted.before else None,
        "after": summary(adapted.after, reach) if adapted.after else None,
        "search": adapted.search,
        "turns": {
            "before": [asdict(item) for item in adapted.before],
            "after": [asdict(item) for item in adapted.after],
        },
    }
