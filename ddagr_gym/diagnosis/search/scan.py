"""The scan: what each effect of the library would explain of the residual, everything uncertain projected out.

One simulation per probe gives a column of sensitivities; per window all inner products of residual, nuisances and
probes are kept (:class:`Terms`). Scores, gains, held-out gains and resampled ones follow from sums of these small
matrices, without another simulation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.search.candidates import Candidate, candidates_of
from ddagr_gym.diagnosis.search.overlap import overlaps
from ddagr_gym.diagnosis.search.sensor_effects import Drives, acts_on_readings_only, record_drives
from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.identification.nuisances import absorbed_sizes
from ddagr_gym.identification.problem import Problem
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.base import DriveExtent
from ddagr_gym.physics.effects.registry import effect_kinds

Array = NDArray[np.float64]

_NEAR_PATCH = 1.5
"""Distance of wheels from the body's path that may still touch a patch [m], about a robot's half diagonal and more."""

_BEFORE_ONSET = 3.0
"""Time before an onset in which it already shows [s]: six widths of the smoothed step."""


@dataclass(frozen=True, eq=False)
class Terms:
    """Inner products per window after elimination of its unknowns.

    Attributes:
        normals: (W, 1 + P + K, 1 + P + K) of residual, free nuisances and probes, in this order.
        nuisances: P.
        precision: (P,) of the nuisances' priors.
        values: (P,) of the nuisances at the fitted model.
        candidates: what the probes are of.
        recording: (W,) of each window.
        time: (W,) of each window [s].
        turned: recordings whose headings are unknown.
        overlap: by effect, share of what it does that lies in the windows and channels in which the effects of the
            model act already (0 to 1); empty for a model without effects.
        absorbed: by effect, the size that a nuisance would take over without a trace.
    """

    normals: Array
    nuisances: int
    precision: Array
    values: Array
    candidates: tuple[Candidate, ...]
    recording: NDArray[np.int64]
    time: Array
    turned: tuple[int, ...] = ()
    overlap: Mapping[str, float] = field(default_factory=dict)
    absorbed: Mapping[str, float] = field(default_factory=dict)

    @property
    def placed(self) -> NDArray[np.bool_]:
        """(W,) windows whose headings in the world are known."""
        return ~np.isin(self.recording, np.array(self.turned, dtype=np.int64))

    @property
    def frames(self) -> list[Array]:
        """(W,) windows, as weights, of each part whose directions in the world are known to each other."""
        own = [self.recording == number for number in self.turned]
        return [chosen.astype(float) for chosen in (self.placed, *own) if chosen.any()]


@dataclass(frozen=True)
class Gain:
    """What a candidate explains.

    Attributes:
        candidate: index among the candidates.
        name: of the effect.
        gain: fall of the cost (half a sum of squares).
        multiples: of the probes.
    """

    candidate: int
    name: str
    gain: float
    multiples: tuple[float, ...]


def drive_extent(problem: Problem, prediction: Array) -> DriveExtent:
    """What the windows cover."""
    windows = problem.blocked.windows
    x, y = prediction[..., 5], prediction[..., 6]
    commands = windows.commands[:, windows.history : windows.history + windows.samples]
    change = np.abs(np.diff(prediction[..., 3:5], axis=1)).max() / windows.period
    return DriveExtent(
        float((windows.time + windows.duration).max()),
        (float(x.min()), float(x.max())),
        (float(y.min()), float(y.max())),
        float(np.abs(commands).max()),
        float(change),
    )


def touched(probe: Effect, problem: Problem, prediction: Array) -> NDArray[np.bool_]:
    """(W,) windows whose readings a probe can change: others need no simulation."""
    windows = problem.blocked.windows
    result = np.ones(windows.count, dtype=bool)
    names = probe.shape_names()
    if {"centre_x", "centre_y", "radius", "edge"} <= set(names):
        place = probe.as_mapping()["parameters"]
        distance = np.hypot(prediction[..., 5] - place["centre_x"], prediction[..., 6] - place["centre_y"])
        result &= distance.min(axis=1) < place["radius"] + _NEAR_PATCH + 4.0 * place["edge"]
    if "onset" in names:
        result &= windows.time + windows.duration > probe.as_mapping()["parameters"]["onset"] - _BEFORE_ONSET
    return result


def probe_column(problem: Problem, fitted: Fitted, probe: Effect, drives: Drives | None = None) -> Array:
    """Weighted change of the block means by a probe at the fitted model, (W, M).

    Args:
        problem: what was fitted.
        fitted: the model.
        probe: effect at a size.
        drives: simulation of the fitted model, with which an effect on readings needs none of its own.
    """
    if drives is not None and acts_on_readings_only(probe):
        return problem.blocked.change(drives.readings(probe), fitted.prediction)
    chosen = touched(probe, problem, fitted.prediction)
    column = np.zeros(problem.blocked.mask.shape)
    if not chosen.any():
        return column
    part = problem if chosen.all() else problem.subset(chosen)
    point = replace(fitted.point, states=fitted.point.states[chosen], effects=(*fitted.point.effects, probe))
    column[chosen] = part.blocked.change(part.predict(point), fitted.prediction[chosen])
    return column


def scan(
    problem: Problem,
    fitted: Fitted,
    kinds: Mapping[str, type[Effect]] | None = None,
    progress: Callable[[str], None] = lambda name: None,
) -> Terms:
    """Terms of all effects of the library at a fitted model.

    Args:
        problem: what was fitted.
        fitted: the fit, with or without effects.
        kinds: effects to try, all by default; those assumed already are left out.
        progress: called with the name of each effect when it is done.
    """
    extent = drive_extent(problem, fitted.prediction)
    assumed = {effect.name for effect in fitted.point.effects}
    candidates: list[Candidate] = []
    columns: list[Array] = []
    drives = record_drives(problem, fitted.point)
    for name, kind in (effect_kinds() if kinds is None else kinds).items():
        # repeated readings are found in the values themselves (ddagr_gym.diagnosis.preprocessing.repeated_readings)
        if name in assumed or name == "sensor_hold":
            continue
        for candidate in candidates_of(kind, extent, len(columns)):
            candidates.append(candidate)
            columns += [probe_column(problem, fitted, probe, drives) for probe in candidate.probes]
        progress(name)
    free = problem.open_at(fitted.point)
    raw = np.concatenate(
        [
            problem.residual(fitted.point, fitted.prediction)[..., None],
            problem.padded(np.concatenate([fitted.by_parameter[..., free], np.stack(columns, axis=2)], axis=2)),
        ],
        axis=2,
    )
    projected = fitted.elimination.project(raw)
    overlap = overlaps(problem, fitted, candidates, projected[..., 1 + len(free) :])
    windows = problem.blocked.windows
    return Terms(
        np.matmul(projected.transpose(0, 2, 1), projected),
        len(free),
        1.0 / problem.prior[free] ** 2,
        fitted.point.values[free],
        tuple(candidates),
        windows.recording,
        windows.time,
        tuple(p.recording for p in problem.nuisances.parameters if p.heading and p.recording is not None),
        overlap,
        absorbed_sizes(problem.nuisances.parameters, fitted.point.values),
    )


@dataclass(frozen=True, eq=False)
class Reduced:
    """Gradient and information of all probes with the nuisances projected out.

    Attributes:
        gradient: (K,).
        information: (K, K).
        nuisance: (P, 1 + K) best nuisance change without probes, and its answer to each probe.
    """

    gradient: Array
    information: Array
    nuisance: Array


def reduce(terms: Terms, weights: Array | None = None) -> Reduced:
    """Sum the windows, with weights (W,) if given, and project the nuisances out (theory: diagnosis, eq. (2))."""
    total = terms.normals.sum(axis=0) if weights is None else np.tensordot(weights, terms.normals, axes=1)
    share = 1.0 if weights is None else float(np.mean(weights))
    p = terms.nuisances
    inside = total[1 : 1 + p, 1 : 1 + p] + np.diag(terms.precision * share)
    right = np.concatenate([total[1 : 1 + p, :1], total[1 : 1 + p, 1 + p :]], axis=1)
    right[:, 0] -= terms.precision * share * terms.values
    answer = np.linalg.solve(inside, right)
    cross = total[1 + p :, 1 : 1 + p]
    return Reduced(total[1 + p :, 0] - cross @ answer[:, 0], total[1 + p :, 1 + p :] - cross @ answer[:, 1:], answer)


def best_multiples(reduced: Reduced, candidate: Candidate, dispersion: float = 1.0) -> tuple[float, Array]:
    """Gain and multiples of a candidate's probes, inside what exists in nature (theory: diagnosis, eq. (3)).

    Args:
        reduced: sums over windows.
        candidate: which probes.
        dispersion: variance of the weighted residuals by which the gain is divided.
    """
    index = np.array(candidate.columns)
    gradient = reduced.gradient[index]
    information = reduced.information[np.ix_(index, index)] + np.diag(1.0 / np.array(candidate.scales) ** 2)
    if candidate.whole is not None:
        theta = np.array([candidate.whole])
    else:
        theta = _solve_one_sided(information, gradient, np.array(candidate.one_sided))
    gain = float(theta @ gradient - 0.5 * theta @ information @ theta)
    return gain / dispersion, theta


def _solve_one_sided(information: Array, gradient: Array, one_sided: NDArray[np.bool_]) -> Array:
    """Least squares with some unknowns not negative; by trying which of them are zero (there are at most two)."""
    size = len(gradient)
    ridge = 1e-8 * np.diag(np.maximum(np.diag(information), 1e-12))
    best, found = 0.0, np.zeros(size)
    for pattern in range(1, 2**size):
        used = np.array([bool(pattern >> k & 1) for k in range(size)])
        theta = np.zeros(size)
        theta[used] = np.linalg.solve((information + ridge)[np.ix_(used, used)], gradient[used])
        if (theta[one_sided] < 0.0).any():
            continue
        gain = float(theta @ gradient - 0.5 * theta @ information @ theta)
        if gain > best:
            best, found = gain, theta
    return found


def gains(terms: Terms, weights: Array | None = None, dispersion: float = 1.0) -> list[Gain]:
    """Gain of the best candidate of each effect, largest first."""
    reduced = reduce(terms, weights)
    best: dict[str, Gain] = {}
    for k, candidate in enumerate(terms.candidates):
        gain, theta = best_multiples(reduced, candidate, dispersion)
        if candidate.is_direction and terms.turned:
            gain = max(gain, _gain_by_frame(terms, candidate, weights, dispersion))
        if candidate.name not in best or gain > best[candidate.name].gain:
            best[candidate.name] = Gain(k, candidate.name, gain, tuple(theta.tolist()))
    return sorted(best.values(), key=lambda item: -item.gain)


def _gain_by_frame(terms: Terms, candidate: Candidate, weights: Array | None, dispersion: float) -> float:
    """Gain of a direction that every frame may see turned, less what a heading explains by chance in each further one.

    Drives out and back show the same slope with opposite signs: taken to start in one direction they cancel.
    """
    frames = [frame if weights is None else frame * weights for frame in terms.frames]
    found = [best_multiples(reduce(terms, frame), candidate, dispersion)[0] for frame in frames if frame.any()]
    return sum(found) - 0.5 * (len(found) - 1)


def nuisance_answer(problem: Problem, fitted: Fitted, terms: Terms, gain: Gain) -> Array:
    """(P,) change of all nuisances that goes with a candidate's multiples in the scan's linear model.

    Args:
        problem: what was fitted.
        fitted: the model that was scanned.
        terms: of that scan.
        gain: of the candidate; a categorical or a limiting effect keeps its probe's size whatever its multiple.
    """
    candidate = terms.candidates[gain.candidate]
    change = np.zeros(len(fitted.point.values))
    if candidate.has_sizes:
        reduced = reduce(terms)
        columns = 1 + np.array(candidate.columns)
        change[problem.open_at(fitted.point)] = reduced.nuisance[:, 0] - reduced.nuisance[:, columns] @ gain.multiples
    return change


def dispersion_of(problem: Problem, fitted: Fitted) -> float:
    """Mean square of the weighted residuals of the fit, at least 1 (theory: diagnosis, eq. (1))."""
    unknowns: int = fitted.elimination.basis.shape[2] * problem.blocked.windows.count
    count = float(problem.blocked.mask.sum()) - unknowns - float(problem.free.sum())
    return max(2.0 * float(fitted.window_cost.sum()) / max(count, 1.0), 1.0)


def scores(terms: Terms, gains_: Sequence[Gain]) -> dict[str, float]:
    """Cluster-robust score of each effect along its best direction: sum over windows over its own scatter [-].

    Theory: diagnosis, eq. (4).

    The scatter is the sandwich estimate by window, so that correlated errors inside windows do not count as evidence.
    """
    reduced = reduce(terms)
    p = terms.nuisances
    result = {}
    for gain in gains_:
        candidate = terms.candidates[gain.candidate]
        theta = np.array(gain.multiples)
        direction = np.zeros(terms.normals.shape[1])
        direction[1 + p + np.array(candidate.columns)] = theta
        direction[1 : 1 + p] = -(reduced.nuisance[:, 1 + np.array(candidate.columns)] @ theta)
        by_window = terms.normals[:, 0] @ direction
        mean = by_window.mean()
        scatter = np.sqrt(((by_window - mean) ** 2).sum())
        result[gain.name] = float(by_window.sum() / scatter) if scatter > 0.0 else 0.0
    return result


def fold_of(terms: Terms, folds: int, length: float) -> NDArray[np.int64]:
    """(W,) fold of each window: stretches of ``length`` [s] of every recording are dealt out in turn."""
    stretch = np.floor(terms.time / length).astype(np.int64)
    return np.asarray((stretch + terms.recording) % folds)


def held_out_gains(terms: Terms, dispersion: float = 1.0, folds: int = 4, length: float = 6.0) -> dict[str, float]:
    """Fall of the cost on windows that were left out while multiples and nuisances were fitted, by effect.

    Theory: diagnosis, section 4.

    Args:
        terms: of a scan.
        dispersion: see :func:`best_multiples`.
        folds: parts.
        length: of the stretches that are dealt out to the parts [s].
    """
    fold = fold_of(terms, folds, length)
    total: dict[str, float] = {}
    for part in range(folds):
        outside = (fold != part).astype(float)
        if not outside.any() or outside.all():
            continue
        reduced = reduce(terms, outside)
        inside = terms.normals[fold == part].sum(axis=0)
        for gain in gains(terms, outside):
            change = _held_out(terms, reduced, inside, gain, 1.0 / folds)
            total[gain.name] = total.get(gain.name, 0.0) + change / dispersion
    return total


def _held_out(terms: Terms, reduced: Reduced, inside: Array, gain: Gain, share: float) -> float:
    """Fall of the cost on other windows by a candidate fitted elsewhere, beside the nuisances fitted elsewhere.

    The nuisances' priors count with the windows' ``share``: an effect that lets them return to what is known of soil
    and robot explains something even where the readings fit as well without it.
    """
    p = terms.nuisances
    columns = np.array(terms.candidates[gain.candidate].columns)
    theta = np.array(gain.multiples)
    base = reduced.nuisance[:, 0]

    def cost(change: Array, multiples: Array) -> float:
        vector = np.zeros(inside.shape[0])
        vector[0] = 1.0
        vector[1 : 1 + p] = -change
        vector[1 + p + columns] = -multiples
        prior = 0.5 * share * float((terms.precision * (terms.values + change) ** 2).sum())
        return 0.5 * float(vector @ inside @ vector) + prior

    answered = base - reduced.nuisance[:, 1 + columns] @ theta
    return cost(base, np.zeros(len(theta))) - cost(answered, theta)
