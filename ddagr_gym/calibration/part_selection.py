"""Which parts of the robot its drives support, by forecasts of left-out drives (backward elimination).

Every part is taken out in turn, what is fitted least often first. It stays out unless the forecasts of the left-out
drives become worse by more than the standard error of that change between drives (the one-standard-error rule; L.
Breiman et al., Classification and Regression Trees, 1984, section 3.4.3).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from ddagr_gym.calibration.calibration_data import CalibrationData
from ddagr_gym.calibration.joint_fit import OFFSET, Standing, fit_model
from ddagr_gym.calibration.left_out import fold_sigma, forecast_loss, forecasts
from ddagr_gym.calibration.parts import PARTS, without_parts
from ddagr_gym.calibration.result import PartDecision
from ddagr_gym.diagnosis.store import StepCache
from ddagr_gym.identification.parameters import ModelParameter
from ddagr_gym.identification.windows import WindowSet
from ddagr_gym.replay_analysis.fitting import Weights

ITERATIONS = 4
"""Steps of a fit without one part, from where the fit with it stands (ours)."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A model without some parts.

    Attributes:
        standing: where its fit stands.
        losses: of the forecasts of each fold.
    """

    standing: Standing
    losses: dict[int, float]


@dataclass(frozen=True, eq=False)
class Selection:
    """Parts that forecasts of left-out drives ask for.

    Attributes:
        left_out: names of the others.
        decisions: one per part that was tried, in that order.
        standing: of the model with the parts that are kept.
    """

    left_out: frozenset[str]
    decisions: tuple[PartDecision, ...]
    standing: Standing


@dataclass(frozen=True, eq=False)
class Comparison:
    """What all models are fitted to and forecast.

    Attributes:
        data: drives.
        windows: to fit.
        judged: to forecast.
        weights: of the residuals.
        threads: of the simulator.
    """

    data: CalibrationData
    windows: WindowSet
    judged: WindowSet
    weights: Weights
    threads: int

    def candidate(
        self, parameters: tuple[ModelParameter, ...], start: Standing, iterations: int = ITERATIONS
    ) -> Candidate:
        """Model with some parameters, fitted from where another one stands, and its forecasts."""
        free = {p.name for p in parameters if p.prior > 0.0}
        values = {
            name: value if name in free or name.startswith(OFFSET) else 0.0 for name, value in start.values.items()
        }
        fitted = fit_model(
            self.data, self.windows, parameters, self.weights, values, self.threads,
            states=start.states, iterations=iterations,
        )  # fmt: skip
        sigma = fold_sigma(self.data, self.windows, self.weights)
        made = forecasts(self.data, fitted, self.judged)
        return Candidate(fitted.standing, {f.fold: forecast_loss(f, sigma[f.fold], self.weights.robust) for f in made})


def worse_by(before: dict[int, float], after: dict[int, float]) -> tuple[float, float]:
    """Mean relative growth of the losses over folds, and its standard error."""
    growth = np.array([after[fold] / before[fold] - 1.0 for fold in before])
    return float(growth.mean()), float(np.std(growth, ddof=1) / np.sqrt(growth.size))


def select_parts(
    comparison: Comparison,
    parameters: tuple[ModelParameter, ...],
    full: Candidate,
    cache: StepCache,
    progress: Callable[[str], None],
) -> Selection:
    """Take parts out one after the other while forecasts of left-out drives do not suffer.

    Args:
        comparison: what models are fitted to and forecast.
        parameters: of the model with all parts.
        full: that model.
        cache: of models that are fitted already.
        progress: called with a line of text for each part.
    """
    best, left_out, decisions = full, frozenset[str](), []
    for part in PARTS:
        if not {p.name for p in parameters if p.prior > 0.0} & set(part.parameters):
            continue
        progress(f"forecasts of left-out drives without {part.title}")
        without = without_parts(parameters, left_out | {part.name})
        name = f"without {' '.join(sorted(left_out | {part.name}))}"
        tried = cache(name, partial(comparison.candidate, without, best.standing))
        growth, error = worse_by(best.losses, tried.losses)
        kept = growth > error
        decisions.append(PartDecision(part.name, kept, growth, error))
        if not kept:
            best, left_out = tried, left_out | {part.name}
    return Selection(left_out, tuple(decisions), best.standing)
