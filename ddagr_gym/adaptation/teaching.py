"""Feed-forward taught by repeated turns in the corrected simulator: iterative learning of curvature and lead.

After each round the factor on the commanded curvature is divided, at every place of the half circle, by a part of the
median driven over commanded curvature, and the lead grows by a part of the median heading error at the next row:

    f <- f (commanded/driven)^g,    lead <- lead + g (heading error to the side of the turn)

(Arimoto, Kawamura, Miyazaki, J. Robotic Systems 1 (1984) 123, with the gain g; medians over draws are ours).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ddagr_gym.adaptation.turns import DrivenTurn, MeasuredTurns
from ddagr_gym.control.row_turn import SIDES
from ddagr_gym.evaluation.adapted_controller import AdaptedSettings, FeedForward
from ddagr_gym.evaluation.bundles import Bundle

GAIN = 0.7
"""Part of an error that a round removes (ours)."""

FURTHEST, LARGEST_LEAD = 1.5, 0.6
"""Limits of a factor, which is at least one over the first, and of the lead [rad] (ours)."""


def taught(bundle: Bundle, turns: MeasuredTurns, numbers: Sequence[int], rounds: int) -> Bundle:
    """Bundle with the feed-forward that some rounds of turns teach.

    Args:
        bundle: to begin with.
        turns: where they are driven.
        numbers: of the turns of a round; those to a side teach that side.
        rounds: how many.
    """
    for _ in range(rounds):
        driven = turns.measure_all(bundle, numbers)
        bundle = bundle.with_settings(_improved(bundle.settings, driven))
    return bundle


def _improved(settings: AdaptedSettings, driven: Sequence[DrivenTurn]) -> AdaptedSettings:
    return replace(
        settings,
        left=_corrected(settings.left, "left", driven),
        right=_corrected(settings.right, "right", driven),
    )


def _corrected(feed_forward: FeedForward, side: str, driven: Sequence[DrivenTurn]) -> FeedForward:
    """Feed-forward of a side after its finished turns; as it was without any."""
    driven = [item for item in driven if item.side == side and item.curvature is not None]
    if not driven:
        return feed_forward
    ratio = np.median([item.curvature for item in driven if item.curvature is not None], axis=0)
    factors = np.array(feed_forward.curvature) / np.maximum(ratio, 0.2) ** GAIN
    late = float(np.median([SIDES[side] * item.heading for item in driven if item.heading is not None]))
    lead = min(max(feed_forward.lead + GAIN * late, -LARGEST_LEAD), LARGEST_LEAD)
    limited = np.clip(factors, 1.0 / FURTHEST, FURTHEST)
    return FeedForward(tuple(float(f"{value:.4g}") for value in limited), float(f"{lead:.4g}"))
