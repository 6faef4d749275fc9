"""Parts that are decided with all windows, once the others are fitted.

Few windows of each drive mislead about two kinds of parts. Values that the data sheet states, of wheels, masses and
gyro, move far where a model lacks something else: they hold until the other parts are fitted, and are free only where
forecasts of left-out drives gain by that, in all channels (forward selection). And a ramp or a filter of the commands
that few windows asked for is kept only if all of them miss it, wherever else a fit without it may begin.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ddagr_gym.calibration.exchanged_parts import FILTER, RAMP, other_starts
from ddagr_gym.calibration.joint_fit import LAST_ITERATIONS, Standing
from ddagr_gym.calibration.part_comparison import Candidate, Comparison, misses
from ddagr_gym.calibration.part_selection import Selection, from_other_starts
from ddagr_gym.calibration.parts import PARTS, RobotModel, part_named
from ddagr_gym.calibration.result import PartDecision
from ddagr_gym.diagnosis.store import StepCache
from ddagr_gym.parameters import Robot

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
    """A selection without ramp or filter that all windows do not miss, and with data sheet values that they correct.

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
    for name in (RAMP, FILTER):
        if name not in left_out and name in model.free:
            progress(f"forecasts with all windows without the {part_named(name).title}")
            best, left_out, decisions = _without(name, fit, model.robot, best, left_out, decisions)
    for part in PARTS:
        if not part.on_data_sheet or not model.free & set(part.parameters):
            continue
        progress(f"forecasts with all windows with {part.title} free")
        tried = fit(left_out - {part.name}, best.standing, best.cost, f"with {part.name}")
        kept, growth, error = misses((tried.by_all_channels,), best.by_all_channels)
        decisions.append(PartDecision(part.name, kept, growth, error))
        if kept:
            best, left_out = tried, left_out - {part.name}
    return Selection(left_out, tuple(decisions), best.standing)


def _without(
    part: str, fit: Fit, robot: Robot, best: Candidate, left_out: frozenset[str], decisions: list[PartDecision]
) -> tuple[Candidate, frozenset[str], list[PartDecision]]:
    """Without ramp or filter, from where the fit stands or else from another start, unless it is missed from all."""
    without = left_out | {part}
    stage = f"without the {part_named(part).title}"
    tried, (kept, growth, error) = from_other_starts(
        fit(without, best.standing, best.cost, stage),
        (best,),
        other_starts(part, best.standing, robot, left_out),
        lambda name, start: fit(without, start, best.cost, stage + name),
    )
    changed = [PartDecision(part, kept, growth, error) if item.name == part else item for item in decisions]
    return (best, left_out, changed) if kept else (tried, without, changed)


def _settled(
    comparison: Comparison, model: RobotModel, left_out: frozenset[str], start: Standing, rival: float
) -> Candidate:
    """A model without some parts, fitted until it is settled, hopeless or has had twice the steps, and forecast."""
    without = model.without(left_out, comparison.data.robot)
    fitted = comparison.fitted(without, start, 2 * LAST_ITERATIONS, rival)
    return comparison.judge(fitted, comparison.forecasts(fitted))
