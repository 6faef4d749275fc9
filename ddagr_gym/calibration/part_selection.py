"""Which parts of the robot its drives support, by forecasts of left-out drives (backward elimination).

Every part is taken out in turn, what is fitted least often first. It stays out unless the forecasts of the left-out
drives become worse than the best so far by 2 % and by more than the standard error of that change between drives (the
one-standard-error rule; L. Breiman et al., Classification and Regression Trees, 1984, section 3.4.3), with Student's t
for few drives: of all parts together no more than that is given away. Of what nearly every robot has, the dead time,
2 % are enough: there the burden of proof is on its absence.
Forecasts are compared in what a drivetrain moves by itself, wheel speeds and the motors' currents: yaw rate and place
follow from them through the soil, whose own errors a wrong wheel speed may make up for, and places are the integral of
both, so that few large errors decide there.
A part is missed only by a fit that is settled, that has had steps enough, or that stays far above the fit with it, and
never by one that fits as well: that is a point of the model with the part, so that what forecasts differ by is where
fits stop. What is given away is compared with the best so far and with the same model with the part, whichever says
more surely that it is missed: one drive that the best so far happens to forecast badly would hide what all others miss.
What acts through parts that have all gone goes with them. Parts that make the wheels late stand for one another: a fit
without ramp or filter is also tried from a longer dead time, one without a filter from slower motors, and a ramp or a
filter that stayed where the dead time went gives way to a dead time that forecasts as well. One without friction is
also tried from an integral part that is less by what undoes friction.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ddagr_gym.calibration.calibration_data import CalibrationData
from ddagr_gym.calibration.exchanged_parts import DELAY, FILTER, RAMP, other_starts, with_late_commands
from ddagr_gym.calibration.joint_fit import OFFSET, FittedModel, Standing, fit_model
from ddagr_gym.calibration.left_out import Forecast, fold_sigma, forecast_losses, forecasts
from ddagr_gym.calibration.parts import PARTS, RobotModel, idle_parts, part_named
from ddagr_gym.calibration.result import PartDecision
from ddagr_gym.calibration.settings import CalibrationSettings
from ddagr_gym.diagnosis.answer.drivetrain import LEAST_GROWTH
from ddagr_gym.diagnosis.store import StepCache
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


FitFrom = Callable[[str, Standing], "Candidate"]
"""A model, fitted from a start; the text tells fits of the same parts apart among the finished steps."""


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
        before: with the part; the last one is what it was taken out of.
        after: without it.
        usual: whether nearly every robot has the part.
    """
    growth, error = most_worse_by(before, after, usual)
    return after.cost > before[-1].cost and is_missed(growth, error, len(after.losses), usual), growth, error


def most_worse_by(before: Sequence[Candidate], after: Candidate, usual: bool = False) -> tuple[float, float]:
    """That of :func:`worse_by` which says most surely that a part is missed, of several models with it.

    Args:
        before: with the part.
        after: without it.
        usual: whether nearly every robot has the part.
    """
    found = [worse_by(one, after) for one in before]
    return max(found, key=lambda pair: pair[0] / least_growth(pair[1], len(after.losses), usual))


def select_parts(
    comparison: Comparison,
    model: RobotModel,
    full: Candidate,
    cache: StepCache,
    progress: Callable[[str], None],
) -> Selection:
    """Take parts out one after the other while forecasts of left-out drives do not suffer.

    Args:
        comparison: what models are fitted to and forecast.
        model: with all parts that may be taken out.
        full: the same, fitted.
        cache: of models that are fitted already.
        progress: called with a line of text for each part.
    """
    best, least, left_out, decisions = full, full, frozenset[str](), []
    for part in PARTS:
        if not model.free & set(part.parameters):
            continue
        progress(f"forecasts of left-out drives without {part.title}")
        before = (least, best)
        fit = partial(_fitted_without, comparison, model, cache, left_out | {part.name}, best.cost)
        starts = other_starts(part.name, best.standing, model.robot, left_out)
        tried = _settled(fit, before, comparison.settlings, part.usual)
        tried, (kept, growth, error) = from_other_starts(tried, before, starts, fit, part.usual)
        decisions.append(PartDecision(part.name, kept, growth, error))
        if not kept:
            best, left_out = tried, left_out | {part.name}
            least = min(least, best, key=partial(mean_growth, full))
    for name in (RAMP, FILTER):
        if DELAY in left_out and name not in left_out and name in model.free:
            progress(f"forecasts of left-out drives with a dead time in place of the {part_named(name).title}")
            best, left_out, decisions = _delay_for(name, comparison, model, best, left_out, decisions, cache)
    idle = idle_parts(left_out, comparison.data.robot)
    if idle:
        left_out |= idle
        best = _fitted_without(comparison, model, cache, left_out, best.cost, "", best.standing)
        decisions = [replace(item, kept=item.kept and item.name not in idle) for item in decisions]
    return Selection(left_out, tuple(decisions), best.standing)


def _fitted_without(
    comparison: Comparison,
    model: RobotModel,
    cache: StepCache,
    left_out: frozenset[str],
    rival: float,
    stage: str,
    start: Standing,
) -> Candidate:
    """A model without some parts, fitted from a start; ``stage`` tells fits of the same parts apart in the cache."""
    without = model.without(left_out, comparison.data.robot)
    made = partial(comparison.candidate, without, start, rival=rival)
    return cache(f"without {' '.join(sorted(left_out))}{stage}", made)


def _settled(fit: FitFrom, before: tuple[Candidate, ...], settlings: int, usual: bool) -> Candidate:
    """A model without a part, fitted from where the last of those before stands; further while it misses the part."""
    tried = fit("", before[-1].standing)
    for time in range(settlings):
        missed, growth, _ = misses(before, tried, usual)
        if not missed or tried.standing.converged or growth > HOPELESS:
            break
        tried = fit(f", settling {time + 1}", tried.standing)
    return tried


def from_other_starts(
    tried: Candidate,
    before: tuple[Candidate, ...],
    starts: Iterable[tuple[str, Standing]],
    fit: FitFrom,
    usual: bool = False,
) -> tuple[Candidate, tuple[bool, float, float]]:
    """A model without a part or, as long as that misses the part, what fits best of it and of fits from other starts.

    Args:
        tried: the model.
        before: models with the part, as of :func:`misses`.
        starts: where else it may begin, as of :func:`~ddagr_gym.calibration.exchanged_parts.other_starts`.
        fit: from such a start.
        usual: whether nearly every robot has the part.

    Returns:
        The model, and what :func:`misses` says of it.
    """
    found = misses(before, tried, usual)
    for stage, start in starts:
        if not found[0]:
            break
        tried = min(tried, fit(stage, start), key=lambda item: item.cost)
        found = misses(before, tried, usual)
    return tried, found


def mean_growth(before: Candidate, after: Candidate) -> float:
    """That of :func:`worse_by` alone."""
    return worse_by(before, after)[0]


def _delay_for(
    part: str,
    comparison: Comparison,
    model: RobotModel,
    best: Candidate,
    left_out: frozenset[str],
    decisions: list[PartDecision],
    cache: StepCache,
) -> tuple[Candidate, frozenset[str], list[PartDecision]]:
    """A dead time in place of ramp or filter where forecasts do not suffer: all make the wheels late.

    Nearly every robot has a dead time and few have the others. It is kept as any other part is, if forecasts without it
    are worse.
    """
    robot = comparison.data.robot
    exchanged, neither = (left_out - {DELAY}) | {part}, left_out | {part}
    start = with_late_commands(best.standing)
    with_delay = partial(comparison.candidate, model.without(exchanged, robot), start, rival=best.cost)
    late = cache(f"{DELAY} for {part}", with_delay)
    growth, error = worse_by(best, late)
    if is_missed(growth, error, len(late.losses)):
        return best, left_out, decisions
    without = model.without(neither, robot)
    made = partial(comparison.candidate, without, late.standing, rival=late.cost)
    prompt = cache(f"neither {DELAY} nor {part}", made)
    missed, its_growth, its_error = misses((late,), prompt, usual=True)
    if not missed:
        return best, left_out, decisions
    changed = {DELAY: PartDecision(DELAY, True, its_growth, its_error), part: PartDecision(part, False, growth, error)}
    return late, exchanged, [changed.get(item.name, item) for item in decisions]
