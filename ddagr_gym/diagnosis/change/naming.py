"""Names for what changed: the effect beside which nothing else is out of the ordinary, one after the other.

An effect that is not the one that changed leaves shifts of others behind when it is fitted; the right one takes all of
them away. Of those that do, the joint refits decide, and what they do not tell apart stays an equivalence set.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.change.drive_fit import ITERATIONS, moved_parameters
from ddagr_gym.diagnosis.change.drive_scan import NAMED, DriveScan, scan_drive
from ddagr_gym.diagnosis.change.ordinary import Comparison, Scores
from ddagr_gym.diagnosis.change.shifts import (
    LEVEL,
    Pull,
    Shift,
    explained,
    family_probability,
    refitted_shift,
    shift_of,
    sizes_of,
)
from ddagr_gym.diagnosis.result.equivalence import equivalence_weights
from ddagr_gym.diagnosis.search.initial_guess import first_guess
from ddagr_gym.diagnosis.search.scan import drive_extent
from ddagr_gym.diagnosis.search.scanned_model import Rival
from ddagr_gym.identification.effect_parameters import effect_parameters
from ddagr_gym.identification.fit_numerics import FIELD_TOLERANCE
from ddagr_gym.identification.gauss_newton import Fitted, fit
from ddagr_gym.identification.misfit import dispersion_of
from ddagr_gym.identification.problem import Point, Problem
from ddagr_gym.physics.effects.registry import effect_kinds

Array = NDArray[np.float64]

MOST_NAMES = 3
"""Effects that may be named together: as in a diagnosis."""

MOST_RIVALS = 4
"""Effects that are refitted at each step (ours): a refit with its scan costs a minute on a long drive."""

NEAR = 0.4
"""Share of its limit at which an effect is refitted to see (ours): in a real drive poses that come half a second late
stand at 0.7 of it before the refit."""

MOST_NEAR = 3
"""Effects that are refitted to see (ours)."""

LENGTHS = (1.0, 2.0, 4.0, 8.0)
"""Multiples of an effect's first step from the best of which its refit begins (ours): where losses are linear the first
step goes part of the way only, and delays that are far off cost the same whatever their size."""

RENEWALS = 4
"""Steps of a refit with new derivatives (ours): it may begin many deviations from where it ends."""

FORM = 0.1
"""Share of a named effect by which the library's form of it is not the robot's (ours): deviation of its size, and
distance that a further effect needs, since the rest of it looks like other effects."""

CLOSE = 0.8
"""Share of the best refit's gain below which another is no rival of one that leaves nothing out of the ordinary (ours:
further than any weight of an equivalence set)."""

NEARLY = 1.1
"""Factor on what the best name leaves out of the ordinary up to which another leaves nearly as little (ours)."""


BIASES = ("gyro_bias", "accelerometer_bias")
"""Begin the names of what stays free where robot and ground are held."""


Starts = dict[str, tuple[Shift, Point]]
"""By name of an effect, its candidate and a point with it from which a refit begins."""


@dataclass(frozen=True, eq=False)
class Model:
    """A fit, and how far every effect that it lacks is from ordinary drives.

    Attributes:
        fitted: with or without effects.
        scan: of the library there.
        shifts: of all candidates, the least probable first.
        pulls: of all parameters that may differ between drives.
        named: candidates of the fit's effects, as they were shifted when each was added.
    """

    fitted: Fitted
    scan: DriveScan
    shifts: tuple[Shift, ...]
    pulls: tuple[Pull, ...]
    named: tuple[Shift, ...] = ()

    @property
    def tests(self) -> int:
        """Number of candidates and parameters."""
        return len(self.shifts) + len(self.pulls)

    def probability(self, shift: Shift | Pull, looks: int = 1) -> float:
        """Of an ordinary drive to show as much in any candidate or parameter, each looked at so many times."""
        return family_probability(shift.probability, looks * self.tests)

    @property
    def best(self) -> tuple[Shift, ...]:
        """The least probable candidate of each effect, in their order."""
        found: dict[str, Shift] = {}
        for shift in self.shifts:
            found.setdefault(shift.compared.name, shift)
        return tuple(found.values())

    @property
    def conspicuous(self) -> tuple[Shift, ...]:
        """Those of :attr:`best` that ordinary drives hardly show."""
        least = FORM * max((shift.distance for shift in self.named), default=0.0)
        return tuple(s for s in self.best if self.probability(s) < LEVEL and s.distance > least)

    @property
    def near(self) -> tuple[Shift, ...]:
        """Those of :attr:`best` that are worth a refit: what is large a first step finds only in part."""
        listed = sorted(self.best, key=lambda s: -s.distance / s.limit(self.tests))
        return tuple(s for s in listed[:MOST_NEAR] if s.probability < 1.0 and s.distance > NEAR * s.limit(self.tests))

    @property
    def pulled(self) -> tuple[Pull, ...]:
        """Parameters that ordinary drives hardly move as far."""
        return tuple(pull for pull in self.pulls if self.probability(pull) < LEVEL)

    @property
    def left(self) -> float:
        """Largest distance over its limit of any effect or parameter."""
        parameters = (pull.distance / pull.limit(self.tests) for pull in self.pulls)
        return max(_farthest(self.best, self.tests), max(parameters, default=0.0))


@dataclass(frozen=True, eq=False)
class Step:
    """One name with what else it could be.

    Attributes:
        shift: of the named effect when it was added.
        weights: of the names that the same windows may mean.
        rivals: joint refits, the named one first.
        dispersion: of the model before.
    """

    shift: Shift
    weights: dict[str, float]
    rivals: tuple[Rival, ...]
    dispersion: float


@dataclass(frozen=True, eq=False)
class Named:
    """Result of the naming.

    Attributes:
        models: from the one without effects to the last.
        steps: that led from each to the next.
    """

    models: tuple[Model, ...]
    steps: tuple[Step, ...]


def model_of(problem: Problem, fitted: Fitted, ordinary: Comparison, named: Sequence[Shift] = ()) -> Model:
    """Scan a fit and compare it with ordinary drives.

    Args:
        problem: of the drive.
        fitted: to it.
        ordinary: what the drive is compared with.
        named: candidates of the fit's effects.
    """
    scan = scan_drive(problem, fitted)
    scores = scan.scores()
    beside = [key for key in scan.keys if key.startswith(NAMED)]
    in_ordinary = [key for shift in named for key in shift.compared.keys]
    compared = [item for item in scan.compared if item.name not in ordinary.unnamed]
    found = [shift_of(item, scores, ordinary, beside, in_ordinary) for item in compared]
    shifts = sorted((item for item in found if item is not None), key=lambda item: (item.probability, -item.distance))
    pulls = tuple(
        Pull(name, moved / ordinary.usual_move(name), ordinary.degrees)
        for name, moved in moved_parameters(problem, fitted).items()
    )
    return Model(fitted, scan, tuple(shifts), pulls, tuple(named))


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
    models, steps = [model_of(problem, fitted, ordinary)], list[Step]()
    while len(steps) < MOST_NAMES and (models[-1].conspicuous or models[-1].pulled or (not steps and models[-1].near)):
        found = _next(problem, models[-1], ordinary, rng, progress)
        if found is None:
            break
        models.append(found[0])
        steps.append(found[1])
    return Named(tuple(models), tuple(steps))


def _next(
    problem: Problem,
    model: Model,
    ordinary: Comparison,
    rng: np.random.Generator,
    progress: Callable[[str], None],
) -> tuple[Model, Step] | None:
    """The model with the next name; None where no effect that exists has the shift."""
    dispersion = dispersion_of(problem, model.fitted)
    looks = 1 if model.conspicuous or model.pulled else 2
    refitted = _refits(problem, model, ordinary, dispersion, progress)
    tried: list[tuple[Model, Rival]] = []
    for shift, rival in refitted:
        if rival.gain < CLOSE * max((item.gain for after, item in tried if after.left <= 1.0), default=0.0):
            break
        progress(f"comparing every effect beside {rival.name}")
        after = model_of(problem, rival.fitted, ordinary, (*model.named, shift))
        evidence = _evidence_after(after, shift, looks > 1)
        # what parameters had to make up for speaks for an effect that takes all of it back, or has no size of its own
        taken_back = bool(model.pulled) and (evidence is None or not after.pulled)
        if taken_back or model.probability(evidence or shift, looks) < LEVEL:
            tried.append((replace(after, named=(*model.named, evidence or shift)), rival))
    if not tried:
        return None
    allowed = max(1.0, NEARLY * min(after.left for after, _ in tried))
    kept = [item for item in tried if item[0].left <= allowed]
    weights = equivalence_weights([rival for _, rival in kept], dispersion, rng)
    name = max(weights, key=weights.__getitem__)
    chosen = next(item for item in kept if item[1].name == name)
    rivals = (chosen[1], *(rival for _, rival in kept if rival is not chosen[1]))
    return chosen[0], Step(chosen[0].named[-1], weights, rivals, dispersion)


def _refits(
    problem: Problem, model: Model, ordinary: Comparison, dispersion: float, progress: Callable[[str], None]
) -> list[tuple[Shift, Rival]]:
    """Joint refits of what may have changed, and of what the best of them is confused with, the best first."""

    def refitted(starts: Starts) -> list[tuple[Shift, Rival]]:
        found = []
        for shift, start in starts.values():
            progress(f"refitting with {shift.compared.name}")
            fitted = fit(problem, start, iterations=ITERATIONS + 2, tolerance=FIELD_TOLERANCE, renewals=RENEWALS)
            gain = (model.fitted.cost - fitted.cost) / dispersion
            meaningful = fitted.point.effects[-1].is_meaningful(drive_extent(problem, fitted.prediction))
            if gain > 0.0 and meaningful:
                found.append((shift, Rival(shift.compared.name, fitted, gain)))
        return sorted(found, key=lambda item: -item[1].gain)

    first = refitted(_starts(problem, model, ordinary))
    if not first:
        return []
    # fits end at different places in the parameters that they share: what is alike begins where the best one ended
    beside = replace(first[0][1].fitted.point, effects=model.fitted.point.effects)
    known = {rival.name: rival.fitted.point.effects[-1] for _, rival in first}
    alike = _confused(first[0][1].name, model)
    new = _started(problem, model, beside, [shift for shift in alike if shift.compared.name not in known])
    again = {
        name: (shift, replace(beside, effects=(*beside.effects, known[name])))
        for name, shift in ((shift.compared.name, shift) for shift in alike)
        if name in known
    }
    best: dict[str, tuple[Shift, Rival]] = {}
    for item in sorted([*first, *refitted({**new, **again})], key=lambda item: -item[1].gain):
        best.setdefault(item[1].name, item)
    return list(best.values())


def _confused(name: str, model: Model) -> list[Shift]:
    """Effects that the library says may be taken for one, the farthest shifts first."""
    kinds = effect_kinds()
    found = [
        shift
        for shift in model.best
        if shift.compared.name in kinds[name].confused_with or name in kinds[shift.compared.name].confused_with
    ]
    return sorted(found, key=lambda shift: -shift.distance / shift.limit(model.tests))[:MOST_NEAR]


def _evidence_after(model: Model, shift: Shift, stretched: bool) -> Shift | None:
    """The shift of the last effect of a model as its fit finds it; None where the fit has no size of it."""
    effects = model.fitted.point.effects
    keys = {
        item.field: f"{NAMED}{k}"
        for k, item in enumerate(effect_parameters(effects))
        if item.effect == len(effects) - 1 and f"{NAMED}{k}" in model.scan.keys
    }
    return refitted_shift(shift, effects[-1], keys, model.scan.scores(), stretched)


def _starts(problem: Problem, model: Model, ordinary: Comparison) -> Starts:
    """Effects that may be what changed, by name."""
    found: Starts = {}
    at = model.fitted.point
    moved = [pull for pull in model.pulled if not pull.name.startswith(BIASES)]
    if moved or not (model.conspicuous or model.near):
        at, found = _where_parameters_stay(problem, model)
    others = [shift for shift in _preselected(model, ordinary) if shift.compared.name not in found]
    return {**found, **_started(problem, model, at, others)}


def _started(problem: Problem, model: Model, at: Point, shifts: Sequence[Shift]) -> Starts:
    """Points with one effect each, at the sizes that its first step says."""
    return _existing({s.compared.name: (s, _begun(problem, model, at, s, s.value + s.mean)) for s in shifts})


def _existing(points: Mapping[str, tuple[Shift, Point | None]]) -> Starts:
    return {name: (shift, point) for name, (shift, point) in points.items() if point is not None}


def _begun(problem: Problem, model: Model, at: Point, shift: Shift, multiples: Array) -> Point | None:
    """The point with an effect at the best length of a first step; None for a step that is none."""
    guesses = dict.fromkeys(first_guess(shift.compared.candidate, (far * multiples).tolist()) for far in LENGTHS)
    points = [replace(at, effects=(*at.effects, effect)) for effect in guesses if not effect.is_neutral]
    if len(points) < 2:
        return points[0] if points else None
    return min(points, key=lambda point: fit(problem, point, iterations=0, reuse=model.fitted).cost)


def _where_parameters_stay(problem: Problem, model: Model) -> tuple[Point, Starts]:
    """Effects that explain most where robot and ground stay as they were calibrated, and the point where they do.

    What a parameter has taken over, to first order no effect asks back: their columns are alike, but for what is
    nonlinear in them.
    """
    own = np.array([not p.name.startswith(BIASES) for p in problem.nuisances.parameters])
    held = problem.holding(own)
    point = replace(model.fitted.point, values=np.where(own, 0.0, model.fitted.point.values))
    fitted = fit(held, point, iterations=ITERATIONS, tolerance=FIELD_TOLERANCE, renewals=2)
    scan = scan_drive(held, fitted)
    scores = scan.scores()
    beside = [key for key in scan.keys if key.startswith(NAMED)]
    shifts = {shift.compared.keys: shift for shift in model.shifts}
    # a step goes three deviations at most, and what has been taken over may be many
    calibrated = replace(fitted.point, values=np.zeros(len(own)))
    found: dict[str, tuple[float, Shift, Array]] = {}
    for item in scan.compared:
        sizes = sizes_of(scores, item.keys, item.ridge, beside)
        if sizes is None or item.keys not in shifts or first_guess(item.candidate, sizes.value.tolist()).is_neutral:
            continue
        gain = explained(scores, item.keys, item.ridge, beside)
        if gain > found.get(item.name, (0.0,))[0]:
            found[item.name] = (gain, shifts[item.keys], sizes.value)
    best = sorted(found.values(), key=lambda item: -item[0])[:MOST_RIVALS]
    points = {s.compared.name: (s, _begun(problem, model, calibrated, s, value)) for _, s, value in best}
    return calibrated, _existing(points)


def _preselected(model: Model, ordinary: Comparison) -> list[Shift]:
    """The effects beside which, to first order, least is out of the ordinary."""
    scores = model.scan.scores()
    listed = sorted(model.conspicuous or model.near, key=lambda shift: _left_beside(shift, model, scores, ordinary))
    return listed[:MOST_RIVALS]


def _left_beside(shift: Shift, model: Model, scores: Scores, ordinary: Comparison) -> float:
    """Largest distance over its limit of any other effect beside one, to first order."""
    own = [key for key in scores.keys if key.startswith(NAMED)]
    before = [key for item in model.named for key in item.compared.keys]
    keys = shift.compared.keys
    others = [item.compared for item in model.best if item.compared.name != shift.compared.name]
    found = [shift_of(item, scores, ordinary, [*own, *keys], [*before, *keys]) for item in others]
    return _farthest([item for item in found if item is not None], model.tests)


def _farthest(shifts: Sequence[Shift], tests: int) -> float:
    return max((s.distance / s.limit(tests) for s in shifts if s.probability < 1.0), default=0.0)
