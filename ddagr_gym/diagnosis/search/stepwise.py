"""Naming: forward, swap and backward moves over joint refits, each through the gate of the null bank."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.gates.thresholds import UNMISTAKABLE, Thresholds
from ddagr_gym.diagnosis.search.equivalents import TRIAL_STEPS, with_looped_encoders, with_slower_loop
from ddagr_gym.diagnosis.search.initial_guess import first_guess, turned_to_agree, with_whole_delay
from ddagr_gym.diagnosis.search.scan import Gain, Terms, dispersion_of, drive_extent, nuisance_answer
from ddagr_gym.diagnosis.search.scanned_model import Rival, ScannedModel, SearchResult, rival_of, scan_model
from ddagr_gym.diagnosis.store import StepCache, compute_without_cache
from ddagr_gym.identification.gauss_newton import DAMPING, Fitted, cost_of, fit
from ddagr_gym.identification.misfit import channel_misfit
from ddagr_gym.identification.problem import Point, Problem
from ddagr_gym.identification.size_prior import implausibility

Array = NDArray[np.float64]

_HOPELESS = 0.4  # share of the best linear gain below which no joint refit is tried
_LARGE = 100.0  # gain above which the linear scan may be far off: refits then begin from two points
_HOPELESS_LARGE = 0.1  # the same share there
_FORM = 0.01
"""Share of what the named effects explain that a further one must explain besides its gate (ours): the library's form
of an effect is not the robot's, and what is left of it looks like other effects."""

_NEAR_FORM = 0.1
"""The same for an effect that is confused with a named one (ours: a tenth, as in the intervals): what is left of a
patch of another form looks like a soil that changes (development: 0.05 and 0.09 of its gain beyond the gate)."""

BENT = 4.0
"""Dispersion of the refitted nominal model above which the raw one is scanned too, and windows are short."""

_CLOSE = 0.6  # share of the best joint gain above which a rival is fitted to the end

MOST_EFFECTS = 3
"""Simultaneous effects that a search goes up to (diagnosis.md, step 6)."""


def _trial(problem: Problem, model: ScannedModel, gain: Gain, terms: Terms, start: Fitted) -> Fitted:
    """A few steps with one further effect from a starting point, whose sensitivities of the nuisances serve.

    Where something large is missing, a nominal refit bends soil and robot to make up for it, so far that no step leads
    back: then the raw nominal model is a better start than the refitted one.
    """
    candidate = terms.candidates[gain.candidate]
    effect = first_guess(candidate, gain.multiples)
    point = replace(start.point, effects=(*model.fitted.point.effects, effect))
    point = turned_to_agree(problem, terms, gain, point)
    fitted = fit(problem, point, iterations=TRIAL_STEPS, renewals=2, reuse=start)
    scanned_here = (terms is model.terms) == (start is model.fitted)
    if fitted.cost < model.fitted.cost or not (scanned_here and candidate.has_sizes):
        return fitted
    # the guess was too far off: nothing at all would have been better
    point = _damped_guess(problem, model, gain, terms, start)
    again = fit(problem, point, iterations=TRIAL_STEPS, renewals=2, reuse=start)
    return min(fitted, again, key=lambda trial: trial.cost)


def _damped_guess(problem: Problem, model: ScannedModel, gain: Gain, terms: Terms, start: Fitted) -> Point:
    """The scan's step, damped as any other: the effect as guessed, and what soil and robot give back for it.

    A nominal refit has made up for what is missing. With the effect alone that counts twice, and where the guess lies
    far out a fit may begin so badly that no few steps lead down.

    Args:
        problem: what to fit.
        model: the model before.
        gain: of the effect.
        terms: of the scan that says so, made at ``start``.
        start: where to begin.
    """
    candidate = terms.candidates[gain.candidate]
    answer = nuisance_answer(problem, start, terms, gain)
    points, costs = [], []
    for share in DAMPING:
        effect = first_guess(candidate, [share * multiple for multiple in gain.multiples])
        values = np.clip(start.point.values + share * answer, problem.low, problem.high)
        point = replace(start.point, values=values, effects=(*model.fitted.point.effects, effect))
        point = turned_to_agree(problem, terms, gain, point, share)
        points.append(point)
        costs.append(cost_of(problem, point, problem.predict(point), start.elimination)[0])
        if costs[-1] < start.cost:
            break
    return points[int(np.argmin(costs))]


def rivals_of(problem: Problem, model: ScannedModel, raw: Fitted, thresholds: Thresholds, most: int) -> list[Rival]:
    """Joint refits of the effects that pass the gate, best first: all for a few steps, the close ones to the end.

    Args:
        problem: what to fit.
        model: the model so far.
        raw: the nominal model with its sensitivities.
        thresholds: of the gate.
        most: effects that are tried.
    """
    ranked = _ranked(problem, model, raw, thresholds)
    large = bool(ranked) and ranked[0][0].gain > _LARGE
    least = (_HOPELESS_LARGE if large else _HOPELESS) * ranked[0][0].gain if ranked else 0.0
    extent = drive_extent(problem, model.fitted.prediction)
    starts = [model.fitted, raw] if large else [model.fitted]
    tried = []
    for gain, terms in ranked[:most]:
        if gain.gain > least:
            trials = [_trial(problem, model, gain, terms, start) for start in starts]
            best_start = min(range(len(trials)), key=lambda k: trials[k].cost)
            # the start that serves the first rival serves the others
            starts = [starts[best_start]]
            tried.append(rival_of(model, gain.name, trials[best_start]))
    tried = with_slower_loop(problem, model, tried)
    best = max((rival.gain for rival in tried), default=0.0)
    rivals = [_finish(problem, model, rival, large) if rival.gain > _CLOSE * best else rival for rival in tried]
    rivals = with_looped_encoders(problem, model, rivals)
    kept = [
        rival
        for rival in rivals
        if rival.fitted.point.effects[-1].is_meaningful(extent)
        or rival.gain > UNMISTAKABLE * thresholds.of(rival.name).gain
    ]
    return sorted(kept, key=lambda rival: implausibility(rival.fitted.point.effects[-1]) - rival.gain)


def scans_of(problem: Problem, model: ScannedModel, raw: Fitted) -> list[ScannedModel]:
    """Models whose scans count: where the refitted nominal one is far off, the raw nominal one too.

    Soil and robot are bent so much there that the truth may not show.

    Args:
        problem: what to fit.
        model: the model so far.
        raw: the nominal model with its sensitivities.
    """
    bent = not model.names and model.dispersion > BENT
    return [model, scan_model(problem, raw)] if bent else [model]


def best_gains(
    scans: Sequence[ScannedModel], passes: Callable[[str, float, ScannedModel], bool] = lambda name, gain, scan_: True
) -> dict[str, tuple[Gain, ScannedModel]]:
    """The larger of each effect's gains, with the model whose scan says so.

    Args:
        scans: see :func:`scans_of`.
        passes: whether a gain counts.
    """
    best: dict[str, tuple[Gain, ScannedModel]] = {}
    for scan_ in scans:
        for gain in scan_.gains:
            better = gain.name not in best or gain.gain > best[gain.name][0].gain
            if better and passes(gain.name, gain.gain, scan_):
                best[gain.name] = (gain, scan_)
    return best


def _ranked(problem: Problem, model: ScannedModel, raw: Fitted, thresholds: Thresholds) -> list[tuple[Gain, Terms]]:
    """Effects that pass the gate with the scan that says so, best first."""
    best = best_gains(scans_of(problem, model, raw), thresholds.passes).values()
    ranked = sorted(best, key=lambda item: thresholds.of(item[0].name).gain - item[0].gain)
    return [(gain, scan_.terms) for gain, scan_ in ranked]


def _finish(problem: Problem, model: ScannedModel, rival: Rival, large: bool) -> Rival:
    """A rival fitted to the end; one that explains much changes the nuisances' sensitivities, which are renewed."""
    point, known = rival.fitted.point, rival.fitted
    if large:
        fitted = fit(problem, point, iterations=6, renewals=1, first=known)
    else:
        fitted = fit(problem, point, iterations=6, renewals=2, reuse=known)
    return rival_of(model, rival.name, min(fitted, known, key=lambda trial: trial.cost))


def refit_nominal(problem: Problem, progress: Callable[[str], None] = lambda text: None) -> tuple[Fitted, Fitted]:
    """The raw nominal model with its sensitivities, and the refitted one."""
    progress("refitting the nominal model")
    raw = fit(problem, iterations=0)
    return raw, fit(problem, raw.point, first=raw)


def refit_and_scan(
    problem: Problem, progress: Callable[[str], None] = lambda text: None
) -> tuple[Fitted, ScannedModel]:
    """The raw nominal model with its sensitivities, and the refitted one with its scan."""
    raw, refitted = refit_nominal(problem, progress)
    return raw, scan_model(problem, refitted, progress)


def search(
    problem: Problem,
    thresholds: Thresholds,
    *,
    rivals: int = 4,
    most: int = MOST_EFFECTS,
    progress: Callable[[str], None] = lambda text: None,
    nominal: tuple[Fitted, ScannedModel] | None = None,
    cache: StepCache = compute_without_cache,
) -> SearchResult:
    """Refit, scan, and add effects while one passes the gate.

    Args:
        problem: windows and model.
        thresholds: of the null bank.
        rivals: effects that are refitted jointly at each step.
        most: effects at the same time.
        progress: called with what is being done.
        nominal: raw and refitted nominal model of an earlier :func:`refit_and_scan`.
        cache: of the nominal refit and of each step, so that a search that was stopped goes on behind the last one.
    """
    first = cache("search begin", partial(refit_and_scan, problem, progress)) if nominal is None else nominal
    raw, model = first
    models: list[ScannedModel] = [model]
    steps: list[tuple[Rival, ...]] = []
    while len(models[-1].names) < most:
        number = f"search step {len(models)}"
        gates = further_gates(thresholds, models)
        added = cache(number, partial(_added, problem, models[-1], raw, steps, gates, rivals, progress))
        if added is None or set(added[0].names) in [set(s.names) for s in models]:
            break
        models.append(added[0])
        steps.append(added[1])
    if steps and not models[-1].fitted.converged:
        progress("last refit")
        models[-1] = _settled(problem, models[-1])
    return SearchResult(tuple(models), tuple(steps))


def further_gates(thresholds: Thresholds, models: Sequence[ScannedModel]) -> Thresholds:
    """Gates of further effects: higher by shares of what the named ones explain.

    What is left of another form of an effect lies in the windows and channels in which it acts: a further effect that
    acts elsewhere (:attr:`~ddagr_gym.diagnosis.search.scan.Terms.overlap`) need not explain it. Of a named one the
    overlap with those before it counts.

    Args:
        thresholds: of the null bank.
        models: models from the nominal one to the one that further effects are to join.
    """
    explained = _explained(models)
    near = {name for effect in models[-1].fitted.point.effects for name in effect.confused_with}
    overlap = {name: share for model in models for name, share in model.terms.overlap.items()}
    names = {*thresholds.gates, *overlap}
    shares = {name: _NEAR_FORM if name in near else _FORM * overlap.get(name, 1.0) for name in names}
    return thresholds.raised({name: share * explained for name, share in shares.items()})


def _explained(models: Sequence[ScannedModel]) -> float:
    """Gain of the named effects together."""
    return (models[0].fitted.cost - models[-1].fitted.cost) / models[-1].dispersion


def _added(
    problem: Problem,
    model: ScannedModel,
    raw: Fitted,
    steps: Sequence[tuple[Rival, ...]],
    thresholds: Thresholds,
    most: int,
    progress: Callable[[str], None],
) -> tuple[ScannedModel, tuple[Rival, ...]] | None:
    """The model with one further effect and the refits that it was chosen from; None where none passes the gate."""
    tried = rivals_of(problem, model, raw, thresholds, most)
    tried = [rival for rival in tried if rival.gain > thresholds.of(rival.name).gain]
    if not tried:
        return None
    progress(f"joint refit with {tried[0].name}")
    best = _swapped(problem, tried[0].fitted, steps)
    point = with_whole_delay(problem, best.point)
    more = scan_model(problem, fit(problem, point, iterations=8, renewals=2, first=best), progress)
    return _without_idle(problem, more, thresholds, progress), tuple(tried)


def _settled(problem: Problem, model: ScannedModel) -> ScannedModel:
    """The same model fitted to the end; what the scan said of others stays."""
    point, last = model.fitted.point, model.fitted
    fitted = min(fit(problem, point, iterations=8, renewals=2, first=last), last, key=lambda trial: trial.cost)
    return replace(model, fitted=fitted, misfit=channel_misfit(problem, fitted))


def _swapped(problem: Problem, fitted: Fitted, steps: Sequence[tuple[Rival, ...]]) -> Fitted:
    """Swap move: the model with a close rival in place of an effect of an earlier step, where it fits better."""
    best = fitted
    for rivals in steps:
        place = _place_of(rivals, fitted)
        if place is None:
            continue
        for rival in rivals[1:]:
            names = {effect.name for effect in best.point.effects}
            if rival.gain < _CLOSE * rivals[0].gain or rival.name in names or rival.equivalent:
                continue
            effects = list(best.point.effects)
            effects[place] = rival.fitted.point.effects[-1]
            tried = fit(problem, replace(best.point, effects=tuple(effects)), iterations=4, reuse=fitted)
            best = min(best, tried, key=partial(_with_sizes, problem))
    return best


def _place_of(rivals: Sequence[Rival], fitted: Fitted) -> int | None:
    """Place of the effect that a step added, or that was put there instead; None where it has gone again."""
    names = [effect.name for effect in fitted.point.effects]
    return next((names.index(rival.name) for rival in rivals if rival.name in names), None)


def _with_sizes(problem: Problem, fitted: Fitted) -> float:
    """Cost and how unusual the effects' sizes are, which settles ties."""
    unusual = sum(implausibility(effect) for effect in fitted.point.effects)
    return fitted.cost + dispersion_of(problem, fitted) * unusual


def _without_idle(
    problem: Problem, model: ScannedModel, thresholds: Thresholds, progress: Callable[[str], None]
) -> ScannedModel:
    """Backward move: the effect whose removal costs less than its threshold goes."""
    effects = model.fitted.point.effects
    if len(effects) < 2:
        return model
    losses = []
    for number, effect in enumerate(effects):
        kept = (*effects[:number], *effects[number + 1 :])
        without = fit(problem, replace(model.fitted.point, effects=kept), iterations=4, reuse=model.fitted)
        loss = (without.cost - model.fitted.cost) / model.dispersion
        losses.append((loss / thresholds.of(effect.name).gain, without))
    least = min(losses, key=lambda item: item[0])
    if least[0] >= 1.0:
        return model
    return scan_model(problem, fit(problem, least[1].point, iterations=4), progress)
