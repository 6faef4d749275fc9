"""Joint refits of what may have changed: which effects, from where they begin, and what is alike to the best of them.

Large changes are not linear. A refit begins at the best of several multiples of the first step; where parameters of
robot or ground have taken a change over, they are held to find it; and what the library calls alike to the best refit
begins where that one ended. Where a fit moved the soil farther than ordinary drives do, a changed soil is refitted with
all that tells soils apart, of which the effect has two sizes only. Where a changed soil explains about as much as any,
it is also refitted as one that changed in a place.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.change.drive_fit import ITERATIONS
from ddagr_gym.diagnosis.change.drive_scan import named_in, scan_drive
from ddagr_gym.diagnosis.change.model import MOST_NEAR, Model, farthest
from ddagr_gym.diagnosis.change.ordinary import Comparison, Scores
from ddagr_gym.diagnosis.change.shifts import Shift, shift_of
from ddagr_gym.diagnosis.change.sizes import explained, sizes_of
from ddagr_gym.diagnosis.change.soil_place import patch_of_change
from ddagr_gym.diagnosis.search.initial_guess import (
    first_guess,
    same_lateness,
    with_usual_shape,
    with_whole_lag,
)
from ddagr_gym.diagnosis.search.scan import drive_extent
from ddagr_gym.diagnosis.search.scanned_model import Rival
from ddagr_gym.identification.fit_numerics import FIELD_TOLERANCE
from ddagr_gym.identification.gauss_newton import Fitted, fit
from ddagr_gym.identification.parameters import KIND_STIFFNESS_DEVIATION, soil_parameters
from ddagr_gym.identification.problem import Point, Problem
from ddagr_gym.physics.effects.registry import effect_kinds
from ddagr_gym.physics.effects.soil_change import SoilChange
from ddagr_gym.physics.effects.soil_patch import SoilPatch

Array = NDArray[np.float64]

MOST_RIVALS = 4
"""Effects that are refitted at each step (ours): a refit with its scan costs a minute on a long drive."""

ALIKE = 0.6
"""Share of the largest gain, both to first order and beyond that in ordinary drives, from which an effect is refitted
beside what is out of the ordinary (ours: refits differ from first steps by a fifth)."""

LENGTHS = (1.0, 2.0, 4.0, 8.0)
"""Multiples of an effect's first step from the best of which its refit begins (ours): where losses are linear the first
step goes part of the way only, and delays that are far off cost the same whatever their size."""

RENEWALS = 4
"""Steps of a refit with new derivatives (ours): it may begin many deviations from where it ends."""

SIZES_OF_SOIL = ("soil_strength", "soil_stiffness")
"""Parameters of a soil that :class:`~ddagr_gym.physics.effects.soil_change.SoilChange` has sizes of."""

BIASES = ("gyro_bias", "accelerometer_bias")
"""Begin the names of what stays free where robot and ground are held."""

Starts = dict[str, tuple[Shift, Point]]
"""By name of an effect, its candidate and a point with it from which a refit begins."""


@dataclass(frozen=True, eq=False)
class Refit:
    """A joint refit of what may have changed.

    Attributes:
        problem: that was fitted.
        shift: of the effect before.
        rival: the refit.
    """

    problem: Problem
    shift: Shift
    rival: Rival


def joint_refits(model: Model, ordinary: Comparison, dispersion: float, progress: Callable[[str], None]) -> list[Refit]:
    """Joint refits of what may have changed, of what the best is confused with and of what explains alike, best first.

    Args:
        model: without what may have changed.
        ordinary: what the drive is compared with.
        dispersion: of the model.
        progress: called with what is being done.
    """
    problem = model.problem
    first = _refitted(problem, model, _starts(problem, model, ordinary), dispersion, progress)
    alike = _alike(problem, model, [rival for _, rival in first]) if first else {}
    again = _refitted(problem, model, alike, dispersion, progress)
    done = {rival.name for _, rival in (*first, *again)}
    others = [s for s in _explaining_alike(model, ordinary) if s.compared.name not in done] if first else []
    beside = _refitted(problem, model, _started(problem, model, model.fitted.point, others), dispersion, progress)
    found = [Refit(problem, *item) for item in (*first, *again, *beside)]
    found += _with_another_soil(model, dispersion, progress)
    found += _in_a_place(model, found, dispersion, progress)
    best: dict[str, Refit] = {}
    for item in sorted(found, key=lambda item: -item.rival.gain):
        best.setdefault(item.rival.name, item)
    return list(best.values())


def _explaining_alike(model: Model, ordinary: Comparison) -> list[Shift]:
    """Effects that explain, to first order, about as much as any beyond what they do of ordinary drives.

    What is not far enough out of the ordinary to be refitted by itself may still be what changed; nothing is asked
    where nothing is out of the ordinary.
    """
    if not (model.conspicuous or model.pulled):
        return []
    scores = model.scan.scores()
    own = named_in(scores.keys)
    before = [key for shift in model.named for key in shift.compared.keys]
    gains: list[tuple[float, Shift]] = []
    for shift in model.best:
        keys, ridge = shift.compared.keys, shift.compared.ridge
        usual = max((explained(drive, keys, ridge, before) for drive in ordinary.drives), default=0.0)
        gains.append((explained(scores, keys, ridge, own) - usual, shift))
    gains.sort(key=lambda item: -item[0])
    least = max(ALIKE * gains[0][0], 0.0) if gains else 0.0
    return [shift for gain, shift in gains if gain > least][:MOST_NEAR]


def _with_another_soil(model: Model, dispersion: float, progress: Callable[[str], None]) -> list[Refit]:
    """The refit of a changed soil that may be any of its kind; none where no fit moved the soil."""
    any_soil = {p.name: p.prior for p in soil_parameters(None, KIND_STIFFNESS_DEVIATION)}
    changed = next((shift for shift in model.best if shift.compared.name == SoilChange.name), None)
    if changed is None or not any(pull.name in any_soil for pull in model.pulled):
        return []
    wider = {name: prior for name, prior in any_soil.items() if name not in SIZES_OF_SOIL}
    problem, at = model.problem.expecting(wider), model.fitted.point
    values = [0.0 if p.name in any_soil else v for p, v in zip(problem.nuisances.parameters, at.values, strict=True)]
    start = _begun(problem, model, replace(at, values=np.array(values)), changed, changed.value + changed.mean)
    starts = {} if start is None else {SoilChange.name: (changed, start)}
    return [Refit(problem, *item) for item in _refitted(problem, model, starts, dispersion, progress)]


def _in_a_place(
    model: Model, found: Sequence[Refit], dispersion: float, progress: Callable[[str], None]
) -> list[Refit]:
    """The refit of a patch of soil where a changed soil explains about as much as any; its factors have that shift."""
    best = max((item.rival.gain for item in found), default=0.0)
    soils = [item for item in found if item.rival.name == SoilChange.name and item.rival.gain >= ALIKE * best]
    present = {effect.name for effect in model.fitted.point.effects}
    if not soils or SoilPatch.name in present:
        return []
    changed = max(soils, key=lambda item: item.rival.gain)
    at, patch = changed.rival.fitted.point, patch_of_change(model.fitted, changed.rival.fitted)
    if patch is None:
        return []
    # the soil beside a patch is that of the ground, whose parameters move no farther than between ordinary drives
    values = at.values if changed.problem is model.problem else model.fitted.point.values
    start = replace(at, values=values, effects=(*at.effects[:-1], patch))
    starts = {SoilPatch.name: (changed.shift, start)}
    refits = _refitted(model.problem, model, starts, dispersion, progress)
    return [Refit(model.problem, *item) for item in refits]


def _by_gain(found: Sequence[tuple[Shift, Rival]]) -> list[tuple[Shift, Rival]]:
    return sorted(found, key=lambda item: -item[1].gain)


def _refitted(
    problem: Problem, model: Model, starts: Starts, dispersion: float, progress: Callable[[str], None]
) -> list[tuple[Shift, Rival]]:
    """Refits that explain anything by an effect that matters, the best first."""
    found = []
    for name, (shift, start) in starts.items():
        progress(f"refitting with {name}")
        fitted = _to_the_end(problem, start, model.fitted.cost)
        gain = (model.fitted.cost - fitted.cost) / dispersion
        meaningful = fitted.point.effects[-1].is_meaningful(drive_extent(problem, fitted.prediction))
        if gain > 0.0 and meaningful:
            found.append((shift, Rival(name, fitted, gain)))
    return _by_gain(found)


def _to_the_end(problem: Problem, start: Point, before: float) -> Fitted:
    """The fit from a start, and from where it ends with the lag of motors whole or a load's usual hitch.

    Args:
        problem: to fit.
        start: where the fit begins.
        before: cost of the model without what may have changed.
    """
    fitted = _fit(problem, start)
    whole = with_whole_lag(problem, fitted.point)
    if whole is not None:
        return min(fitted, _fit(problem, whole), key=lambda item: item.cost)
    return with_usual_shape(fitted, before, partial(_fit, problem))


def _fit(problem: Problem, start: Point) -> Fitted:
    return fit(problem, start, iterations=ITERATIONS + 2, tolerance=FIELD_TOLERANCE, renewals=RENEWALS)


def _alike(problem: Problem, model: Model, refits: Sequence[Rival]) -> Starts:
    """What is confused with the best refit, from where that ended: fits differ in where parameters end."""
    best = refits[0].fitted.point
    beside = replace(best, effects=model.fitted.point.effects)
    known = {rival.name: rival.fitted.point.effects[-1] for rival in refits}
    alike = {shift.compared.name: shift for shift in _confused(refits[0].name, model)}
    new = _started(problem, model, beside, [shift for name, shift in alike.items() if name not in known])
    again = {
        name: (shift, replace(beside, effects=(*beside.effects, known[name])))
        for name, shift in alike.items()
        if name in known
    }
    translated = same_lateness(best.effects[-1])
    if translated is None or translated.name not in alike:
        return {**new, **again}
    late = (alike[translated.name], replace(beside, effects=(*beside.effects, translated)))
    return _nearest(problem, model, {**new, **again}, late)


def _nearest(problem: Problem, model: Model, starts: Starts, other: tuple[Shift, Point]) -> Starts:
    """Starts with another one for its effect, where that explains more as it stands."""
    name = other[0].compared.name
    points = [*([starts[name]] if name in starts else []), other]
    nearest = min(points, key=lambda item: fit(problem, item[1], iterations=0, reuse=model.fitted).cost)
    return {**starts, name: nearest}


def _confused(name: str, model: Model) -> list[Shift]:
    """Effects that the library says may be taken for one, the farthest shifts first."""
    kinds = effect_kinds()
    found = [
        shift
        for shift in model.best
        if shift.compared.name in kinds[name].confused_with or name in kinds[shift.compared.name].confused_with
    ]
    return sorted(found, key=lambda shift: -shift.distance / shift.limit(model.tests))[:MOST_NEAR]


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
    beside = named_in(scan.keys)
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
    own = named_in(scores.keys)
    before = [key for item in model.named for key in item.compared.keys]
    keys = shift.compared.keys
    others = [item.compared for item in model.best if item.compared.name != shift.compared.name]
    found = [shift_of(item, scores, ordinary, [*own, *keys], [*before, *keys]) for item in others]
    return farthest([item for item in found if item is not None], model.tests)
