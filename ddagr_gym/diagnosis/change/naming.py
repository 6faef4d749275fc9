"""Names for what changed: the effect beside which nothing else is out of the ordinary, one after the other.

An effect that is not the one that changed leaves shifts of others behind when it is fitted; the right one takes all of
them away. Of those that do, the joint refits decide, and what they do not tell apart stays an equivalence set. Where
one of them is out of the ordinary among all effects, another that explains as much need be so by itself only: that
something changed is then known.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ddagr_gym.diagnosis.change.drive_fit import fit_nominal
from ddagr_gym.diagnosis.change.drive_scan import NAMED
from ddagr_gym.diagnosis.change.model import Model, model_of
from ddagr_gym.diagnosis.change.nested import beside, containing
from ddagr_gym.diagnosis.change.ordinary import Comparison
from ddagr_gym.diagnosis.change.refits import MOST_RIVALS, Refit, joint_refits
from ddagr_gym.diagnosis.change.refitted_shift import refitted_shift, times_farther
from ddagr_gym.diagnosis.change.shifts import LEVEL, Shift
from ddagr_gym.diagnosis.mid_drive.search_in_time import LEAST_EVIDENCE
from ddagr_gym.diagnosis.result.equivalence import equivalence_weights
from ddagr_gym.diagnosis.search.initial_guess import same_lateness
from ddagr_gym.diagnosis.search.scanned_model import Rival
from ddagr_gym.identification.effect_parameters import effect_parameters
from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.identification.misfit import dispersion_of
from ddagr_gym.identification.problem import Problem
from ddagr_gym.physics.effects.command_delay import CommandDelay
from ddagr_gym.physics.effects.motor_lag import MotorLag
from ddagr_gym.physics.effects.soil_change import SoilChange
from ddagr_gym.physics.effects.soil_patch import SoilPatch

MOST_NAMES = 3
"""Effects that may be named together: as in a diagnosis."""

CLOSE = 0.7
"""Share of the best refit's gain below which another is no rival (ours), where the best leaves nothing out of the
ordinary."""

LEAST_SHARE = 0.04
"""Share of all that is out of the ordinary below which nothing is named (ours): what a library's form that is off by a
fifth leaves to other effects, a fifth squared."""

FORM_OF_GAIN = 0.15
"""Share of the best refit's gain in units of which differences of cost count (ours): robot and ground are fitted anew
in every comparison, and the forms of effects are not the robot's."""

NEARLY = 1.1
"""Factor on what the best name leaves out of the ordinary up to which another leaves nearly as little (ours)."""

Tried = tuple[Model, Rival]
"""The model with one more effect, and its joint refit."""


@dataclass(frozen=True, eq=False)
class Step:
    """One name with what else it could be.

    Attributes:
        shift: of the named effect when it was added.
        weights: of the names that the same windows may mean.
        rivals: joint refits, the named one first.
        dispersion: of the model before.
        alarm: shift of the rival that ordinary drives do not show, where the named effect explains more and they show
            it more often; None where its own shift is the alarm.
    """

    shift: Shift
    weights: dict[str, float]
    rivals: tuple[Rival, ...]
    dispersion: float
    alarm: Shift | None = None


@dataclass(frozen=True, eq=False)
class Named:
    """Result of the naming.

    Attributes:
        models: from the one without effects to the last.
        steps: that led from each to the next.
        absent: limits and signs that stood out in a first step, and of which a refit found nothing.
        farther: of effects that were refitted for nothing, how many times as far as the first step the refit went.
    """

    models: tuple[Model, ...]
    steps: tuple[Step, ...]
    absent: frozenset[str] = frozenset()
    farther: Mapping[str, float] = field(default_factory=dict)

    @property
    def complete(self) -> bool:
        """Whether nothing else is out of the ordinary."""
        last = self.models[-1]
        conspicuous = [shift for shift in last.conspicuous if shift.compared.name not in self.absent]
        return not (last.pulled or last.rougher or conspicuous)


def name_changes(
    problem: Problem,
    fitted: Fitted,
    ordinary: Comparison,
    rng: np.random.Generator,
    progress: Callable[[str], None] = lambda line: None,
) -> Named:
    """Names of what changed.

    Args:
        problem: of the drive.
        fitted: without effects.
        ordinary: what the drive is compared with.
        rng: of resampled windows.
        progress: called with what is being done.
    """
    progress("comparing every effect with ordinary drives")
    models, steps, refitted = [model_of(problem, fitted, ordinary)], list[Step](), list[Refit]()
    while len(steps) < MOST_NAMES and (models[-1].conspicuous or models[-1].pulled or (not steps and models[-1].near)):
        dispersion = dispersion_of(models[-1].problem, models[-1].fitted)
        refitted = joint_refits(models[-1], ordinary, dispersion, progress)
        found = _next(models[-1], refitted, dispersion, ordinary, rng, progress)
        if found is None or not _is_share(found, models):
            break
        models.append(found[0])
        steps.append(found[1])
    if not steps:
        return Named(tuple(models), (), _absent(models[0]), _farther(models[0], refitted))
    return _without_idle(Named(tuple(models), tuple(steps)), ordinary, progress)


def _is_share(found: tuple[Model, Step], models: Sequence[Model]) -> bool:
    """Whether a name explains enough of what the names before it did and of what they leave of rough channels."""
    cost = models[-1].fitted.cost - found[0].fitted.cost
    return cost >= LEAST_SHARE * (models[0].fitted.cost - models[-1].fitted.cost + models[-1].excess)


def _absent(model: Model) -> frozenset[str]:
    """What is there or not and stood out, where no refit found it: its first step is that of a probe, not of a size."""
    refitted = model.conspicuous if len(model.conspicuous) <= MOST_RIVALS else ()
    return frozenset(shift.compared.name for shift in refitted if not shift.compared.candidate.has_sizes)


def _farther(model: Model, refitted: Sequence[Refit]) -> dict[str, float]:
    """By name of an effect that was refitted to see, how many times as far as its first step it went."""
    near = {shift.compared.name for shift in model.near}
    effects = {item.rival.name: (item.shift, item.rival.fitted.point.effects[-1]) for item in refitted}
    return {name: times_farther(*pair) for name, pair in effects.items() if name in near}


def _without_idle(named: Named, ordinary: Comparison, progress: Callable[[str], None]) -> Named:
    """The names that are needed beside those that came later: what took over from an effect that was missing goes."""
    for place in range(len(named.steps) - 1):
        shift = _evidence_after(named.models[-1], named.steps[place].shift, stretched=False, place=place)
        if shift is None or shift.probability < LEVEL:
            continue
        progress(f"comparing every effect without {shift.compared.name}")
        fewer = _without(named, place, ordinary)
        if fewer.models[-1].left <= NEARLY * max(1.0, named.models[-1].left):
            return _without_idle(fewer, ordinary, progress)
    return named


def _without(named: Named, place: int, ordinary: Comparison) -> Named:
    """The names without one of them, each of the later ones fitted anew."""
    models = list(named.models[: place + 1])
    for model in named.models[place + 2 :]:
        effects = model.fitted.point.effects
        point = replace(model.fitted.point, effects=(*effects[:place], *effects[place + 1 :]))
        fitted = fit_nominal(model.problem, point)
        kept = (*model.named[:place], *model.named[place + 1 :])
        models.append(model_of(model.problem, fitted, ordinary, kept))
    return Named(tuple(models), (*named.steps[:place], *named.steps[place + 1 :]))


def _next(
    model: Model,
    refitted: Sequence[Refit],
    dispersion: float,
    ordinary: Comparison,
    rng: np.random.Generator,
    progress: Callable[[str], None],
) -> tuple[Model, Step] | None:
    """The model with the next name; None where no effect that exists has the shift."""
    alarming, usual = _compared_beside(model, ordinary, refitted, progress)
    if not alarming:
        return None
    most = max(rival.gain for _, rival in alarming)
    alike = [item for item in usual if item[1].gain > CLOSE * most and item[0].left <= NEARLY]
    soil = _soil_alone(alarming, model)
    explaining = _explaining(alarming, model)
    kept = [*alike, *explaining, *(item for item in soil if item not in explaining)]
    kept.sort(key=lambda item: -item[1].gain)
    parts = {rival.name: model.parts_of(rival.name) for _, rival in kept}
    weights = equivalence_weights([rival for _, rival in kept], dispersion, rng, FORM_OF_GAIN, parts)
    for name in [rival.name for _, rival in soil] or _standing_out(alarming, model, weights):
        weights = _first(name, weights)
    weights = _dead_time_first(kept, _everywhere_first(kept, weights))
    name = max(weights, key=weights.__getitem__)
    chosen = next(item for item in kept if item[1].name == name)
    rivals = (chosen[1], *(rival for _, rival in kept if rival is not chosen[1]))
    larger = containing(model, *chosen, dispersion, {rival.name for rival in rivals})
    if larger is not None:
        rivals, weights = (*rivals, larger), beside(weights, name, larger.name)
    alarm = None if chosen in alarming else max(alarming, key=lambda item: item[1].gain)[0].named[-1]
    return chosen[0], Step(chosen[0].named[-1], weights, rivals, dispersion, alarm)


def _explaining(alarming: Sequence[Tried], model: Model) -> list[Tried]:
    """Refits beside which least is out of the ordinary; where something is beside each, also those that explain most.

    Where two things changed, one of them takes over much of the other in what is left, and little in what is explained.
    """
    least = min(after.left for after, _ in alarming)
    allowed = NEARLY * max(1.0, least)
    sure = [item for item in alarming if model.probability(item[0].named[-1]) < LEVEL]
    most = max((rival.gain for _, rival in sure), default=0.0)
    explaining = [item for item in sure if least > 1.0 and item[1].gain >= CLOSE * most]
    return [item for item in alarming if item[0].left <= allowed or item in explaining]


def _soil_alone(alarming: Sequence[Tried], model: Model) -> list[Tried]:
    """Another soil, where parameters of the soil gave the alarm and no effect is out of the ordinary by itself."""
    if any(model.probability(after.named[-1]) < LEVEL for after, _ in alarming):
        return []
    return [item for item in alarming if item[0].problem is not model.problem]


def _standing_out(alarming: Sequence[Tried], model: Model, weights: Mapping[str, float]) -> list[str]:
    """The heaviest name that is out of the ordinary by itself, where a heavier one is not: it comes first then.

    One that only takes back what parameters had to make up for may do so by its further sizes.
    """
    sure = [rival.name for after, rival in alarming if model.probability(after.named[-1]) < LEVEL]
    found = [name for name in sure if name in weights]
    heaviest = max(weights, key=lambda name: weights[name])
    unsure = heaviest in [rival.name for _, rival in alarming] and heaviest not in sure
    return [max(found, key=lambda name: weights[name])] if found and unsure else []


def _everywhere_first(kept: Sequence[Tried], weights: dict[str, float]) -> dict[str, float]:
    """A changed soil before a patch of it that explains hardly more: a place that covers all of a drive is the same."""
    gains = {rival.name: rival.gain for _, rival in kept}
    if not {SoilPatch.name, SoilChange.name} <= weights.keys():
        return weights
    alike = gains[SoilPatch.name] < gains[SoilChange.name] + LEAST_EVIDENCE
    ahead = weights[SoilPatch.name] == max(weights.values())
    return _first(SoilChange.name, weights) if alike and ahead else weights


def _dead_time_first(kept: Sequence[Tried], weights: dict[str, float]) -> dict[str, float]:
    """A dead time before a lag beside which no less is out of the ordinary, however much more the lag explains.

    No robot's lateness has the form of either. What a lag's further sizes explain beyond a dead time, they explain of
    ordinary drives too, unless something is out of the ordinary beside the dead time.
    """
    after = {rival.name: model for model, rival in kept}
    if not {MotorLag.name, CommandDelay.name} <= after.keys() or max(weights, key=weights.__getitem__) != MotorLag.name:
        return weights
    as_good = after[CommandDelay.name].left <= after[MotorLag.name].left
    return _first(CommandDelay.name, weights) if as_good else weights


def _is_late(rival: Rival) -> bool:
    """Whether it says by how much the wheels are late, in any form."""
    return same_lateness(rival.fitted.point.effects[-1]) is not None


def _first(name: str, weights: dict[str, float]) -> dict[str, float]:
    """Weights in which a name comes first and none weighs more."""
    raised = {name: max(weights.values()), **{other: weight for other, weight in weights.items() if other != name}}
    return {other: weight / sum(raised.values()) for other, weight in raised.items()}


def _compared_beside(
    model: Model,
    ordinary: Comparison,
    refitted: Sequence[Refit],
    progress: Callable[[str], None],
) -> tuple[list[Tried], list[Tried]]:
    """Models with refitted effects: those that are out of the ordinary among all, and those that are by themselves."""
    looks = 1 if model.conspicuous or model.pulled else 2
    alarming: list[Tried] = []
    usual: list[Tried] = []
    for item in refitted:
        shift, rival = item.shift, item.rival
        far = rival.gain < CLOSE * max((other.gain for after, other in alarming if after.left <= 1.0), default=0.0)
        another_form = _is_late(rival) and any(_is_late(other) for _, other in alarming)
        if far and item.problem is model.problem and not another_form:
            continue
        progress(f"comparing every effect beside {rival.name}")
        after = model_of(item.problem, rival.fitted, ordinary, (*model.named, shift))
        evidence = _evidence_after(after, shift, looks > 1)
        # what parameters had to make up for speaks for an effect that takes all of it back, or has no size of its own
        taken_back = bool(model.pulled) and (evidence is None or not after.pulled)
        # that ordinary drives scatter more as refits than as first steps guards the alarm; a rival follows one
        by_itself = (_evidence_after(after, shift, stretched=False) if evidence else None) or shift
        if taken_back or model.probability(evidence or shift, looks) < LEVEL:
            alarming.append((replace(after, named=(*model.named, evidence or shift)), rival))
        elif by_itself.probability < LEVEL:
            usual.append((replace(after, named=(*model.named, by_itself)), rival))
    return alarming, usual


def _evidence_after(model: Model, shift: Shift, stretched: bool, place: int = -1) -> Shift | None:
    """The shift of one effect of a model, by default the last, as its fit finds it; None where that has no size."""
    effects = model.fitted.point.effects
    keys = {
        item.field: f"{NAMED}{k}"
        for k, item in enumerate(effect_parameters(effects))
        if item.effect == place % len(effects) and f"{NAMED}{k}" in model.scan.keys
    }
    return refitted_shift(shift, effects[place], keys, model.scan.scores(), stretched)
