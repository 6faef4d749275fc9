"""From recordings to a verdict: the steps in their order."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ddagr_gym.diagnosis.held import Held, find_held, hold_effect, without_repeats
from ddagr_gym.diagnosis.misfit import roughest
from ddagr_gym.diagnosis.problem import Problem
from ddagr_gym.diagnosis.search import Found, Standing, bootstrap_weights, search
from ddagr_gym.diagnosis.setting import Setting, make_problem
from ddagr_gym.diagnosis.thresholds import Thresholds
from ddagr_gym.diagnosis.uncertainty import intervals, least_detectable, resampled_parameters
from ddagr_gym.diagnosis.verdict import NONE, UNKNOWN, Diagnosis, Estimate, Finding
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.physics.effects import Effect
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.version import __version__

EQUIVALENT = 0.05
"""Weight that a rival needs to stand in the equivalence set (ours, with the level)."""

_NEAR = 0.7
"""Share of the best joint gain below which a rival is not compared (ours: far beyond what resampling moves)."""


def diagnose(
    robot: Robot,
    soil: Soil,
    recordings: Sequence[Recording],
    thresholds: Thresholds,
    rng: np.random.Generator,
    setting: Setting | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> tuple[Diagnosis, tuple[Effect, ...]]:
    """Diagnose recordings of one robot on one soil.

    Args:
        robot: nominal.
        soil: nominal.
        recordings: at least one, of one period.
        thresholds: of the null bank.
        rng: of the resampling.
        setting: choices.
        progress: called with each step.

    Returns:
        The diagnosis, and the effects that it names with their fitted sizes.
    """
    began = time.monotonic()
    setting = Setting() if setting is None else setting
    held = find_held(recordings)
    clean = [without_repeats(recording, held) for recording in recordings] if held else list(recordings)
    problem = make_problem(robot, soil, clean, setting)
    found = search(problem, thresholds, progress=progress)
    progress("doubt")
    findings = [*_held_findings(held), *_findings(problem, found, thresholds, rng)]
    verdict, complete = _verdict(found, [f.name for f in findings], thresholds)
    effects = (*((hold_effect(held),) if held else ()), *found.chosen.fitted.point.effects)
    values = found.chosen.fitted.point.values
    diagnosis = Diagnosis(
        verdict,
        complete,
        tuple(findings),
        _sentence(verdict, complete, findings),
        {"nominal": found.nominal.misfit, "corrected": found.chosen.misfit, "limit": dict(thresholds.misfit)},
        least_detectable(found.nominal.terms, thresholds, found.nominal.dispersion),  # type: ignore[arg-type]
        {p.name: float(v) for p, v in zip(problem.nuisances.parameters, values, strict=True) if p.prior > 0.0},
        tuple(recording.meta.source for recording in recordings),
        {"nulls": thresholds.nulls, "bank": thresholds.bank, "level": thresholds.level},
        time.monotonic() - began,
        __version__,
    )
    return diagnosis, effects if verdict != (UNKNOWN,) else ()


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


def _findings(problem: Problem, found: Found, thresholds: Thresholds, rng: np.random.Generator) -> list[Finding]:
    """One finding per effect of the chosen model."""
    chosen = found.chosen
    if not chosen.names:
        return []
    parameters, draws = resampled_parameters(problem, chosen.fitted, rng)
    bounds = intervals(draws)
    findings = []
    for number, effect in enumerate(chosen.fitted.point.effects):
        spread = {p.field: b for p, b in zip(parameters, bounds, strict=True) if p.effect == number}
        before = _before(found, effect.name)
        gain = next(item for item in before.gains if item.name == effect.name)
        estimates = {
            name: Estimate(float(getattr(effect, name)), str(effect.parameter(name).metadata["unit"]), spread.get(name))
            for name in (*effect.size_names(), *effect.shape_names())
        }
        findings.append(
            Finding(
                effect.name,
                estimates,
                gain.gain,
                thresholds.of(effect.name).gain,
                before.scores[effect.name],
                before.held_out.get(effect.name, 0.0),
                _channel_shares(found.nominal, chosen),
                _equivalents(before, found, effect.name, rng),
            )
        )
    return findings


def _before(found: Found, name: str) -> Standing:
    """The last model of the search that lacks an effect."""
    return next(s for s in reversed(found.standings) if name not in s.names)


def _equivalents(before: Standing, found: Found, name: str, rng: np.random.Generator) -> dict[str, float]:
    """Names that explain nearly as much, with their weights."""
    best = next(item.gain for item in before.gains if item.name == name)
    near = [item.name for item in before.gains if item.gain > _NEAR * best]
    names = list(dict.fromkeys([name, *near]))
    weights = bootstrap_weights(before.terms, names, rng)
    kept = {key: value for key, value in weights.items() if value >= EQUIVALENT or key == name}
    total = sum(kept.values())
    return {key: value / total for key, value in kept.items()} if total > 0.0 else {name: 1.0}


def _channel_shares(nominal: Standing, chosen: Standing) -> dict[str, float]:
    """Share of each channel in the fall of the misfit; channels that got worse have none."""
    falls = {name: max(value - chosen.misfit.get(name, value), 0.0) for name, value in nominal.misfit.items()}
    total = sum(falls.values())
    return {name: fall / total for name, fall in falls.items() if total > 0.0 and fall > 0.01 * total}


def _verdict(found: Found, names: Sequence[str], thresholds: Thresholds) -> tuple[tuple[str, ...], bool]:
    """Three values: named and complete, named but incomplete, none of these; or nothing at all."""
    _, left = roughest(found.chosen.misfit, dict(thresholds.misfit))
    complete = left <= 1.0 and not any(thresholds.passes(g.name, g.gain, found.chosen) for g in found.chosen.gains)
    if not names:
        return ((NONE,), True) if complete else ((UNKNOWN,), False)
    _, before = roughest(found.nominal.misfit, dict(thresholds.misfit))
    explained = (before - left) / (before - 1.0) if before > 1.0 else 1.0
    if left > 1.0 and explained < 0.5:
        return (UNKNOWN,), False
    return tuple(names), complete


def _sentence(verdict: tuple[str, ...], complete: bool, findings: Sequence[Finding]) -> str:
    """The answer in words."""
    if verdict == (NONE,):
        return "Nothing is missing that these recordings can show."
    if verdict == (UNKNOWN,):
        return "Something is missing that no effect of the library explains."
    parts = [f"{finding.name} ({_main(finding.parameters)})" for finding in findings]
    rest = "nothing else above what these data can show" if complete else "and something more that has no name here"
    return f"Missing: {', '.join(parts)}; {rest}."


def _main(parameters: Mapping[str, Estimate]) -> str:
    name, estimate = next(iter(parameters.items()))
    text = f"{name} {estimate.value:.3g}"
    if estimate.interval is not None:
        text += f" [{estimate.interval[0]:.3g}, {estimate.interval[1]:.3g}]"
    return text if estimate.unit == "-" else f"{text} {estimate.unit}"
