"""Errors of predictions as the entries of a certificate: root mean squares, intervals, and shares of the ceiling."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.certification.forecast import MOTION, UNITS
from ddagr_gym.diagnosis.result.uncertainty import LEVEL
from ddagr_gym.identification.windows import CHANNELS

Array = NDArray[np.float64]
Errors = dict[str, dict[str, Array]]
"""(K,) by model and quantity."""

HORIZONS = (1.0, 5.0, 30.0)
"""[s] (theory: diagnosis, section 9)."""

MODELS = ("raw", "refitted", "corrected", "black_box", "ceiling")

BY_RECORDING, BY_TIME = "by recording", "by time"

DRAWS = 500

LEAST_EXPLAINABLE = 0.03
"""Share of the refitted error that the ceiling must explain before a share of it means anything (ours)."""


def certificate(
    rule: str, found: Mapping[float, Errors], clusters: Mapping[float, NDArray[np.int64]], rng: np.random.Generator
) -> dict[str, Any]:
    """Entries of ``fit`` in ``diagnosis.json``.

    Args:
        rule: BY_RECORDING or BY_TIME.
        found: errors by horizon, model and quantity.
        clusters: of the predictions, by horizon.
        rng: of the resampling.
    """
    channels: dict[str, dict[str, Any]] = {}
    shares: dict[str, dict[str, Any]] = {
        name: {} for name in ("gain", "gain_readings", "gain_share", "gain_share_readings")
    }
    lost = 0
    for horizon, every in found.items():
        key = f"{horizon:g}"
        errors, unfinished = finished(every)
        lost += unfinished
        table = resampled(errors, clusters[horizon], rng)
        for quantity in UNITS:
            if quantity in table["refitted"]:
                channels.setdefault(quantity, {})[key] = _entry(table, quantity, errors)
        for quantities, ending in ((MOTION, ""), (CHANNELS, "_readings")):
            gained = gains(table, quantities)
            shares[f"gain{ending}"][key] = {model: _estimate(values) for model, values in gained.items()} or None
            shares[f"gain_share{ending}"][key] = gain_share(gained)
    return {
        "folds": rule,
        "note": _note(rule, found, lost),
        "horizons": list(HORIZONS),
        "level": LEVEL,
        "channels": channels,
        **shares,
    }


def finished(errors: Errors) -> tuple[Errors, int]:
    """Errors without the predictions that some model did not finish, and how many (at most of a quantity) these are."""
    known = {q: [np.isfinite(by_quantity[q]) for by_quantity in errors.values()] for q in errors["refitted"]}
    every = {q: np.all(flags, axis=0) for q, flags in known.items()}
    lost = max(int((np.any(flags, axis=0) & ~every[q]).sum()) for q, flags in known.items())
    return {m: {q: np.where(every[q], v, np.nan) for q, v in e.items()} for m, e in errors.items()}, lost


def _note(rule: str, found: Mapping[float, Errors], lost: int) -> str:
    parts = ["Which effects are in the model was decided on all drives; their sizes and the nominal model's were not."]
    if rule == BY_TIME:
        parts.append(
            "There is one recording: its halves judge each other, so that its place, its sensors' biases and its day "
            "are not new to the model that is judged."
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


def gain_share(gained: Mapping[str, Array]) -> dict[str, Any] | None:
    """Share of what the ceiling gains over the refitted nominal model that the named effects gain.

    None where not even the ceiling gains :data:`LEAST_EXPLAINABLE`, or where the interval of its gain holds nothing:
    a share of what may be nothing is no number.

    Args:
        gained: of :func:`gains`.
    """
    if not gained or gained["ceiling"][0] < LEAST_EXPLAINABLE:
        return None
    ceiling = _estimate(gained["ceiling"])["interval"]
    if ceiling is not None and ceiling[0] <= 0.0:
        return None
    sound = gained["ceiling"] > 0.5 * LEAST_EXPLAINABLE
    return _estimate(np.where(sound, gained["corrected"] / np.where(sound, gained["ceiling"], 1.0), np.nan))


def of_mended_readings(fit: Mapping[str, Any], named: bool) -> dict[str, Any]:
    """A certificate of readings that were mended before any model saw them.

    Args:
        fit: of the mended readings.
        named: whether effects besides those that were mended are in the corrected model. Without any its share of what
            could be explained would be nothing, which says nothing about what was mended.
    """
    note = (
        f"{fit['note']} Faults that show in the values themselves (repeats, a reversed gyro) are mended before any "
        "model is fitted: these errors say nothing about them."
    )
    shares = {} if named else {name: dict.fromkeys(fit[name]) for name in ("gain_share", "gain_share_readings")}
    return {**fit, "note": note, **shares}


def worse_on_unseen(fit: Mapping[str, Any] | None) -> dict[str, Any] | None:
    """The horizon and gain at which the corrected model certainly predicts drives worse than the refitted nominal one.

    None where nothing was certified, nowhere, or where it certainly predicts better elsewhere: a name that helps with
    one quantity at one horizon is not refuted by another.

    Args:
        fit: of a certificate.
    """
    entries = [
        (float(horizon), models["corrected"])
        for name in ("gain", "gain_readings")
        for horizon, models in ((fit or {}).get(name) or {}).items()
        if models is not None and models["corrected"]["interval"] is not None
    ]
    if any(entry["interval"][0] > 0.0 for _, entry in entries):
        return None
    worse = [(horizon, entry) for horizon, entry in entries if entry["interval"][1] < 0.0]
    if not worse:
        return None
    horizon, entry = min(worse, key=lambda item: item[1]["value"])
    return {"horizon": horizon, **entry}
