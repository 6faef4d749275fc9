"""Certification: what the named effects are worth on drives that their sizes were not fitted to.

Every recording is forecast by models whose sizes and nuisances were fitted to the others; a single recording by its
halves. The start of a forecast comes from the readings before it
(:mod:`ddagr_gym.diagnosis.certification.forecast`); biases of a recording that a fit has not seen stand at their prior,
zero; the heading of one without poses is that of the fit to all. *Which* effects are in the model was decided on all
drives.

Compared are the raw nominal simulator, the refitted one, the corrected one, a *black box* (a flexible residual model on
top of the refitted one) and the *ceiling*: the best of these and of a flexible model on top of the corrected one, per
quantity. The ceiling says how much of the error anything could have explained from these readings; it is chosen on the
drives that judge, which makes the share that the named effects reach of it rather too small than too large.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.certificate import Certificate, Folds
from ddagr_gym.diagnosis.certification.certificate import (
    BY_RECORDING,
    BY_TIME,
    HORIZONS,
    Errors,
    certificate,
    of_mended_readings,
)
from ddagr_gym.diagnosis.certification.forecast import (
    PAST,
    Forecasts,
    cut_forecasts,
    errors_at,
    past_elimination,
    roll_out,
    start_states,
)
from ddagr_gym.diagnosis.certification.residual_model import ResidualModel, Rollout, corrected, fit_residual_model
from ddagr_gym.diagnosis.preprocessing.session import DiagnosisSession
from ddagr_gym.diagnosis.search.scanned_model import SearchResult
from ddagr_gym.identification.gauss_newton import Fitted, fit
from ddagr_gym.identification.least_squares import Elimination
from ddagr_gym.identification.problem import Point, Problem
from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

STRIDE = 2.0
"""Between the starts of short forecasts [s]; those of the longest are 5 s apart."""

_REFIT_STEPS = 2
"""Gauss-Newton steps from the fit to all drives to that of some of them (ours: they lie close together)."""

CLUSTER = 10.0
"""Time within which errors count as one when intervals are resampled [s], or the horizon where it is longer."""


@dataclass(frozen=True, eq=False)
class Fold:
    """Part of the recordings that judges.

    Attributes:
        training: (W,) windows of the problem that its models were fitted to.
        judges: function of forecasts, (W,) those that judge here.
        trains: function of forecasts, (W,) those that the residual model may see.
        unseen: recordings that the training has nothing of.
    """

    training: Flags
    judges: Callable[[Forecasts], Flags]
    trains: Callable[[Forecasts], Flags]
    unseen: frozenset[int]


def folds_of(problem: Problem) -> tuple[Folds, list[Fold]]:
    """By recording where there are two or more with windows, else both halves of the time."""
    windows = problem.blocked.windows
    numbers = np.unique(windows.recording)
    if len(numbers) > 1:
        return BY_RECORDING, [_recording_fold(problem, int(number)) for number in numbers]
    middle = 0.5 * float(windows.time.min() + (windows.time + windows.duration).max())
    return BY_TIME, [_time_fold(problem, middle, late) for late in (True, False)]


def _recording_fold(problem: Problem, number: int) -> Fold:
    return Fold(
        problem.blocked.windows.recording != number,
        lambda forecasts: forecasts.future.recording == number,
        lambda forecasts: forecasts.future.recording != number,
        frozenset([number]),
    )


def _time_fold(problem: Problem, middle: float, late: bool) -> Fold:
    def side(begin: Array, end: Array, wanted: bool) -> Flags:
        return np.asarray(begin >= middle if wanted else end <= middle)

    def of(forecasts: Forecasts, wanted: bool) -> Flags:
        future = forecasts.future
        return side(future.time - PAST, future.time + future.duration, wanted)

    windows = problem.blocked.windows
    training = side(windows.time, windows.time + windows.duration, not late)
    return Fold(training, lambda f: of(f, late), lambda f: of(f, not late), frozenset())


def refitted_on(problem: Problem, fitted: Fitted, fold: Fold) -> Point:
    """Nuisances and sizes from the fold's training windows, by steps from the fit to all of them.

    What none of them shows (:func:`not_shown`) keeps the size of the fit to all.

    Args:
        problem: of all windows.
        fitted: to all of them; its sensitivities are kept.
        fold: what may be seen.
    """
    chosen = fold.training
    values = fitted.point.values.copy()
    for k, parameter in enumerate(problem.nuisances.parameters):
        # how a drive began is a state and no size: it comes from the fit to all drives
        unseen = parameter.scope is not None and parameter.scope <= fold.unseen
        if unseen and not parameter.heading:
            values[k] = 0.0
    reuse = fitted.subset(chosen)
    start = replace(reuse.point, values=values)
    part = problem.subset(chosen).with_held_headings()
    point = fit(part, start, iterations=_REFIT_STEPS, renewals=1, reuse=reuse).point
    kept, both = not_shown(problem, fitted.point, fold), zip(start.effects, point.effects, strict=True)
    return replace(point, effects=tuple(before if before.name in kept else after for before, after in both))


def not_shown(problem: Problem, point: Point, fold: Fold) -> tuple[str, ...]:
    """Effects that are present in none of a fold's training windows, as before they begin."""
    return tuple(item.name for item in point.effects if not problem.present(item.name)[fold.training].any())


@dataclass(frozen=True, eq=False)
class Arm:
    """A simulator that forecasts.

    Attributes:
        name: of MODELS.
        points: per fold.
        learnt: name of the arm that has a flexible model on top; "" for none.
    """

    name: str
    points: tuple[Point, ...]
    learnt: str = ""


def certify(session: DiagnosisSession, found: SearchResult) -> Certificate:
    """Errors of the models of a search; one that names nothing has no corrected model of its own.

    Args:
        session: of the diagnosis.
        found: of the search, without names that were not accepted.
    """
    fit = certify_models(session, found.nominal.fitted, found.chosen.fitted, session.rng("certification"))
    return of_mended_readings(fit, named=bool(found.chosen.names)) if session.mended.names else fit


def certify_models(session: DiagnosisSession, nominal: Fitted, chosen: Fitted, rng: np.random.Generator) -> Certificate:
    """Errors of two models at the horizons.

    Args:
        session: whose recordings are predicted.
        nominal: the refitted nominal model.
        chosen: the model with the named effects; the nominal one where there are none.
        rng: of the resampling and the forest.
    """
    problem, progress = session.problem, session.progress
    rule, folds = folds_of(problem)
    progress("certification: sizes from the other drives")
    arms = _arms(problem, nominal, chosen, folds)
    sets = _forecast_sets(problem, session.mended.recordings)
    seed = int(rng.integers(2**31))
    learnt: Learnt = {}
    found: dict[float, Errors] = {}
    clusters: dict[float, NDArray[np.int64]] = {}
    for forecasts, horizons in sets:
        progress(f"certification: forecasts of {forecasts.future.duration:.3g} s")
        bases = _bases(forecasts, arms)
        learnt = learnt or _learnt(forecasts, arms, folds, bases, seed)
        errors, kept = _errors(forecasts, arms, folds, horizons, bases, learnt)
        if kept.any():
            found |= errors
            clusters |= {horizon: _clusters(forecasts.subset(kept), horizon) for horizon in horizons}
    known = dict.fromkeys(name for fold in folds for name in not_shown(problem, chosen.point, fold))
    return certificate(rule, found, clusters, rng, tuple(known))


def _arms(problem: Problem, nominal: Fitted, chosen: Fitted, folds: Sequence[Fold]) -> list[Arm]:
    raw = tuple(problem.start() for _ in folds)
    refitted = tuple(refitted_on(problem, nominal, fold) for fold in folds)
    arms = [Arm("raw", raw), Arm("refitted", refitted, "black_box")]
    if chosen.point.effects:
        better = tuple(refitted_on(problem, chosen, fold) for fold in folds)
        arms.append(Arm("corrected", better, "flexible"))
    return arms


def _forecast_sets(problem: Problem, recordings: Sequence[Recording]) -> list[tuple[Forecasts, tuple[float, ...]]]:
    """Forecasts that serve several horizons: short ones often, the longest seldom; those that fit into the drives."""
    short = _on_one_side(problem, cut_forecasts(problem, recordings, HORIZONS[1], STRIDE))
    served: list[tuple[Forecasts, tuple[float, ...]]] = []
    if short is None:
        short = _on_one_side(problem, cut_forecasts(problem, recordings, HORIZONS[0], STRIDE))
        return served if short is None else [(short, HORIZONS[:1])]
    served.append((short, HORIZONS[:2]))
    long = _on_one_side(problem, cut_forecasts(problem, recordings, HORIZONS[2], 2.5 * STRIDE, most=60))
    return served if long is None else [*served, (long, HORIZONS[2:])]


def _on_one_side(problem: Problem, forecasts: Forecasts | None) -> Forecasts | None:
    """Forecasts during which no effect begins or ends, nor in the readings before them; None where there are none.

    A window is simulated with an effect or without it from its first sample to its last.
    """
    if forecasts is None or not problem.spells:
        return forecasts
    future = forecasts.future
    begin, end = future.time - PAST, future.time + future.duration
    crossed = [(future.recording == s.recording) & (begin < s.time) & (s.time < end) for s in problem.spells.values()]
    kept = ~np.any(crossed, axis=0)
    return forecasts.subset(kept) if kept.any() else None


Learnt = dict[tuple[str, int], ResidualModel]


def _bases(forecasts: Forecasts, arms: Sequence[Arm]) -> dict[str, Elimination]:
    """What the unknowns before the starts explain, by arm; the raw model's starts take that of the refitted one."""
    found = {arm.name: past_elimination(forecasts, arm.points[0]) for arm in arms if arm.learnt}
    return found | {"raw": found["refitted"]}


def _learnt(
    forecasts: Forecasts, arms: Sequence[Arm], folds: Sequence[Fold], bases: Mapping[str, Elimination], seed: int
) -> Learnt:
    """Flexible model by arm and fold, from the drives that the fold may see; absent where too little is known."""
    made: Learnt = {}
    for arm in (item for item in arms if item.learnt):
        for number, (fold, point) in enumerate(zip(folds, arm.points, strict=True)):
            shown = fold.trains(forecasts)
            if shown.any():
                model = fit_residual_model(_rolled(forecasts, point, bases[arm.name], shown), STRIDE, seed)
                if model is not None:
                    made[arm.name, number] = model
    return made


def _errors(
    forecasts: Forecasts,
    arms: Sequence[Arm],
    folds: Sequence[Fold],
    horizons: Sequence[float],
    bases: Mapping[str, Elimination],
    learnt: Learnt,
) -> tuple[dict[float, Errors], Flags]:
    """Errors (K,) by horizon, model and quantity, and which of the forecasts (W,) were judged."""
    judged = np.any([fold.judges(forecasts) for fold in folds], axis=0)
    parts: dict[float, Errors] = {h: {} for h in horizons}
    for arm in arms:
        for number, (fold, point) in enumerate(zip(folds, arm.points, strict=True)):
            chosen = fold.judges(forecasts)
            if not chosen.any():
                continue
            rollout = _rolled(forecasts, point, bases[arm.name], chosen)
            made = {arm.name: rollout.readings}
            if arm.learnt:
                model = learnt.get((arm.name, number))
                made[arm.learnt] = rollout.readings if model is None else corrected(model, rollout)
            for name, readings in made.items():
                for horizon in horizons:
                    _put(parts[horizon], name, chosen, errors_at(rollout.windows, readings, horizon))
    return {h: {m: {q: v[judged] for q, v in e.items()} for m, e in parts[h].items()} for h in horizons}, judged


def _rolled(forecasts: Forecasts, point: Point, elimination: Elimination, chosen: Flags) -> Rollout:
    part = forecasts.subset(chosen)
    states = start_states(part, point, elimination.subset(chosen))
    readings, record = roll_out(part, point, states)
    return Rollout(part.future, readings, record)


def _put(errors: Errors, model: str, chosen: Flags, values: Mapping[str, Array]) -> None:
    for name, value in values.items():
        whole = errors.setdefault(model, {}).setdefault(name, np.full(len(chosen), np.nan))
        whole[chosen] = value


def _clusters(forecasts: Forecasts, horizon: float) -> NDArray[np.int64]:
    """(W,) forecasts that start close together share a number."""
    length = max(CLUSTER, horizon)
    keys = np.stack([forecasts.future.recording, np.floor(forecasts.future.time / length).astype(np.int64)], axis=1)
    return np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1).astype(np.int64)
