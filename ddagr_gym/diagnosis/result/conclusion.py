"""The verdict of a search: which names are accepted, their findings with intervals, and whether anything is left."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from itertools import pairwise

from ddagr_gym.diagnosis.answer.verdict import NONE, UNKNOWN, DataSource, Diagnosis, Estimate, Finding, GatesUsed
from ddagr_gym.diagnosis.gates.thresholds import Thresholds
from ddagr_gym.diagnosis.preprocessing.input_requirements import content_hash
from ddagr_gym.diagnosis.preprocessing.mended_recordings import MendedRecordings
from ddagr_gym.diagnosis.preprocessing.repeated_readings import hold_effect
from ddagr_gym.diagnosis.preprocessing.reversed_gyro import ReversedGyro
from ddagr_gym.diagnosis.preprocessing.session import DiagnosisSession
from ddagr_gym.diagnosis.result.channel_fault_findings import channel_fault_findings, repeat_findings
from ddagr_gym.diagnosis.result.detectable import least_detectable
from ddagr_gym.diagnosis.result.equivalence import equivalents
from ddagr_gym.diagnosis.result.sentences import headline
from ddagr_gym.diagnosis.result.soil_at_work import soil_at_work
from ddagr_gym.diagnosis.result.uncertainty import (
    Resampled,
    intervals,
    nuisance_spread,
    resampled_parameters,
    with_structure,
)
from ddagr_gym.diagnosis.search.scanned_model import ScannedModel, SearchResult
from ddagr_gym.diagnosis.search.stepwise import MOST_EFFECTS, further_gates
from ddagr_gym.identification.misfit import explained_share, roughest
from ddagr_gym.identification.nuisances import LOCAL
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

_MANY = 10.0
"""Gain over the gate from which a name stands although too much is left (ours)."""

_HOLDS = 0.8
"""Share of its gain that it has on left-out windows at least (ours)."""

_OWN = 0.5
"""Share of what it explains that lies in channels in which hardly anything is left (ours)."""


def conclude(
    session: DiagnosisSession, found: SearchResult, accepted: SearchResult
) -> tuple[Diagnosis, tuple[Effect, ...]]:
    """Findings with intervals and equivalence sets, and the verdict.

    Args:
        session: of the diagnosis.
        found: by the search.
        accepted: the same, or only as far as :func:`accept` accepts its names.

    Returns:
        The diagnosis (its time is 0), and the effects that it names with their fitted sizes.
    """
    gates, mended, values = session.gates, session.mended, accepted.chosen.fitted.point.values
    verdict, complete = _verdict(accepted, mended.names, gates)
    seen = [
        *repeat_findings(mended.held),
        *channel_fault_findings(mended.channel_faults),
        *reversed_gyro_findings(mended.reversed_gyro),
    ]
    fitted, draws = _findings(session, found)
    kept, draws = (fitted, draws) if accepted is found else _findings(session, accepted)
    rejected = tuple(item for item in fitted if item.name not in accepted.chosen.names)
    alone, beside = _detectable(accepted, gates)
    diagnosis = Diagnosis(
        verdict,
        complete,
        (*seen, *kept),
        headline(verdict, complete, (*seen, *kept)),
        {"nominal": accepted.nominal.misfit, "corrected": accepted.chosen.misfit, "limit": dict(gates.misfit)},
        {**alone, **beside},
        {p.name: float(v) for p, v in zip(session.problem.nuisances.parameters, values, strict=True) if p.prior > 0.0},
        tuple(recording.meta.source for recording in mended.recordings),
        _gates_used(gates),
        0.0,
        __version__,
        data=tuple(data_source(recording) for recording in mended.given),
        rejected=rejected,
        detectable_alone=alone,
        nuisance_spread=nuisance_spread(session.problem, accepted.chosen.fitted, draws),
    )
    return diagnosis, (*_effects_of_values(mended), *accepted.chosen.fitted.point.effects)


def data_source(recording: Recording) -> DataSource:
    """Name, hash and length of a recording."""
    seconds = float(recording.t[-1] - recording.t[0]) if len(recording) else 0.0
    hashed = recording.meta.source_sha256 or content_hash(recording)
    return DataSource(recording.meta.source, hashed, len(recording), seconds)


def _effects_of_values(mended: MendedRecordings) -> tuple[Effect, ...]:
    """Effects that were found in the values themselves."""
    hold = (hold_effect(mended.held),) if mended.held else ()
    return hold if mended.reversed_gyro is None else (*hold, GyroSign(1.0))


def reversed_gyro_findings(reversed_gyro: ReversedGyro | None) -> list[Finding]:
    """A reversed gyro needs no fit: the correlation is the evidence, as the gain of a line through the origin."""
    if reversed_gyro is None:
        return []
    gain = -0.5 * reversed_gyro.samples * math.log1p(-min(reversed_gyro.correlation**2, 1.0 - 1e-12))
    flip = {"flip": Estimate(1.0, "-")}
    return [Finding("gyro_sign", flip, gain, 0.0, (2.0 * gain) ** 0.5, gain, {"yaw_rate": 1.0}, {"gyro_sign": 1.0})]


def _findings(session: DiagnosisSession, found: SearchResult) -> tuple[list[Finding], Resampled]:
    """One finding per effect of the chosen model, and the resampled parameters of that."""
    problem, gates, chosen, rng = session.problem, session.gates, found.chosen, session.rng("verdict")
    draws = resampled_parameters(problem, chosen.fitted, rng)
    if not chosen.names:
        return [], draws
    bounds = intervals(draws.effects)
    findings = []
    for number, effect in enumerate(chosen.fitted.point.effects):
        spread = {
            p.field: with_structure(b, effect, p.field)
            for p, b in zip(draws.parameters, bounds, strict=True)
            # a shape that no resampling moves is not known: nothing shows it
            if p.effect == number and (b[0] < b[1] or p.field in effect.size_names())
        }
        place = _before(found, effect.name)
        before, after = found.models[place : place + 2]
        gain = _gain(found, place, effect.name)
        estimates = {
            name: Estimate(float(getattr(effect, name)), str(effect.parameter(name).metadata["unit"]), spread.get(name))
            for name in (*effect.size_names(), *effect.shape_names())
        }
        findings.append(
            Finding(
                effect.name,
                estimates,
                gain,
                further_gates(gates, found.models[: place + 1]).of(effect.name).gain,
                before.scores[effect.name],
                before.held_out.get(effect.name, 0.0),
                _channel_shares(before, after),
                equivalents(found, effect.name, rng),
                calibrated_p=gates.p_value(effect.name, gain),
                soil=soil_at_work(problem, session.soil, chosen.fitted, number, draws),
            )
        )
    return findings, draws


def _gates_used(thresholds: Thresholds) -> GatesUsed:
    """Where the gates come from, and all of them."""
    origin = {} if thresholds.origin is None else asdict(thresholds.origin)
    gates = {name: gate.gain for name, gate in thresholds.gates.items()}
    return GatesUsed(nulls=thresholds.nulls, bank=thresholds.bank, level=thresholds.level, **origin, gates=gates)


def _detectable(found: SearchResult, thresholds: Thresholds) -> tuple[_Sizes, _Sizes]:
    """Least detectable sizes: of all effects before any was named, and of the others beside those that were."""
    first, named = found.nominal, found.chosen
    alone = least_detectable(first.terms, thresholds, first.dispersion)
    return alone, least_detectable(named.terms, further_gates(thresholds, found.models), named.dispersion)


def _before(found: SearchResult, name: str) -> int:
    """Place of the last model of the search that lacks an effect."""
    return max(k for k, model in enumerate(found.models) if name not in model.names)


def _gain(found: SearchResult, place: int, name: str) -> float:
    """Evidence of an effect: what the scan before it says, or the joint refit that added it where that says more.

    In an earlier step it may have explained what others were named for. One that was swapped in has the refit of the
    last step before.

    Args:
        found: by the search.
        place: of the last model without it.
        name: of the effect.
    """
    linear = next(item.gain for item in found.models[place].gains if item.name == name)
    refits = [rival.gain for step in found.steps[: place + 1] for rival in step if rival.name == name]
    return max([linear, *refits[-1:]])


def _channel_shares(before: ScannedModel, after: ScannedModel) -> dict[str, float]:
    """Share of each channel in the fall of the misfit; channels that got worse have none."""
    falls = {name: max(value - after.misfit.get(name, value), 0.0) for name, value in before.misfit.items()}
    total = sum(falls.values())
    return {name: fall / total for name, fall in falls.items() if total > 0.0 and fall > 0.01 * total}


def accept(found: SearchResult, thresholds: Thresholds) -> SearchResult:
    """What was found; where that leaves too much of what the channels show, only the names that stand by themselves."""
    if not found.chosen.names:
        return found
    limits = dict(thresholds.misfit)
    channels = {name: value for name, value in found.chosen.misfit.items() if name not in LOCAL}
    _, left = roughest(channels, limits)
    explained = explained_share({name: found.nominal.misfit[name] for name in channels}, channels, limits)
    too_much = left > _TOO_MUCH or (left > _MUCH and explained is not None and explained < 0.5)
    return standing(found, thresholds) if too_much else found


def standing(found: SearchResult, thresholds: Thresholds) -> SearchResult:
    """What was found as far as its names stand by themselves, whatever else is left."""
    return replace(found, models=found.models[: 1 + _standing(found, thresholds)])


def _standing(found: SearchResult, thresholds: Thresholds) -> int:
    """Number of first steps of a search whose names stand whatever else is left."""
    count = 0
    for before, after in pairwise(found.models):
        added = set(after.names) - set(before.names)
        if len(after.names) != count + 1 or not added <= set(found.chosen.names):
            break
        if not all(_stands(found, thresholds, count + 1, name) for name in added):
            break
        count += 1
    return count


def _stands(found: SearchResult, thresholds: Thresholds, step: int, name: str) -> bool:
    """Whether a name is many times beyond its gate, holds on left-out windows, and leaves its own channels quiet.

    What borrows the name of something else leaves the rest of it in the channels in which it acts.

    Args:
        found: by the search.
        thresholds: of the null bank.
        step: that added the name, from 1.
        name: of an effect.
    """
    before, after = found.models[step - 1 : step + 1]
    gain, gate = _gain(found, step - 1, name), further_gates(thresholds, found.models[:step]).of(name).gain
    if gain < _MANY * gate or before.held_out.get(name, 0.0) < _HOLDS * gain:
        return False
    limits = {channel: _MUCH * limit for channel, limit in thresholds.misfit.items()}
    shares = _channel_shares(before, after)
    return sum(v for channel, v in shares.items() if after.misfit[channel] <= limits.get(channel, math.inf)) > _OWN


def _verdict(found: SearchResult, seen: Sequence[str], thresholds: Thresholds) -> tuple[tuple[str, ...], bool]:
    """Three values: named and complete, named but incomplete, none of these; or nothing at all.

    What was seen in the values themselves (repeats, exchanged channels, a reversed gyro) stays named whatever else is
    left.

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
