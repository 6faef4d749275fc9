"""A certificate from errors of predictions: root mean squares, intervals, and shares of the ceiling."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.certificate import Certificate, Folds, Gains, Measured, ModelErrors
from ddagr_gym.diagnosis.certification.forecast import MOTION, UNITS
from ddagr_gym.diagnosis.result.uncertainty import LEVEL
from ddagr_gym.diagnosis.wording import in_sentence
from ddagr_gym.identification.windows import CHANNELS

Array = NDArray[np.float64]
Errors = dict[str, dict[str, Array]]
"""(K,) by model and quantity."""

HORIZONS = (1.0, 5.0, 30.0)
"""Of the predictions [s]: a turn of a wheel, a turn at the headland, a row (theory: diagnosis, section 9)."""

MODELS = ("raw", "refitted", "corrected", "black_box", "ceiling")

BY_RECORDING: Folds = "by recording"
BY_TIME: Folds = "by time"

DRAWS = 500
"""Resamplings: the ends of a 90 % interval scatter by a tenth of its width then (ours)."""

LEAST_EXPLAINABLE = 0.03
"""Share of the refitted error that the ceiling must explain before a share of it means anything (ours)."""


def certificate(
    rule: Folds,
    found: Mapping[float, Errors],
    clusters: Mapping[float, NDArray[np.int64]],
    rng: np.random.Generator,
    kept: Sequence[str] = (),
) -> Certificate:
    """Errors of all models with their intervals.

    Args:
        rule: BY_RECORDING or BY_TIME.
        found: errors by horizon, model and quantity.
        clusters: of the predictions, by horizon.
        rng: of the resampling.
        kept: effects whose sizes are those of the fit to all drives somewhere, because the other drives lack them.
    """
    channels: dict[str, dict[str, ModelErrors]] = {}
    gain: dict[str, dict[str, Gains | None]] = {"": {}, "_readings": {}}
    share: dict[str, dict[str, Measured | None]] = {"": {}, "_readings": {}}
    lost = 0
    for horizon, every in found.items():
        key = f"{horizon:g}"
        errors, unfinished = finished(every)
        lost += unfinished
        table = resampled(errors, clusters[horizon], rng)
        for quantity in UNITS:
            if quantity in table["refitted"]:
                channels.setdefault(quantity, {})[key] = _model_errors(table, quantity, errors)
        for quantities, ending in ((MOTION, ""), (CHANNELS, "_readings")):
            gained = gains(table, quantities)
            measured = {model: _measured(values) for model, values in gained.items()}
            gain[ending][key] = Gains(**measured) if measured else None
            share[ending][key] = gain_share(gained)
    return Certificate(
        folds=rule,
        note=_note(rule, found, lost, kept),
        horizons=HORIZONS,
        level=LEVEL,
        channels=channels,
        gain=gain[""],
        gain_readings=gain["_readings"],
        gain_share=share[""],
        gain_share_readings=share["_readings"],
    )


def finished(errors: Errors) -> tuple[Errors, int]:
    """Errors without the predictions that some model did not finish, and how many (at most of a quantity) these are."""
    known = {q: [np.isfinite(by_quantity[q]) for by_quantity in errors.values()] for q in errors["refitted"]}
    every = {q: np.all(flags, axis=0) for q, flags in known.items()}
    lost = max(int((np.any(flags, axis=0) & ~every[q]).sum()) for q, flags in known.items())
    return {m: {q: np.where(every[q], v, np.nan) for q, v in e.items()} for m, e in errors.items()}, lost


def _note(rule: Folds, found: Mapping[float, Errors], lost: int, kept: Sequence[str]) -> str:
    parts = ["Which effects are in the model was decided on all drives; their sizes and the nominal model's were not."]
    if rule == BY_TIME:
        parts.append(
            "There is one recording: its halves judge each other, so that its place, its sensors' biases and its day "
            "are not new to the model that is judged."
        )
    if kept:
        names = " and ".join(in_sentence(name) for name in kept)
        parts.append(
            f"A part of the drives is judged by models that were fitted to what lacks {names}: its size is there "
            "that of the fit to all drives."
        )
    missing = [f"{h:g} s" for h in HORIZONS if h not in found]
    if missing:
        parts.append(f"No drive is long enough for {' and '.join(missing)}.")
    if lost:
        parts.append(f"{lost} predictions that a model did not bring to an end are left out of all.")
    return " ".join(parts)


Table = dict[str, dict[str, Array]]


def resampled(errors: Errors, clusters: NDArray[np.int64], rng: np.random.Generator) -> Table:
    """Root mean squares (1 + DRAWS,) by model and quantity, the first of all windows, the others of drawn clusters.

    With few clusters draws scatter too little; they are spread until normal means would keep their level
    (:func:`_widened`). The ceiling is the one of all but the raw one that is best over all windows, for each quantity.
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
                table[model][quantity] = _widened(np.sqrt((times @ squares) / (times @ number)), count)
    table.setdefault("corrected", table["refitted"])
    rivals = [table[name] for name in ("refitted", "corrected", "black_box", "flexible") if name in table]
    table["ceiling"] = {q: min((rival[q] for rival in rivals), key=lambda row: row[0]) for q in table["refitted"]}
    return table


def _widened(draws: Array, clusters: int) -> Array:
    """Resampled values (1 + DRAWS,) with the scatter that so few clusters ask for, in proportion to the first.

    By Student's quantile over the normal one, and the root of n/(n - 1) by which resampling underrates a variance
    (T. Hesterberg, 2015, on percentile intervals of small samples): 2.2 times with three clusters, 1.1 with fifteen.
    Of 90 % intervals of lognormal errors 80 % hold the truth instead of 57 % with three, 88 instead of 83 with fifteen.
    """
    from scipy.stats import norm
    from scipy.stats import t as student

    if clusters < 2 or not draws[0] > 0.0:
        return draws
    quantile = 0.5 * (1.0 + LEVEL)
    wider = student.ppf(quantile, clusters - 1) / norm.ppf(quantile) * np.sqrt(clusters / (clusters - 1))
    return np.asarray(draws[0] * (draws / draws[0]) ** wider)


def _model_errors(table: Table, quantity: str, errors: Errors) -> ModelErrors:
    count = int(np.isfinite(errors["refitted"][quantity]).sum())
    measured = {name: _measured(table[name][quantity]) for name in MODELS}
    return ModelErrors(**measured, unit=UNITS[quantity], count=count)


def _measured(values: Array) -> Measured:
    """The first value, and the interval of the others."""
    rest = values[1:][np.isfinite(values[1:])]
    if rest.size < DRAWS // 2:
        return Measured(float(values[0]))
    tail = 0.5 * (1.0 - LEVEL)
    low, high = np.quantile(rest, [tail, 1.0 - tail])
    return Measured(float(values[0]), (float(low), float(high)))


def gains(table: Table, quantities: Sequence[str]) -> dict[str, Array]:
    """(1 + DRAWS,) share of the refitted model's error that a model saves, by model, as a mean over quantities.

    Theory: diagnosis, eq. (12).

    Every quantity counts by its error over that of the refitted model. Empty where none of them was measured.
    """
    names = [name for name in quantities if name in table["refitted"] and table["refitted"][name][0] > 0.0]
    if not names:
        return {}
    base = np.stack([table["refitted"][name] for name in names])

    def saved(model: str) -> Array:
        return np.asarray(1.0 - np.mean(np.stack([table[model][name] for name in names]) / base, axis=0))

    return {model: saved(model) for model in ("corrected", "black_box", "ceiling") if model in table}


def gain_share(gained: Mapping[str, Array]) -> Measured | None:
    """Share of what the ceiling gains over the refitted nominal model that the named effects gain.

    None where not even the ceiling gains :data:`LEAST_EXPLAINABLE`, or where its gain has no interval, as with a
    single cluster of forecasts, or one that holds nothing: a share of what may be nothing is no number. No drawing
    counts more than all of the ceiling, which is chosen over all windows.

    Args:
        gained: of :func:`gains`.
    """
    if not gained or gained["ceiling"][0] < LEAST_EXPLAINABLE:
        return None
    ceiling = _measured(gained["ceiling"]).interval
    if ceiling is None or ceiling[0] <= 0.0:
        return None
    sound = gained["ceiling"] > 0.5 * LEAST_EXPLAINABLE
    share = np.minimum(gained["corrected"] / np.where(sound, gained["ceiling"], 1.0), 1.0)
    return _measured(np.where(sound, share, np.nan))


def of_mended_readings(fit: Certificate, named: bool) -> Certificate:
    """A certificate of readings that were mended before any model saw them.

    Args:
        fit: of the mended readings.
        named: whether effects besides those that were mended are in the corrected model. Without any its share of what
            could be explained would be nothing, which says nothing about what was mended.
    """
    note = (
        f"{fit.note} Faults that show in the values themselves (repeats, a reversed gyro) are mended before any "
        "model is fitted: these errors say nothing about them."
    )
    if named:
        return replace(fit, note=note)
    none = dict.fromkeys(fit.gain_share), dict.fromkeys(fit.gain_share_readings)
    return replace(fit, note=note, gain_share=none[0], gain_share_readings=none[1])


@dataclass(frozen=True)
class Worse:
    """That drives which nothing was fitted to are certainly predicted worse.

    Attributes:
        horizon: of the predictions [s].
        value: change of their error over that of the refitted nominal model, negative.
        interval: of it.
    """

    horizon: float
    value: float
    interval: tuple[float, float]


def worse_on_unseen(fit: Certificate | None) -> Worse | None:
    """Where the corrected model certainly predicts drives worse than the refitted nominal one, and by how much.

    None where nothing was certified, nowhere, or where it certainly predicts better elsewhere: a name that helps with
    one quantity at one horizon is not refuted by another.

    Args:
        fit: of the corrected model.
    """
    if fit is None:
        return None
    certain = [
        Worse(float(horizon), gained.corrected.value, gained.corrected.interval)
        for by_horizon in (fit.gain, fit.gain_readings)
        for horizon, gained in by_horizon.items()
        if gained is not None and gained.corrected.interval is not None
    ]
    if any(item.interval[0] > 0.0 for item in certain):
        return None
    return min((item for item in certain if item.interval[1] < 0.0), key=lambda item: item.value, default=None)
