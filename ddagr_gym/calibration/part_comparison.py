"""Models with and without a part: what both are fitted to, how they forecast left-out drives, which misses the part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ddagr_gym.calibration.calibration_data import CalibrationData
from ddagr_gym.calibration.joint_fit import OFFSET, FittedModel, Standing, fit_model
from ddagr_gym.calibration.left_out import Forecast, fold_sigma, forecast_losses, forecasts
from ddagr_gym.calibration.parts import RobotModel
from ddagr_gym.calibration.settings import CalibrationSettings
from ddagr_gym.diagnosis.answer.drivetrain import LEAST_GROWTH
from ddagr_gym.identification.residual_weights import Weights
from ddagr_gym.identification.windows import WindowSet

CONFIDENCE = 0.84
"""One-sided, with which a part must help: one standard error where there are many drives."""

ITERATIONS = 6
"""Steps of a fit without one part, from where the fit with it stands (ours): with 3 the fits of a simulated robot were
not settled, and parts were kept that it does not have."""

HOPELESS = 0.1
"""Growth of the losses from which no further steps are spent on a fit without a part (ours)."""

SLOW = 0.1
"""Share of a hopeless fit's growth that each step must take off lest it end (ours): all steps would take off half."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A model without some parts.

    Attributes:
        standing: where its fit stands.
        losses: of the forecasts of each fold, by which it is judged.
        counts: windows of each fold that were forecast.
        of_all_channels: losses by all channels.
        cost: of the fit itself.
    """

    standing: Standing
    losses: dict[int, float]
    counts: dict[int, int]
    of_all_channels: dict[int, float]
    cost: float

    @property
    def by_all_channels(self) -> Candidate:
        """The same, judged by all channels."""
        return replace(self, losses=self.of_all_channels)


@dataclass(frozen=True, eq=False)
class Comparison:
    """What all models are fitted to and forecast.

    Attributes:
        data: drives.
        windows: to fit.
        judged: to forecast.
        weights: of the residuals.
        threads: of the simulator.
        settlings: times that a fit without a part goes on, where its forecasts are worse and it is not settled.
    """

    data: CalibrationData
    windows: WindowSet
    judged: WindowSet
    weights: Weights
    threads: int
    settlings: int

    @classmethod
    def of(
        cls, data: CalibrationData, windows: WindowSet, weights: Weights, settings: CalibrationSettings
    ) -> Comparison:
        """What fits to some windows are compared by, with a calibration's settings."""
        return cls(data, windows, data.spread(settings.judged), weights, settings.threads, settings.settlings)

    def fitted(
        self, model: RobotModel, start: Standing, iterations: int = ITERATIONS, rival: float = np.inf
    ) -> FittedModel:
        """A model, fitted from where another one stands, unless its cost cannot come near that of a rival.

        Args:
            model: to fit.
            start: where another one stands.
            iterations: most steps.
            rival: cost of the model that it is compared with.
        """
        kept = {name: value for name, value in start.values.items() if name in model.free or name.startswith(OFFSET)}
        return fit_model(
            self.data, self.windows, model, self.weights, kept, self.threads,
            states=start.states, iterations=iterations, give_up=partial(is_hopeless, rival),
        )  # fmt: skip

    def cost(self, model: RobotModel, standing: Standing) -> float:
        """Cost of a model where the fit of another one stands."""
        return self.fitted(model, standing, iterations=0).fitted.cost

    def forecasts(self, fitted: FittedModel) -> tuple[Forecast, ...]:
        """Of every fold, by a fitted model."""
        return tuple(forecasts(self.data, fitted, self.judged, self.weights, self.threads))

    def judge(self, fitted: FittedModel, made: Sequence[Forecast]) -> Candidate:
        """A fitted model by its forecasts of the wheels' motion."""
        sigma, robust = fold_sigma(self.data, self.windows, self.weights), self.weights.robust
        found = {f.fold: forecast_losses(f, sigma[f.fold], robust) for f in made}
        of_all, of_wheels = ({fold: losses[k] for fold, losses in found.items()} for k in (0, 1))
        counts = {f.fold: f.windows.count for f in made}
        return Candidate(fitted.standing, of_wheels, counts, of_all, fitted.fitted.cost)

    def candidate(
        self, model: RobotModel, start: Standing, iterations: int = ITERATIONS, rival: float = np.inf
    ) -> Candidate:
        """A model, fitted from where another one stands, and its forecasts; arguments as of :meth:`fitted`."""
        fitted = self.fitted(model, start, iterations, rival)
        return self.judge(fitted, self.forecasts(fitted))


def is_hopeless(rival: float, before: float, after: float) -> bool:
    """Whether a step leaves a fit far above the cost of a rival, and hardly nearer to it.

    Args:
        rival: its cost.
        before: cost before the step.
        after: cost after it.
    """
    gap = after - rival
    return gap > HOPELESS * rival and before - after < SLOW * gap


def worse_by(before: Candidate, after: Candidate) -> tuple[float, float]:
    """Mean relative growth of the losses over folds, weighted by the windows of each, and its standard error."""
    folds = list(before.losses)
    growth = np.array([after.losses[fold] / before.losses[fold] - 1.0 for fold in folds])
    share = np.array([before.counts[fold] for fold in folds], dtype=np.float64)
    share /= share.sum()
    mean = float(share @ growth)
    spread = float(share**2 @ (growth - mean) ** 2) * len(folds) / (len(folds) - 1)
    return mean, float(np.sqrt(spread))


def surely_above(folds: int) -> float:
    """Standard errors by which a mean of so many folds must be above 0: Student's t, one-sided."""
    from scipy.special import stdtrit

    return float(stdtrit(folds - 1, CONFIDENCE))


def least_growth(error: float, folds: int, usual: bool = False) -> float:
    """Growth of the losses above which a part is missed: enough to matter, and surely above 0 unless it is usual.

    Args:
        error: standard error of the growth.
        folds: that were left out.
        usual: whether nearly every robot has the part.
    """
    return LEAST_GROWTH if usual else max(LEAST_GROWTH, surely_above(folds) * error)


def is_missed(growth: float, error: float, folds: int, usual: bool = False) -> bool:
    """Whether forecasts without a part are worse by enough.

    Args:
        growth: of the losses without it.
        error: standard error of the growth.
        folds: that were left out.
        usual: whether nearly every robot has the part.
    """
    return growth > least_growth(error, folds, usual)


def misses(before: Sequence[Candidate], after: Candidate, usual: bool = False) -> tuple[bool, float, float]:
    """Whether a model misses a part, and growth and standard error of its losses as of :func:`most_worse_by`.

    Args:
        before: with the part: the first has all parts, the last is what it was taken out of. One between them whose
            fit is no better says nothing: it stopped short of a fit without the part.
        after: without it.
        usual: whether nearly every robot has the part.
    """
    between = [one for one in before[1:-1] if one.cost < after.cost]
    growth, error = most_worse_by((before[0], *between, before[-1]), after, usual)
    is_worse = before[-1].cost < after.cost
    return is_worse and is_missed(growth, error, len(after.losses), usual), growth, error


def most_worse_by(before: Sequence[Candidate], after: Candidate, usual: bool = False) -> tuple[float, float]:
    """That of :func:`worse_by` which says most surely that a part is missed, of several models with it.

    Args:
        before: with the part.
        after: without it.
        usual: whether nearly every robot has the part.
    """
    found = [worse_by(one, after) for one in before]
    return max(found, key=lambda pair: pair[0] / least_growth(pair[1], len(after.losses), usual))


def mean_growth(before: Candidate, after: Candidate) -> float:
    """That of :func:`worse_by` alone."""
    return worse_by(before, after)[0]
