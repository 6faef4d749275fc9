"""The answer of a comparison: verdict, findings with intervals, shifts and least detectable changes of every effect."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ddagr_gym.diagnosis.answer.change import (
    BEFORE,
    CALIBRATION,
    Change,
    ChangeCertificate,
    ChannelShift,
    EffectShift,
    ParameterShift,
    SizeShift,
    SlopeBefore,
)
from ddagr_gym.diagnosis.answer.verdict import NONE, UNKNOWN, Diagnosis, Estimate, Finding, GatesUsed, Options
from ddagr_gym.diagnosis.change.drive_scan import NAMED, NOT_COMPARED
from ddagr_gym.diagnosis.change.ground_slope import GroundSlope
from ddagr_gym.diagnosis.change.left_out import probability_of_ordinary
from ddagr_gym.diagnosis.change.model import FORM, Model
from ddagr_gym.diagnosis.change.naming import Named, Step
from ddagr_gym.diagnosis.change.ordinary import OrdinaryRobot
from ddagr_gym.diagnosis.change.refitted_shift import further_sizes
from ddagr_gym.diagnosis.change.shifts import LEVEL, POWER, Pull, Shift, family_probability
from ddagr_gym.diagnosis.preprocessing.mended_recordings import MendedRecordings
from ddagr_gym.diagnosis.result.conclusion import data_source, reversed_gyro_findings
from ddagr_gym.diagnosis.result.sentences import change_headline
from ddagr_gym.diagnosis.result.uncertainty import student_quantile
from ddagr_gym.diagnosis.search.candidates import moved_field
from ddagr_gym.identification.effect_parameters import effect_parameters
from ddagr_gym.identification.misfit import channel_misfit
from ddagr_gym.identification.problem import Problem
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.gyro_sign import GyroSign
from ddagr_gym.physics.effects.sensor_hold import SensorHold
from ddagr_gym.physics.layout import POINT_READINGS
from ddagr_gym.version import __version__


def conclude_change(
    problem: Problem,
    mended: MendedRecordings,
    ordinary: OrdinaryRobot,
    ground: str,
    named: Named,
    certified: ChangeCertificate | None = None,
) -> tuple[Diagnosis, tuple[Effect, ...]]:
    """The answer, without checks of the data and time, and the effects that it names beside what drives before had.

    Args:
        problem: of the drives.
        mended: the drives.
        ordinary: calibrated robot.
        ground: that they were taken to be on; "" where it was not known.
        named: what changed.
        certified: forecasts of windows that were left out.
    """
    turned = mended.reversed_gyro is not None and not _usually_reversed(ordinary)
    seen = tuple(reversed_gyro_findings(mended.reversed_gyro)) if turned else ()
    findings = (*seen, *(_finding(named, k) for k in range(len(named.steps))))
    complete = named.complete and not (ground and forecast_badly(named, certified))
    verdict = tuple(item.name for item in findings) or ((NONE,) if complete else (UNKNOWN,))
    change = _change(problem, ordinary, ground, named, certified)
    diagnosis = Diagnosis(
        verdict,
        complete,
        findings,
        change_headline(verdict, complete, findings, change),
        {
            "nominal": channel_misfit(problem, named.models[0].fitted),
            "corrected": channel_misfit(problem, named.models[-1].fitted),
            "limit": {item.channel: item.limit for item in change.channels},
        },
        {item.effect: {name: size.least_detectable for name, size in item.sizes.items()} for item in change.shifts},
        {item.name: item.with_effects for item in change.parameters},
        tuple(recording.meta.source for recording in mended.recordings),
        GatesUsed(
            nulls=len(ordinary.references), bank=ordinary.digest, level=LEVEL, robot=ordinary.robot.name,
            soil=ground or None, kind="ordinary",
        ),
        0.0,
        __version__,
        data=tuple(data_source(recording) for recording in mended.given),
        robot=ordinary.robot.name,
        soil=ground,
        options=Options(window=ordinary.weighing.window, robot_file=ordinary.source or None),
        change=change,
    )  # fmt: skip
    effects = (*((GyroSign(1.0),) if turned else ()), *named.models[-1].fitted.point.effects)
    return diagnosis, effects if ordinary.slope is None else ordinary.slope.with_named(effects)


def forecast_badly(named: Named, certified: ChangeCertificate | None) -> bool:
    """Whether forecasts with what is named stay worse than ordinary drives have them: that is not all that changed.

    They are one test more beside those of effects, parameters and channels. Nothing is said where a name is about a
    sensor, by whose readings the forecasts start.

    Args:
        named: what changed, against drives on the same ground.
        certified: forecasts; None where those of ordinary drives are not known.
    """
    last = named.models[-1]
    points = {point for effect in last.fitted.point.effects for point, _ in effect.acting}
    if certified is None or not named.steps or POINT_READINGS in points:
        return False
    return family_probability(probability_of_ordinary(certified), last.tests + 1) < LEVEL


def _usually_reversed(ordinary: OrdinaryRobot) -> bool:
    """Whether most ordinary drives have a reversed gyro."""
    return 2 * sum(item.reversed_gyro for item in ordinary.references) > len(ordinary.references)


def _finding(named: Named, number: int) -> Finding:
    """The finding of one step; its sizes are those of the last model."""
    step, before, last = named.steps[number], named.models[number], named.models[-1]
    effect = last.fitted.point.effects[number]
    evidence = _evidence(before, step)
    return Finding(
        effect.name,
        _estimates(last, number, step),
        0.5 * evidence.distance**2,
        0.5 * evidence.limit(before.tests) ** 2,
        evidence.distance,
        math.nan,
        {},
        dict(step.weights),
        calibrated_p=before.probability(evidence),
    )


def _evidence(before: Model, step: Step) -> Shift | Pull:
    """What spoke for an effect: its shift, that of a rival which explains less, or of a parameter that took it over."""
    if step.alarm is not None:
        return step.alarm
    if before.probability(step.shift) < LEVEL or not before.pulled:
        return step.shift
    return max(before.pulled, key=lambda pull: pull.distance)


def _estimates(model: Model, number: int, step: Step) -> dict[str, Estimate]:
    """Sizes and shapes of a named effect, as changes against ordinary drives, with 90 % intervals."""
    effect = model.fitted.point.effects[number]
    ordinary, between = _in_ordinary(step.shift)
    beyond = _without_size_prior(model)
    quantile = student_quantile(step.shift.degrees)
    found = {}
    for name in (*effect.size_names(), *effect.shape_names()):
        further, within = beyond.get((number, name), (0.0, math.nan))
        value = float(getattr(effect, name)) + further - ordinary.get(name, 0.0)
        neutral = effect.parameter(name).metadata["neutral"]
        form = 0.0 if neutral is None else FORM * (value - neutral)
        variance = within + between.get(name, 0.0) + form**2
        half = quantile * math.sqrt(variance) if variance >= 0.0 else math.nan
        found[name] = _that_exists(effect, name, value, half if effect.differentiable else math.nan)
    return found


def _that_exists(effect: Effect, name: str, value: float, half: float) -> Estimate:
    """A size with its interval, inside the bounds of what exists; no interval where half of it is not known."""
    about = effect.parameter(name).metadata
    value, low, high = np.clip((value, value - half, value + half), about["low"], about["high"]).tolist()
    return Estimate(value, str(about["unit"]), (low, high) if math.isfinite(half) else None)


def _in_ordinary(shift: Shift) -> tuple[dict[str, float], dict[str, float]]:
    """By field, what ordinary drives show of an effect, and the variance between them."""
    candidate = shift.compared.candidate
    if not candidate.has_sizes or candidate.is_direction:
        return {}, {}
    mean: dict[str, float] = {}
    variance: dict[str, float] = {}
    for k, probe in enumerate(candidate.probes):
        name, _, away = moved_field(probe)
        mean[name] = mean.get(name, 0.0) + float(shift.mean[k] * away)
        variance[name] = variance.get(name, 0.0) + float(shift.between[k, k] * away**2)
    return mean, variance


def _without_size_prior(model: Model) -> dict[tuple[int, str], tuple[float, float]]:
    """How much further the drive alone moves fields of named effects, and their variances within it.

    A fit draws sizes to what is likely of them, which a change that the drive knows is not to be judged by. What is
    known to be present in a part of the drives is taken against the rest of them.
    """
    parameters = effect_parameters(model.fitted.point.effects)
    keys = [f"{NAMED}{k}" for k in range(len(parameters))]
    if not keys:
        return {}
    found: dict[tuple[int, str], tuple[float, float]] = {}
    effects = model.fitted.point.effects
    scores = model.scan.scores()
    for k, item in enumerate(parameters):
        apart = model.named[item.effect].apart
        size = further_sizes(scores, [keys[k]], apart) or further_sizes(scores, [keys[k]], apart=False)
        if size is not None:
            here = float(getattr(effects[item.effect], item.field))
            further = float(np.clip(here + size.value[0], item.low, item.high)) - here
            found[item.effect, item.field] = further, float(size.within[0, 0])
    return found


def _change(
    problem: Problem, ordinary: OrdinaryRobot, ground: str, named: Named, certified: ChangeCertificate | None
) -> Change:
    first, last = named.models[0], named.models[-1]
    shifts = _effect_shifts(first, named.farther)
    parameters = tuple(
        ParameterShift(p.name, p.unit, float(a), float(b), p.prior)
        for p, a, b in zip(
            problem.nuisances.parameters, first.fitted.point.values, last.fitted.point.values, strict=True
        )
    )
    hidden = tuple(item.effect for item in shifts if all(size.least_detectable is None for size in item.sizes.values()))
    return Change(
        ground,
        tuple(item.drive for item in ordinary.references),
        LEVEL,
        POWER,
        problem.blocked.windows.count,
        shifts,
        parameters,
        hidden,
        _not_compared(ordinary, ordinary.comparison(ground).unnamed),
        BEFORE if ordinary.given else CALIBRATION,
        certified,
        _channel_shifts(first, last),
        _slope_before(ordinary.slope) if ordinary.slope and ground else None,
    )


def _slope_before(slope: GroundSlope) -> SlopeBefore:
    (lying,) = slope.effects
    return SlopeBefore(lying.angle, lying.direction, float(np.hypot(*slope.deviations)))


def _not_compared(ordinary: OrdinaryRobot, unnamed: Mapping[str, str]) -> Mapping[str, str]:
    """Effects that could not be named, with the reason; readings that repeat longer than before are seen in values."""
    seen = ordinary.usual_holds is not None
    never = {name: why for name, why in NOT_COMPARED.items() if not (seen and name == SensorHold.name)}
    return {**{name: why for name, why in unnamed.items() if name not in NOT_COMPARED}, **never}


def _channel_shifts(first: Model, last: Model) -> tuple[ChannelShift, ...]:
    before = {rise.channel: rise.misfit for rise in first.rises}
    return tuple(
        ChannelShift(rise.channel, rise.usual, before[rise.channel], rise.misfit, rise.most(last.tests))
        for rise in last.rises
    )


def _effect_shifts(model: Model, farther: Mapping[str, float]) -> tuple[EffectShift, ...]:
    """Shift of every effect, the most conspicuous first; the usual form stands for what is not conspicuous.

    Args:
        model: without effects.
        farther: of some effects, how many times as far as their first steps they go: so much larger must they be.
    """
    usual: dict[str, Shift] = {}
    known = {id(shift.compared): shift for shift in model.shifts}
    for item in model.scan.compared:
        if id(item) in known:
            usual.setdefault(item.name, known[id(item)])
    found = []
    for best in model.best:
        probability = model.probability(best)
        shown = best if probability < LEVEL else usual[best.compared.name]
        limit = best.limit(model.tests)
        name = best.compared.name
        sizes = _size_shifts(shown, model.tests, farther.get(name, 1.0))
        found.append(EffectShift(name, best.distance, limit, probability, best.degrees, sizes))
    return tuple(found)


def _size_shifts(shift: Shift, tests: int, farther: float) -> Mapping[str, SizeShift]:
    """By field; of a direction that which shows worst."""
    candidate, reach = shift.compared.candidate, farther * shift.detectable(tests)
    found: dict[str, SizeShift] = {}
    for k, probe in enumerate(candidate.probes):
        name, data, away = moved_field(probe)
        scale = abs(away) if probe.differentiable else 1.0
        deviation = float(np.sqrt(shift.covariance[k, k])) * scale
        value = float(shift.value[k]) * away if probe.differentiable else math.nan
        stated = _stated(shift, k, float(reach[k]))
        usual = float(shift.mean[k]) * away if probe.differentiable else math.nan
        item = SizeShift(value, deviation, str(data["unit"]), stated, usual)
        before = found.get(name)
        if before is None or _worse(item, before):
            found[name] = item
    return found


def _worse(item: SizeShift, other: SizeShift) -> bool:
    return other.least_detectable is not None and (item.least_detectable or math.inf) > other.least_detectable


def _stated(shift: Shift, k: int, multiple: float) -> float | None:
    """Least detectable size of a probe; None where none that exists would be found."""
    candidate, probe = shift.compared.candidate, shift.compared.candidate.probes[k]
    name, _, away = moved_field(probe)
    if candidate.whole is not None:
        return 1.0 if multiple <= candidate.whole else None
    if not probe.differentiable:
        return float(getattr(probe, name)) if multiple <= 1.0 else None
    return multiple * abs(away) if multiple * abs(away) <= probe.reach(name) else None
