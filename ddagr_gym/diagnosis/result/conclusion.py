"""From recordings to a verdict: the steps in their order."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ddagr_gym.diagnosis.gates.thresholds import Thresholds
from ddagr_gym.diagnosis.preprocessing.input_requirements import data_source
from ddagr_gym.diagnosis.preprocessing.mended_recordings import Prepared, prepare
from ddagr_gym.diagnosis.preprocessing.repeated_readings import Held, hold_effect
from ddagr_gym.diagnosis.preprocessing.reversed_gyro import ReversedGyro
from ddagr_gym.diagnosis.result.equivalence import equivalents
from ddagr_gym.diagnosis.result.sentences import headline
from ddagr_gym.diagnosis.result.uncertainty import intervals, least_detectable, resampled_parameters, with_structure
from ddagr_gym.diagnosis.result.verdict import NONE, UNKNOWN, Diagnosis, Estimate, Finding
from ddagr_gym.diagnosis.search.scan import dispersion_of
from ddagr_gym.diagnosis.search.scanned_model import ScannedModel, SearchResult, scan_model
from ddagr_gym.diagnosis.search.stepwise import (
    BENT,
    MOST_EFFECTS,
    further_gates,
    refit_nominal,
    search,
)
from ddagr_gym.diagnosis.setting import SHORT, Setting
from ddagr_gym.diagnosis.store import StepCache, compute_without_cache
from ddagr_gym.errors import InputError
from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.identification.misfit import LOCAL, explained_share, roughest
from ddagr_gym.identification.problem import Problem
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.gyro_sign import GyroSign
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.version import __version__

_Sizes = Mapping[str, Mapping[str, float]]

_TOO_MUCH = 10.0
"""Misfit of a channel over its limit that may remain beside a name (ours): a library's effect in a form of its own
leaves up to seven times the limit, one that no library has and that borrows a name fifteen (development set)."""

_MUCH = 1.5
"""The same where the names explain less than half of the channels' misfit."""


@dataclass(frozen=True, eq=False)
class Begun:
    """Where a search begins.

    Attributes:
        setting: of the windows.
        prepared: recordings and their windows.
        raw: the nominal model as it stands.
        refitted: the same refitted.
    """

    setting: Setting
    prepared: Prepared
    raw: Fitted
    refitted: Fitted


def begun(
    robot: Robot,
    soil: Soil,
    recordings: Sequence[Recording],
    setting: Setting,
    progress: Callable[[str], None] = lambda text: None,
    cache: StepCache = compute_without_cache,
) -> Begun:
    """Nominal models on windows of the set length; on short ones where the refitted one is far off.

    What is large bends long predictions so much that no small step leads to it, and shows in short ones as well.

    Args:
        robot: nominal.
        soil: nominal.
        recordings: at least one, of one period.
        setting: choices.
        progress: called with what is being done.
        cache: see :func:`ddagr_gym.diagnosis.search.stepwise.search`.

    Raises:
        InputError: the nominal simulator breaks down on some window.
    """
    prepared = prepare(robot, soil, recordings, setting)
    raw, refitted = cache("search refit", partial(refit_nominal, prepared.problem, progress))
    if dispersion_of(prepared.problem, refitted) > BENT and setting.duration > SHORT:
        progress("far off: again in short windows")
        setting = setting.with_windows(SHORT, SHORT * setting.stride / setting.duration)
        prepared = prepare(robot, soil, recordings, setting)
        raw, refitted = cache("search refit, short windows", partial(refit_nominal, prepared.problem, progress))
    _check_predicted(prepared, refitted)
    return Begun(setting, prepared, raw, refitted)


def _check_predicted(prepared: Prepared, refitted: Fitted) -> None:
    """A window that cannot be predicted has no residual, and nothing could be said of it."""
    failed = np.flatnonzero(~np.isfinite(refitted.window_cost))
    if failed.size:
        windows = prepared.problem.blocked.windows
        source = prepared.recordings[int(windows.recording[failed[0]])].meta.source
        raise InputError(
            f"the nominal simulator breaks down in {failed.size} of {windows.count} windows, first at "
            f"{windows.time[failed[0]]:.1f} s of {source}: leave that stretch out, or give a --robot and --soil that "
            "are closer to the real ones."
        )


def searched(
    robot: Robot,
    soil: Soil,
    recordings: Sequence[Recording],
    thresholds: Thresholds,
    setting: Setting,
    progress: Callable[[str], None] = lambda text: None,
    cache: StepCache = compute_without_cache,
) -> tuple[Setting, SearchResult]:
    """Search from the nominal models of :func:`begun`.

    Args:
        robot: nominal.
        soil: nominal.
        recordings: at least one, of one period.
        thresholds: of the bank.
        setting: choices.
        progress: called with what is being done.
        cache: see :func:`ddagr_gym.diagnosis.search.stepwise.search`.

    Returns:
        The setting of the windows that were searched, for :func:`prepare`, and what was found.

    Raises:
        InputError: see :func:`begun`.
    """
    first = begun(robot, soil, recordings, setting, progress, cache)
    problem = first.prepared.problem
    nominal = cache("search nominal", partial(scan_model, problem, first.refitted, progress))
    gates = thresholds.for_length(problem.covered)
    return first.setting, search(problem, gates, nominal=(first.raw, nominal), progress=progress, cache=cache)


def conclude(
    prepared: Prepared, found: SearchResult, thresholds: Thresholds, rng: np.random.Generator
) -> tuple[Diagnosis, tuple[Effect, ...]]:
    """Findings with intervals and equivalence sets, and the verdict.

    Args:
        prepared: what was searched.
        found: by the search.
        thresholds: of the null bank.
        rng: of the resampling.

    Returns:
        The diagnosis (its time is 0), and the effects that it names with their fitted sizes.
    """
    problem, held = prepared.problem, prepared.held
    seen = [*_held_findings(held), *_flipped_findings(prepared.flipped)]
    kept = accepted(found, thresholds)
    verdict, complete = _verdict(kept, [f.name for f in seen], thresholds)
    fitted = _findings(problem, found, thresholds, rng)
    findings, rejected = ((*seen, *fitted), ()) if kept is found else (tuple(seen), tuple(fitted))
    from_values = (*((hold_effect(held),) if held else ()), *((GyroSign(1.0),) if prepared.flipped else ()))
    effects = (*from_values, *kept.chosen.fitted.point.effects)
    values = kept.chosen.fitted.point.values
    alone, beside = _detectable(kept, thresholds)
    diagnosis = Diagnosis(
        verdict,
        complete,
        findings,
        headline(verdict, complete, findings),
        {"nominal": kept.nominal.misfit, "corrected": kept.chosen.misfit, "limit": dict(thresholds.misfit)},
        {**alone, **beside},
        {p.name: float(v) for p, v in zip(problem.nuisances.parameters, values, strict=True) if p.prior > 0.0},
        tuple(recording.meta.source for recording in prepared.recordings),
        _thresholds(thresholds),
        0.0,
        __version__,
        data=tuple(data_source(recording) for recording in prepared.recordings),
        rejected=rejected,
        detectable_alone=alone,
    )
    return diagnosis, effects


def _held_findings(held: Sequence[Held]) -> list[Finding]:
    """Held readings need no fit: the share of repeats is the evidence, and its own score."""
    if not held:
        return []
    effect = hold_effect(held)
    parameters = {
        name: Estimate(float(getattr(effect, name)), str(effect.parameter(name).metadata["unit"]))
        for name in ("duration", "accelerometer", "gyro", "encoders", "pose")
    }
    repeats = sum(item.share * item.samples for item in held)
    return [Finding("sensor_hold", parameters, repeats, 0.0, repeats**0.5, repeats, {}, {"sensor_hold": 1.0})]


def _flipped_findings(flipped: ReversedGyro | None) -> list[Finding]:
    """A reversed gyro needs no fit: the correlation is the evidence, as the gain of a line through the origin."""
    if flipped is None:
        return []
    gain = -0.5 * flipped.samples * math.log1p(-min(flipped.correlation**2, 1.0 - 1e-12))
    flip = {"flip": Estimate(1.0, "-")}
    return [Finding("gyro_sign", flip, gain, 0.0, (2.0 * gain) ** 0.5, gain, {"yaw_rate": 1.0}, {"gyro_sign": 1.0})]


def _findings(problem: Problem, found: SearchResult, thresholds: Thresholds, rng: np.random.Generator) -> list[Finding]:
    """One finding per effect of the chosen model."""
    chosen = found.chosen
    if not chosen.names:
        return []
    parameters, draws = resampled_parameters(problem, chosen.fitted, rng)
    bounds = intervals(draws)
    findings = []
    for number, effect in enumerate(chosen.fitted.point.effects):
        spread = {
            p.field: with_structure(b, effect, p.field)
            for p, b in zip(parameters, bounds, strict=True)
            # a shape that no resampling moves is not known: nothing shows it
            if p.effect == number and (b[0] < b[1] or p.field in effect.size_names())
        }
        place = _before(found, effect.name)
        before, after = found.models[place : place + 2]
        gain = _gain(found, before, effect.name)
        estimates = {
            name: Estimate(float(getattr(effect, name)), str(effect.parameter(name).metadata["unit"]), spread.get(name))
            for name in (*effect.size_names(), *effect.shape_names())
        }
        findings.append(
            Finding(
                effect.name,
                estimates,
                gain,
                further_gates(thresholds, found.models[: place + 1]).of(effect.name).gain,
                before.scores[effect.name],
                before.held_out.get(effect.name, 0.0),
                _channel_shares(before, after),
                equivalents(found, effect.name, rng),
                calibrated_p=thresholds.p_value(effect.name, gain),
            )
        )
    return findings


def _thresholds(thresholds: Thresholds) -> dict[str, Any]:
    """Where the gates come from, and all of them."""
    origin = {} if thresholds.origin is None else asdict(thresholds.origin)
    gates = {name: gate.gain for name, gate in thresholds.gates.items()}
    return {"nulls": thresholds.nulls, "bank": thresholds.bank, "level": thresholds.level, **origin, "gates": gates}


def _detectable(found: SearchResult, thresholds: Thresholds) -> tuple[_Sizes, _Sizes]:
    """Least detectable sizes: of all effects before any was named, and of the others beside those that were."""
    first, named = found.nominal, found.chosen
    alone = least_detectable(first.terms, thresholds, first.dispersion)
    return alone, least_detectable(named.terms, further_gates(thresholds, found.models), named.dispersion)


def _before(found: SearchResult, name: str) -> int:
    """Place of the last model of the search that lacks an effect."""
    return max(k for k, model in enumerate(found.models) if name not in model.names)


def _gain(found: SearchResult, before: ScannedModel, name: str) -> float:
    """Evidence of an effect: what the scan before it says, or the joint refit that added it where that says more."""
    linear = next(item.gain for item in before.gains if item.name == name)
    return max([linear, *(rival.gain for step in found.steps for rival in step if rival.name == name)])


def _channel_shares(before: ScannedModel, after: ScannedModel) -> dict[str, float]:
    """Share of each channel in the fall of the misfit; channels that got worse have none."""
    falls = {name: max(value - after.misfit.get(name, value), 0.0) for name, value in before.misfit.items()}
    total = sum(falls.values())
    return {name: fall / total for name, fall in falls.items() if total > 0.0 and fall > 0.01 * total}


def accepted(found: SearchResult, thresholds: Thresholds) -> SearchResult:
    """What was found; without names where these leave too much of what the channels show."""
    if not found.chosen.names:
        return found
    limits = dict(thresholds.misfit)
    channels = {name: value for name, value in found.chosen.misfit.items() if name not in LOCAL}
    _, left = roughest(channels, limits)
    explained = explained_share({name: found.nominal.misfit[name] for name in channels}, channels, limits)
    too_much = left > _TOO_MUCH or (left > _MUCH and explained is not None and explained < 0.5)
    return replace(found, models=found.models[:1]) if too_much else found


def _verdict(found: SearchResult, seen: Sequence[str], thresholds: Thresholds) -> tuple[tuple[str, ...], bool]:
    """Three values: named and complete, named but incomplete, none of these; or nothing at all.

    What was seen in the values themselves (repeats, a reversed gyro) stays named whatever else is left.

    Args:
        found: and accepted.
        seen: names.
        thresholds: of the null bank.
    """
    _, left = roughest(found.chosen.misfit, dict(thresholds.misfit))
    complete = left <= 1.0 and not _more(found, thresholds)
    names = (*seen, *found.chosen.names)
    if not names:
        return ((NONE,), True) if complete else ((UNKNOWN,), False)
    return names, complete


def _more(found: SearchResult, thresholds: Thresholds) -> bool:
    """Whether the search stopped at its limit; else, what passed the gate and was not added failed in a joint refit."""
    if len(found.chosen.names) < MOST_EFFECTS:
        return False
    gates = further_gates(thresholds, found.models)
    return any(gates.passes(g.name, g.gain, found.chosen) for g in found.chosen.gains)
