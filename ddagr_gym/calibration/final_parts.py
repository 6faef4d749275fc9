"""Parts that are decided with all windows, once the others are fitted.

Few windows of each drive mislead about two kinds of parts. Values that the data sheet states, of wheels, masses and
gyro, move far where a model lacks something else: they hold until the other parts are fitted, and are free only where
forecasts of left-out drives gain by that, in all channels (forward selection). And a ramp of the commands that few
windows asked for is kept only if all of them miss it, also from a longer dead time.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from ddagr_gym.calibration.joint_fit import LAST_ITERATIONS, Standing
from ddagr_gym.calibration.part_selection import (
    DELAY,
    RAMP,
    TRIED_DELAY,
    Candidate,
    Comparison,
    Selection,
    is_missed,
    late_start,
    mean_growth,
    worse_by,
)
from ddagr_gym.calibration.parts import PARTS, RobotModel
from ddagr_gym.calibration.result import PartDecision
from ddagr_gym.diagnosis.store import StepCache

Fit = Callable[[frozenset[str], Standing, float, str], Candidate]
"""Model without some parts, fitted from a start unless its cost cannot come near that of a rival, and forecast; the
text names it among the finished steps."""


def decide_with_all_windows(
    comparison: Comparison,
    model: RobotModel,
    selected: Selection,
    cache: StepCache,
    progress: Callable[[str], None],
) -> Selection:
    """A selection without a ramp that all windows do not miss, and with values of the data sheet that they correct.

    Args:
        comparison: all windows that are fitted, and those that are forecast.
        model: with all parts.
        selected: by few windows, of the parts that no data sheet states; it stands where the joint fit does.
        cache: of models that are fitted already.
        progress: called with a line of text for each part.
    """

    def fit(left_out: frozenset[str], start: Standing, rival: float, stage: str) -> Candidate:
        return cache(f"all windows, {stage}", lambda: _settled(comparison, model, left_out, start, rival))

    left_out, decisions = selected.left_out, list(selected.decisions)
    best = fit(left_out, selected.standing, np.inf, "as selected")
    if RAMP not in left_out:
        progress("forecasts with all windows without the ramp of the commands")
        best, left_out, decisions = _without_ramp(fit, best, left_out, decisions)
    for part in PARTS:
        if not part.on_data_sheet or not model.free & set(part.parameters):
            continue
        progress(f"forecasts with all windows with {part.title} free")
        tried = fit(left_out - {part.name}, best.standing, best.cost, f"with {part.name}")
        growth, error = worse_by(tried.by_all_channels, best.by_all_channels)
        kept = is_missed(growth, error, len(best.losses))
        decisions.append(PartDecision(part.name, kept, growth, error))
        if kept:
            best, left_out = tried, left_out - {part.name}
    return Selection(left_out, tuple(decisions), best.standing)


def _without_ramp(
    fit: Fit, best: Candidate, left_out: frozenset[str], decisions: list[PartDecision]
) -> tuple[Candidate, frozenset[str], list[PartDecision]]:
    """Without the ramp, from the dead time as it is or else from a longer one, unless it is missed from both."""
    without = left_out | {RAMP}
    tried = fit(without, best.standing, best.cost, "without the ramp")
    growth, error = worse_by(best, tried)
    short = DELAY not in left_out and best.standing.values[DELAY] < TRIED_DELAY
    if short and is_missed(growth, error, len(tried.losses)):
        late = fit(without, late_start(best), best.cost, f"without the ramp, dead time from {TRIED_DELAY:g}")
        tried = min(tried, late, key=partial(mean_growth, best))
        growth, error = worse_by(best, tried)
    kept = is_missed(growth, error, len(tried.losses))
    changed = [PartDecision(RAMP, kept, growth, error) if item.name == RAMP else item for item in decisions]
    return (best, left_out, changed) if kept else (tried, without, changed)


def _settled(
    comparison: Comparison, model: RobotModel, left_out: frozenset[str], start: Standing, rival: float
) -> Candidate:
    """A model without some parts, fitted until it is settled, hopeless or has had twice the steps, and forecast."""
    without = model.without(left_out, comparison.data.robot)
    fitted = comparison.fitted(without, start, 2 * LAST_ITERATIONS, rival)
    return comparison.judge(fitted, comparison.forecasts(fitted))
