"""Certification: what the named effects are worth on drives that their sizes were not fitted to.

Every recording is forecast by models whose sizes and nuisances were fitted to the others; a single recording by its
halves. The start of a forecast comes from the readings before it (:mod:`ddagr_gym.diagnosis.forecast`); biases of a
recording that a fit has not seen stand at their prior, zero. *Which* effects are in the model was decided on all drives.

Compared are the raw nominal simulator, the refitted one, the corrected one, a *black box* (a flexible residual model on
top of the refitted one) and the *ceiling*: the best of these and of a flexible model on top of the corrected one, per
quantity. The ceiling says how much of the error anything could have explained from these readings; it is chosen on the
drives that judge, which makes the share that the named effects reach of it rather too small than too large.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.forecast import (
    MOTION,
    PAST,
    UNITS,
    Forecasts,
    cut_forecasts,
    errors_at,
    past_elimination,
    roll_out,
    start_states,
)
from ddagr_gym.diagnosis.problem import Elimination, Point, Problem
from ddagr_gym.diagnosis.refit import Fitted, fit
from ddagr_gym.diagnosis.residual_model import Rollout, corrected, fit_residual_model
from ddagr_gym.diagnosis.uncertainty import LEVEL
from ddagr_gym.parameters import Robot
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.replay.windows import CHANNELS

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Errors = dict[str, dict[str, Array]]

HORIZONS = (1.0, 5.0, 30.0)
"""[s], diagnosis.md, step 10."""

MODELS = ("raw", "refitted", "corrected", "black_box", "ceiling")

STRIDE = 2.0
"""Between the starts of short forecasts [s]; those of the longest are 5 s apart."""

CLUSTER = 10.0
"""Time within which errors count as one when intervals are resampled [s], or the horizon where it is longer."""

DRAWS = 500

LEAST_EXPLAINABLE = 0.03
"""Share of the refitted error that the ceiling must explain before a share of it means anything (ours)."""

BY_RECORDING, BY_TIME = "by recording", "by time"


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


def folds_of(problem: Problem) -> tuple[str, list[Fold]]:
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


def refitted_on(problem: Problem, fitted: Fitted, fold: Fold, iterations: int = 2) -> Point:
    """Nuisances and sizes from the fold's training windows, by steps from the fit to all of them.

    Args:
        problem: of all windows.
        fitted: to all of them; its sensitivities are kept.
        fold: what may be seen.
        iterations: Gauss-Newton steps.
    """
    chosen = fold.training
    values = fitted.point.values.copy()
    for k, parameter in enumerate(problem.nuisances.parameters):
        if parameter.recording in fold.unseen:
            values[k] = 0.0
    start = Point(values, fitted.point.states[chosen], fitted.point.effects)
    reuse = replace(
        fitted,
        prediction=fitted.prediction[chosen],
        by_parameter=fitted.by_parameter[chosen],
        elimination=fitted.elimination.subset(chosen),
        window_cost=fitted.window_cost[chosen],
    )
    return fit(problem.subset(chosen), start, iterations=iterations, renewals=1, reuse=reuse).point


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


def certify(
    problem: Problem,
    nominal: Fitted,
    chosen: Fitted,
    robot: Robot,
    recordings: Sequence[Recording],
    rng: np.random.Generator,
    progress: Callable[[str], None] = lambda text: None,
) -> dict[str, Any]:
    """Errors of the models at the horizons, as they stand under ``fit`` in ``diagnosis.json``.

    Args:
        problem: of all windows.
        nominal: the refitted nominal model.
        chosen: the model with the named effects; the nominal one where there are none.
        robot: nominal.
        recordings: as the problem has them.
        rng: of the resampling and the forest.
        progress: called with each step.
    """
    rule, folds = folds_of(problem)
    progress("certification: sizes from the other drives")
    arms = _arms(problem, nominal, chosen, folds)
    sets = _forecast_sets(problem, robot, recordings)
    found: dict[float, Errors] = {}
    clusters: dict[float, NDArray[np.int64]] = {}
    for forecasts, horizons in sets:
        longest = f"{forecasts.future.duration:.3g} s"
        progress(f"certification: forecasts of {longest}")
        errors, kept = _errors(forecasts, arms, folds, horizons, sets[0][0], int(rng.integers(2**31)))
        for horizon in horizons:
            if kept.any():
                found[horizon] = errors[horizon]
                clusters[horizon] = _clusters(forecasts.subset(kept), horizon)
    return _report(rule, found, clusters, rng)


def _arms(problem: Problem, nominal: Fitted, chosen: Fitted, folds: Sequence[Fold]) -> list[Arm]:
    raw = tuple(problem.start() for _ in folds)
    refitted = tuple(refitted_on(problem, nominal, fold) for fold in folds)
    arms = [Arm("raw", raw), Arm("refitted", refitted, "black_box")]
    if chosen.point.effects:
        better = tuple(refitted_on(problem, chosen, fold) for fold in folds)
        arms.append(Arm("corrected", better, "flexible"))
    return arms


def _forecast_sets(
    problem: Problem, robot: Robot, recordings: Sequence[Recording]
) -> list[tuple[Forecasts, tuple[float, ...]]]:
    """Forecasts that serve several horizons: short ones often, the longest seldom; those that fit into the drives."""
    short = cut_forecasts(problem, robot, recordings, HORIZONS[1], STRIDE)
    served: list[tuple[Forecasts, tuple[float, ...]]] = []
    if short is None:
        short = cut_forecasts(problem, robot, recordings, HORIZONS[0], STRIDE)
        return served if short is None else [(short, HORIZONS[:1])]
    served.append((short, HORIZONS[:2]))
    long = cut_forecasts(problem, robot, recordings, HORIZONS[2], 2.5 * STRIDE, most=60)
    return served if long is None else [*served, (long, HORIZONS[2:])]


def _errors(
    forecasts: Forecasts,
    arms: Sequence[Arm],
    folds: Sequence[Fold],
    horizons: Sequence[float],
    training: Forecasts,
    seed: int,
) -> tuple[dict[float, Errors], Flags]:
    """Errors (K,) by horizon, model and quantity, and which of the forecasts (W,) were judged."""
    judged = np.any([fold.judges(forecasts) for fold in folds], axis=0)
    parts: dict[float, dict[str, dict[str, Array]]] = {h: {} for h in horizons}
    for arm in arms:
        own = past_elimination(forecasts, arm.points[0])
        seen = own if training is forecasts or not arm.learnt else past_elimination(training, arm.points[0])
        for fold, point in zip(folds, arm.points, strict=True):
            chosen = fold.judges(forecasts)
            if not chosen.any():
                continue
            rollout = _rolled(forecasts, point, own, chosen)
            made = {arm.name: rollout.readings}
            if arm.learnt:
                shown = fold.trains(training)
                model = None
                if shown.any():
                    model = fit_residual_model(_rolled(training, point, seen, shown), STRIDE, seed)
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


def _put(errors: dict[str, dict[str, Array]], model: str, chosen: Flags, values: Mapping[str, Array]) -> None:
    for name, value in values.items():
        whole = errors.setdefault(model, {}).setdefault(name, np.full(len(chosen), np.nan))
        whole[chosen] = value


def _clusters(forecasts: Forecasts, horizon: float) -> NDArray[np.int64]:
    """(W,) forecasts that start close together share a number."""
    length = max(CLUSTER, horizon)
    keys = np.stack([forecasts.future.recording, np.floor(forecasts.future.time / length).astype(np.int64)], axis=1)
    return np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1).astype(np.int64)


def _report(
    rule: str, found: Mapping[float, Errors], clusters: Mapping[float, NDArray[np.int64]], rng: np.random.Generator
) -> dict[str, Any]:
    channels: dict[str, dict[str, Any]] = {}
    shares: dict[str, dict[str, Any]] = {"gain_share": {}, "gain_share_readings": {}}
    for horizon, errors in found.items():
        key = f"{horizon:g}"
        table = _resampled(errors, clusters[horizon], rng)
        for quantity in UNITS:
            if quantity in table["refitted"]:
                channels.setdefault(quantity, {})[key] = _entry(table, quantity, errors)
        shares["gain_share"][key] = gain_share(table, MOTION)
        shares["gain_share_readings"][key] = gain_share(table, CHANNELS)
    return {
        "folds": rule,
        "note": _note(rule, found),
        "horizons": list(HORIZONS),
        "level": LEVEL,
        "channels": channels,
        **shares,
    }


def _note(rule: str, found: Mapping[float, Errors]) -> str:
    parts = ["Which effects are in the model was decided on all drives; their sizes and the nominal model's were not."]
    if rule == BY_TIME:
        parts.append(
            "There is one recording: its halves judge each other, so that its place, its sensors' biases and its day "
            "are not new to the model that is judged."
        )
    missing = [f"{h:g} s" for h in HORIZONS if h not in found]
    if missing:
        parts.append(f"No drive is long enough for {' and '.join(missing)}.")
    return " ".join(parts)


Table = dict[str, dict[str, Array]]


def _resampled(errors: Errors, clusters: NDArray[np.int64], rng: np.random.Generator) -> Table:
    """Root mean squares (1 + DRAWS,) by model and quantity, the first of all windows, the others of drawn clusters.

    The ceiling is the least of all but the raw one, in every draw.
    """
    count = int(clusters.max()) + 1
    drawn = rng.integers(count, size=(DRAWS, count))
    times = np.stack([np.bincount(row, minlength=count) for row in drawn]).astype(float)
    times = np.concatenate([np.ones((1, count)), times]) if count > 1 else np.ones((1, count))
    table: Table = {}
    for model, by_quantity in errors.items():
        table[model] = {}
        for quantity, values in by_quantity.items():
            known = np.isfinite(values)
            if not known.any():
                continue
            squares = np.bincount(clusters[known], values[known] ** 2, minlength=count)
            number = np.bincount(clusters[known], minlength=count)
            with np.errstate(invalid="ignore", divide="ignore"):
                table[model][quantity] = np.sqrt((times @ squares) / (times @ number))
    table.setdefault("corrected", table["refitted"])
    rivals = [table[name] for name in ("refitted", "corrected", "black_box", "flexible") if name in table]
    table["ceiling"] = {q: np.min([rival[q] for rival in rivals], axis=0) for q in table["refitted"]}
    return table


def _entry(table: Table, quantity: str, errors: Errors) -> dict[str, Any]:
    entry: dict[str, Any] = {name: _estimate(table[name][quantity]) for name in MODELS}
    count = int(np.isfinite(errors["refitted"][quantity]).sum())
    return entry | {"unit": UNITS[quantity], "count": count}


def _estimate(values: Array) -> dict[str, Any]:
    """The first value, and the interval of the others."""
    rest = values[1:][np.isfinite(values[1:])]
    if rest.size < DRAWS // 2:
        return {"value": float(values[0]), "interval": None}
    tail = 0.5 * (1.0 - LEVEL)
    low, high = np.quantile(rest, [tail, 1.0 - tail])
    return {"value": float(values[0]), "interval": [float(low), float(high)]}


def gain_share(table: Table, quantities: Sequence[str]) -> dict[str, Any] | None:
    """Share of what the ceiling gains over the refitted nominal model that the named effects gain.

    Every quantity counts by its error over that of the refitted model. None where not even the ceiling gains
    :data:`LEAST_EXPLAINABLE`.
    """
    names = [name for name in quantities if name in table["refitted"] and table["refitted"][name][0] > 0.0]
    if not names:
        return None
    base = np.stack([table["refitted"][name] for name in names])

    def gained(model: str) -> Array:
        return np.asarray(1.0 - np.mean(np.stack([table[model][name] for name in names]) / base, axis=0))

    reachable, reached = gained("ceiling"), gained("corrected")
    if reachable[0] < LEAST_EXPLAINABLE:
        return None
    sound = reachable > 0.5 * LEAST_EXPLAINABLE
    sound[0] = True
    return _estimate(np.where(sound, reached / np.where(sound, reachable, 1.0), np.nan))
