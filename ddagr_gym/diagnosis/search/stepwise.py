"""Naming: forward, swap and backward moves over joint refits, each through the gate of the null bank."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from types import MappingProxyType

from ddagr_gym.diagnosis.gates.thresholds import Thresholds
from ddagr_gym.diagnosis.preprocessing.session import DiagnosisSession
from ddagr_gym.diagnosis.search.initial_guess import with_whole_delay
from ddagr_gym.diagnosis.search.rivals import CLOSE, rivals_of
from ddagr_gym.diagnosis.search.scan import scan
from ddagr_gym.diagnosis.search.scanned_model import Rival, ScannedModel, SearchResult, scan_model
from ddagr_gym.diagnosis.search.starting_models import StartingModels
from ddagr_gym.diagnosis.store import StepCache, compute_without_cache
from ddagr_gym.identification.gauss_newton import Fitted, fit
from ddagr_gym.identification.misfit import channel_misfit, dispersion_of
from ddagr_gym.identification.problem import Problem
from ddagr_gym.identification.size_prior import implausibility
from ddagr_gym.physics.effects.registry import effect_kind

_FORM = 0.01
"""Share of what the named effects explain that a further one must explain besides its gate (ours, chosen on the
development set): the library's form of an effect is not the robot's, and the rest of it looks like other effects."""

_NEAR_FORM = 0.1
"""The same for an effect that is confused with a named one (ours: a tenth, as in the intervals): what is left of a
patch of another form looks like a soil that changes (development set: 0.05 and 0.09 of its gain beyond the gate)."""

MOST_EFFECTS = 3
"""Simultaneous effects that a search goes up to (ours: one more than the cases of the development set have)."""

_MOST_RIVALS = 4
"""Effects that are refitted jointly at each step (ours): a joint refit costs as much as a scan."""


def search(
    session: DiagnosisSession,
    start: StartingModels,
    cache: StepCache = compute_without_cache,
    enough: Callable[[ScannedModel], bool] = lambda model: False,
    known: Mapping[str, Rival] = MappingProxyType({}),
) -> SearchResult:
    """Scan the refitted nominal model, and add effects while one passes the gate (theory: diagnosis, section 6).

    Args:
        session: of the diagnosis.
        start: its nominal models.
        cache: of the first scan and of each step, so that a search that was stopped goes on behind the last one.
        enough: whether no further effect is looked for beside a model.
        known: refits of single effects that a search of the same windows has made, by name.
    """
    models = [cache("search nominal", partial(scan_model, session.problem, start.refitted, session.progress))]
    steps: list[tuple[Rival, ...]] = []
    while len(models[-1].names) < MOST_EFFECTS and not enough(models[-1]):
        added = cache(f"search step {len(models)}", partial(_add_effect, session, start.raw, models, steps, known))
        if added is None or set(added[0].names) in [set(model.names) for model in models]:
            break
        models.append(added[0])
        steps.append(added[1])
    if steps and not models[-1].fitted.converged:
        session.progress("last refit")
        models[-1] = _fitted_to_the_end(session.problem, models[-1])
    return SearchResult(tuple(models), tuple(steps))


def _add_effect(
    session: DiagnosisSession,
    raw: Fitted,
    models: Sequence[ScannedModel],
    steps: Sequence[tuple[Rival, ...]],
    known: Mapping[str, Rival],
) -> tuple[ScannedModel, tuple[Rival, ...]] | None:
    """The model with one further effect and the refits that it was chosen from; None where none passes the gate."""
    problem, gates = session.problem, further_gates(session.gates, models)
    tried = rivals_of(problem, models[-1], raw, gates, _MOST_RIVALS, {} if models[-1].names else known)
    tried = [rival for rival in tried if rival.gain > gates.of(rival.name).gain]
    for number, rival in enumerate(tried):
        session.progress(f"joint refit with {rival.name}")
        joint = _joint(problem, rival, steps)
        if joint.cost < models[-1].fitted.cost:
            more = scan_model(problem, joint, session.progress)
            return _without_idle(session, more, gates), tuple(tried[number:])
    return None


def _joint(problem: Problem, rival: Rival, steps: Sequence[tuple[Rival, ...]]) -> Fitted:
    """A rival fitted to the end with sensitivities of its own.

    Its cost may be above that of the trial steps, which counted with sensitivities of the model before.
    """
    best = _swap(problem, rival.fitted, steps)
    return fit(problem, with_whole_delay(problem, best.point), iterations=8, renewals=2, first=best)


def further_gates(thresholds: Thresholds, models: Sequence[ScannedModel]) -> Thresholds:
    """Gates of further effects: higher by shares of what the named ones explain.

    What is left of another form of an effect lies in the windows and channels in which it acts: a further effect that
    acts elsewhere (:attr:`~ddagr_gym.diagnosis.search.inner_products.Terms.overlap`) need not explain it. Of a
    named one the overlap with those before it counts. What named effects make the robot lean counts besides, see
    :func:`beyond_lean`.

    Args:
        thresholds: of the null bank.
        models: models from the nominal one to the one that further effects are to join.
    """
    explained = _explained(models)
    near = {name for effect in models[-1].fitted.point.effects for name in effect.confused_with}
    overlap = {name: share for model in models for name, share in model.terms.overlap.items()}
    names = {*thresholds.gates, *overlap}
    shares = {name: _NEAR_FORM if name in near else _FORM * overlap.get(name, 1.0) for name in names}
    raised = thresholds.raised({name: share * explained for name, share in shares.items()})
    return beyond_lean(raised, models[-1].terms.imitated, models[-1].dispersion)


def beyond_lean(thresholds: Thresholds, imitated: Mapping[str, float], dispersion: float) -> Thresholds:
    """Gates that an effect passes only if it still would without what the robot's lean reads.

    The root of a gain is a size over its error: those of the effect and of the lean add up where both point the same
    way.

    Args:
        thresholds: of further effects.
        imitated: see :class:`~ddagr_gym.diagnosis.search.inner_products.Terms`.
        dispersion: of the model that they are to join.
    """
    by = {}
    for name, gain in imitated.items():
        lean = gain / dispersion
        by[name] = lean + 2.0 * math.sqrt(lean * thresholds.of(name).gain)
    return thresholds.raised(by)


def _explained(models: Sequence[ScannedModel]) -> float:
    """Gain of the named effects together."""
    return (models[0].fitted.cost - models[-1].fitted.cost) / models[-1].dispersion


def _fitted_to_the_end(problem: Problem, model: ScannedModel) -> ScannedModel:
    """The same model fitted to the end; what the scan said of others stays."""
    point, last = model.fitted.point, model.fitted
    fitted = min(fit(problem, point, iterations=8, renewals=2, first=last), last, key=lambda trial: trial.cost)
    return replace(model, fitted=fitted, misfit=channel_misfit(problem, fitted))


def _swap(problem: Problem, fitted: Fitted, steps: Sequence[tuple[Rival, ...]]) -> Fitted:
    """Swap move: the model with a close rival in place of an effect of an earlier step, where it fits better."""
    best = fitted
    for rivals in steps:
        place = _place_of(rivals, fitted)
        if place is None:
            continue
        for rival in rivals[1:]:
            names = {effect.name for effect in best.point.effects}
            if rival.gain < CLOSE * rivals[0].gain or rival.name in names or rival.equivalent:
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


def _without_idle(session: DiagnosisSession, model: ScannedModel, gates: Thresholds) -> ScannedModel:
    """Backward move: the effect whose removal costs less than its threshold goes.

    The gate of the last one knows how the others make the robot lean; those of the others do not know what it adds.
    """
    problem, effects = session.problem, model.fitted.point.effects
    if len(effects) < 2:
        return model
    losses = []
    for number, effect in enumerate(effects):
        kept = (*effects[:number], *effects[number + 1 :])
        without = fit(problem, replace(model.fitted.point, effects=kept), iterations=4, reuse=model.fitted)
        loss = (without.cost - model.fitted.cost) / model.dispersion
        known = number + 1 == len(effects) or not model.terms.imitated
        own = gates if known else _beside(problem, gates, without, effect.name, model.dispersion)
        losses.append((loss / own.of(effect.name).gain, without))
    least = min(losses, key=lambda item: item[0])
    if least[0] >= 1.0:
        return model
    return scan_model(problem, fit(problem, least[1].point, iterations=4), session.progress)


def _beside(problem: Problem, gates: Thresholds, without: Fitted, name: str, dispersion: float) -> Thresholds:
    """Gates that know how a model makes the robot lean which lacks an effect."""
    terms = scan(problem, without, {name: effect_kind(name)})
    return beyond_lean(gates, terms.imitated, dispersion)
