"""Joint refits of the effects that pass the gate, each with the model so far: which of them explains most?"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from ddagr_gym.diagnosis.gates.thresholds import UNMISTAKABLE, Thresholds
from ddagr_gym.diagnosis.search.equivalents import (
    TRIAL_STEPS,
    with_looped_encoders,
    with_off_centre_load,
    with_slower_loop,
    with_turning_centre,
)
from ddagr_gym.diagnosis.search.gains import Gain
from ddagr_gym.diagnosis.search.initial_guess import (
    first_guess,
    nuisance_answer,
    turned_to_agree,
    with_usual_shape,
)
from ddagr_gym.diagnosis.search.inner_products import Terms
from ddagr_gym.diagnosis.search.limit_guess import limit_guesses
from ddagr_gym.diagnosis.search.patch_guess import patch_guesses
from ddagr_gym.diagnosis.search.scan import drive_extent
from ddagr_gym.diagnosis.search.scanned_model import Rival, ScannedModel, rival_of, scan_model
from ddagr_gym.diagnosis.search.starting_models import FAR_OFF
from ddagr_gym.identification.gauss_newton import DAMPING, Fitted, cost_of, fit
from ddagr_gym.identification.problem import Point, Problem
from ddagr_gym.identification.size_prior import implausibility
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.soil_patch import SoilPatch

_HOPELESS = 0.4
"""Share of the best linear gain below which no joint refit is tried (ours: linear and joint gains differ by less)."""

_LARGE = 100.0
"""Gain above which the linear scan may be far off, so that refits begin from two points (ours)."""

_HOPELESS_LARGE = 0.1
"""Share as above where the best gain is large: linear gains are worse guides there (ours)."""

CLOSE = 0.6
"""Share of the best joint gain above which a rival is fitted to the end (ours: trial steps leave less open)."""


def rivals_of(
    problem: Problem,
    model: ScannedModel,
    raw: Fitted,
    thresholds: Thresholds,
    most: int,
    known: Mapping[str, Rival] = MappingProxyType({}),
) -> list[Rival]:
    """Joint refits of the effects that pass the gate, best first: all for a few steps, the close ones to the end.

    Args:
        problem: what to fit.
        model: the model so far.
        raw: the nominal model with its sensitivities.
        thresholds: of the gate.
        most: effects that are tried.
        known: refits that were made before, by name, which need not be made again.
    """
    ranked = _ranked(problem, model, raw, thresholds)
    large = bool(ranked) and ranked[0][0].gain > _LARGE
    least = (_HOPELESS_LARGE if large else _HOPELESS) * ranked[0][0].gain if ranked else 0.0
    extent = drive_extent(problem, model.fitted.prediction)
    starts = [model.fitted, raw] if large else [model.fitted]
    tried = []
    for gain, terms in ranked[:most]:
        if gain.name in known:
            tried.append(known[gain.name])
        elif gain.gain > least:
            trials = [_trial(problem, model, gain, terms, start) for start in starts]
            best_start = min(range(len(trials)), key=lambda k: trials[k].cost)
            # the start that serves the first rival serves the others
            starts = [starts[best_start]]
            tried.append(rival_of(model, gain.name, trials[best_start]))
    tried = with_turning_centre(problem, model, raw, with_slower_loop(problem, model, tried))
    best = max((rival.gain for rival in tried), default=0.0)
    rivals = [
        _finish(problem, model, rival, large) if rival.gain > CLOSE * best and rival.name not in known else rival
        for rival in tried
    ]
    rivals = with_off_centre_load(problem, model, with_looped_encoders(problem, model, rivals))
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
    bent = not model.names and model.dispersion > FAR_OFF
    return [model, scan_model(problem, raw)] if bent else [model]


def best_gains(
    scans: Sequence[ScannedModel], passes: Callable[[str, float, ScannedModel], bool] = lambda name, gain, scan_: True
) -> dict[str, tuple[Gain, ScannedModel]]:
    """The larger of each effect's gains, with the model whose scan gives it.

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
    """Effects that pass the gate with the scan that gives their gain, best first."""
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
    best = min(fitted, known, key=lambda trial: trial.cost)
    found = with_usual_shape(
        best, model.fitted.cost, lambda start: fit(problem, start, iterations=6, renewals=1, first=best)
    )
    return rival_of(model, rival.name, found)


def _trial(problem: Problem, model: ScannedModel, gain: Gain, terms: Terms, start: Fitted) -> Fitted:
    """A few steps with one further effect from a starting point, whose sensitivities of the nuisances serve.

    Where something large is missing, a nominal refit bends soil and robot to make up for it, so far that no step leads
    back: then the raw nominal model is a better start than the refitted one.
    """
    candidate, others = terms.candidates[gain.candidate], model.fitted.point.effects
    trials = []
    for effect in _guesses(problem, start, others, gain, terms):
        point = turned_to_agree(problem, terms, gain, replace(start.point, effects=(*others, effect)))
        trials.append(fit(problem, point, iterations=TRIAL_STEPS, renewals=2, reuse=start))
    fitted = min(trials, key=lambda trial: trial.cost)
    scanned_here = (terms is model.terms) == (start is model.fitted)
    if fitted.cost < model.fitted.cost or not (scanned_here and candidate.has_sizes):
        return fitted
    # the guess was too far off: nothing at all would have been better
    point = _damped_guess(problem, model, gain, terms, start)
    again = fit(problem, point, iterations=TRIAL_STEPS, renewals=2, reuse=start)
    return min(fitted, again, key=lambda trial: trial.cost)


def _guesses(problem: Problem, start: Fitted, others: Sequence[Effect], gain: Gain, terms: Terms) -> list[Effect]:
    """Effects that a few steps begin at."""
    candidate = terms.candidates[gain.candidate]
    if candidate.is_limit:
        return limit_guesses(problem, start, others, [item for item in terms.candidates if item.name == gain.name])
    if candidate.name == SoilPatch.name:
        return patch_guesses(terms)
    return [first_guess(candidate, gain.multiples)]


def _damped_guess(problem: Problem, model: ScannedModel, gain: Gain, terms: Terms, start: Fitted) -> Point:
    """The scan's step, damped as any other: the effect as guessed, and what soil and robot give back for it.

    A nominal refit has made up for what is missing. With the effect alone that counts twice, and where the guess lies
    far out a fit may begin so badly that no few steps lead down.

    Args:
        problem: what to fit.
        model: the model before.
        gain: of the effect.
        terms: of the scan that gives it, made at ``start``.
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
