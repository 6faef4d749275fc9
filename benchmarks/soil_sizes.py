"""Whether intervals of a soil's strength and stiffness hold the truth, and those of what both do under a wheel.

    python -m benchmarks.soil_sizes [--summary]

Drives of a minute over two soils (:mod:`benchmarks.soil_size_drives`): of the package's simulator on three soils, and
of the concealed benchmark's simulator with one of its structural differences, over soil that differs from side to side
or changes in mid-drive. The effect that is there is fitted beside robot and soil, from no difference on.
*Before* are intervals by the fit's own derivatives, as they were stated until now; *now* those of a diagnosis. Drives
in which the effect gains less than 20 over the noise, so that no diagnosis names it, are counted apart.

The constants of :mod:`ddagr_gym.diagnosis.result.factor_sizes` and
:mod:`ddagr_gym.diagnosis.result.soil_at_work` were chosen on other drives of the second simulator.

Written are the answers and a picture (``benchmarks/results/soil_sizes.json``, ``.png``); a run goes on after the drives
that the file holds. Six minutes of one core.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.soil_size_drives import OTHER, OWN, ROBOT, TwoSoils, changed_drive, own_drive, split_drive, start_of
from ddagr_gym.diagnosis.result.soil_at_work import soil_at_work
from ddagr_gym.diagnosis.result.uncertainty import (
    FORM,
    STRUCTURE,
    intervals,
    resampled,
    resampled_parameters,
    with_structure,
)
from ddagr_gym.diagnosis.setting import Setting, make_problem
from ddagr_gym.evaluation.statistics import wilson_interval
from ddagr_gym.files import write_json
from ddagr_gym.identification.effect_parameters import effect_parameters
from ddagr_gym.identification.gauss_newton import Fitted, fit, linearised
from ddagr_gym.identification.misfit import dispersion_of
from ddagr_gym.identification.problem import Problem
from ddagr_gym.physics.effects import Effect
from ddagr_gym.presets import get_robot
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

RESULT = Path(__file__).resolve().parent / "results" / "soil_sizes.json"
SIZES = ("strength", "stiffness")
SEED = 0
TICKS = {"strength": (0.5, 0.7, 1.0, 1.4), "stiffness": (0.2, 0.5, 1.0, 2.0, 5.0)}
"""Of the picture, over the truth."""
NAMED = 20.0
"""Gain over the noise from which a diagnosis may name the effect: its gates are 20 and more."""


def drives() -> list[Callable[[], TwoSoils]]:
    """All drives in their order, kinds in turn."""
    found: list[Callable[[], TwoSoils]] = []
    for number in range(6):
        found += [partial(split_drive, 2 * number), partial(split_drive, 2 * number + 1), partial(own_drive, number)]
        found += [partial(changed_drive, number // 2)] if number % 2 else []
    return found


def answer(drive: TwoSoils) -> dict[str, Any]:
    """What is said of a drive beside the truth, as JSON has it."""
    began = time.monotonic()
    problem = make_problem(get_robot(ROBOT), drive.soil, [drive.recording], Setting())
    fitted = _fitted(problem, start_of(drive))
    without = fit(problem, replace(fitted.point, effects=()), reuse=fitted, iterations=6)
    draws = resampled_parameters(problem, fitted, np.random.default_rng(SEED))
    effect = fitted.point.effects[0]
    before = _before(problem, fitted)
    now = {name: with_structure(intervals(draws.of(0, name)[:, None])[0], effect, name) for name in SIZES}
    soil = soil_at_work(problem, drive.soil, fitted, 0, draws)
    if soil is None:
        raise RuntimeError(f"{drive.name} has no working point")
    first, second = drive.wheels(soil.point)
    return {
        "drive": drive.name,
        "simulator": drive.simulator,
        "effect": effect.name,
        "structure": drive.structure,
        "gain": (without.cost - fitted.cost) / dispersion_of(problem, fitted),
        "correlation": soil.correlation,
        "told_apart": soil.told_apart,
        "sizes": {
            name: {
                "truth": getattr(drive.truth, name),
                "value": getattr(effect, name),
                "before": before[name],
                "now": now[name],
            }
            for name in SIZES
        },
        "point": asdict(soil.point),
        "quantities": {
            item.name: {"truth": [first[k], second[k]], **asdict(item)} for k, item in enumerate(soil.quantities)
        },
        "seconds": round(time.monotonic() - began, 1),
    }


def _fitted(problem: Problem, start: Effect) -> Fitted:
    """A fit from no difference on, to the end."""
    first = fit(problem, replace(problem.start(), effects=(start,)), iterations=14, renewals=3)
    return first if first.converged else fit(problem, first.point, first=first, iterations=12, renewals=12)


def _before(problem: Problem, fitted: Fitted) -> dict[str, tuple[float, float]]:
    """Intervals as they were stated before: by the fit's own derivatives, sizes as they are."""
    parameters, effect = effect_parameters(fitted.point.effects), fitted.point.effects[0]
    draws = resampled(linearised(problem, fitted), np.random.default_rng(SEED))[:, -len(parameters) :]
    found = {}
    for item, (low, high) in zip(parameters, intervals(draws), strict=True):
        if item.field not in SIZES:
            continue
        value, least = getattr(effect, item.field), effect.parameter(item.field).metadata["least"]
        wide = float(np.hypot(0.5 * (high - low), np.hypot(STRUCTURE * least, FORM * (value - 1.0))))
        middle = 0.5 * (low + high)
        found[item.field] = (
            min(max(middle - wide, min(item.low, low)), value),
            max(min(middle + wide, max(item.high, high)), value),
        )
    return found


def summary(answers: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Shares of intervals that hold the truth, of the drives in which the effect may be named."""
    named = [item for item in answers if item["gain"] >= NAMED]
    parts = {"all": named, **{kind: [item for item in named if item["simulator"] == kind] for kind in (OWN, OTHER)}}
    return {"not_named": len(answers) - len(named)} | {name: _coverage(part) for name, part in parts.items()}


def _coverage(answers: Sequence[dict[str, Any]]) -> dict[str, Any]:
    held: dict[str, list[bool]] = {}
    for item in answers:
        for name, size in item["sizes"].items():
            for when in ("before", "now"):
                held.setdefault(f"{name} {when}", []).append(_holds(size[when], size["truth"]))
                held.setdefault(f"both sizes {when}", []).append(_holds(size[when], size["truth"]))
        for name, entry in item["quantities"].items():
            first, second = entry["truth"]
            for value, interval in ((first, "first_interval"), (second, "second_interval")):
                held.setdefault(f"{name} value", []).append(_holds(entry[interval], value))
            if entry["change_interval"] is not None:
                held.setdefault(f"{name} change", []).append(_holds(entry["change_interval"], first / second - 1.0))
    return {"drives": len(answers)} | {name: _share(hits) for name, hits in held.items()}


def _holds(interval: Sequence[float], truth: float) -> bool:
    return bool(interval[0] <= truth <= interval[1])


def _share(hits: Sequence[bool]) -> dict[str, Any]:
    found = wilson_interval(sum(hits), len(hits))
    return {"held": sum(hits), "count": len(hits), "share": sum(hits) / len(hits), "interval": [found.low, found.high]}


def draw(answers: Sequence[dict[str, Any]], path: Path) -> None:
    """Intervals around the truth, before and now: of both sizes, and of the difference in traction."""
    from matplotlib.figure import Figure

    shown = [item for item in reversed(answers) if item["gain"] >= NAMED]
    with house_style():
        figure = Figure(figsize=(11.0, 1.2 + 0.3 * len(shown)), layout="constrained")
        panels = figure.subplots(1, 3, sharey=True)
        for place, item in enumerate(shown):
            for axis, name in zip(panels, SIZES, strict=False):
                size = item["sizes"][name]
                _bar(axis, place + 0.15, np.array(size["before"]) / size["truth"], 2.0, 0.45)
                _bar(axis, place - 0.15, np.array(size["now"]) / size["truth"], 4.0, 0.8)
            entry = item["quantities"]["traction"]
            truth = entry["truth"][0] / entry["truth"][1] - 1.0
            _bar(panels[2], place, 100.0 * (np.array(entry["change_interval"]) - truth), 4.0, 0.8, 0.0)
        for axis, name in zip(panels, SIZES, strict=False):
            axis.set_xscale("log")
            ticks = TICKS[name]
            axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
            axis.set_xticks([], minor=True)
            axis.axvline(1.0, color=palette.INK, lw=0.9)
            axis.set_xlabel(f"{name} over the true one")
        panels[2].axvline(0.0, color=palette.INK, lw=0.9)
        panels[2].set_xlabel("difference in traction less the true one [%]")
        figure.suptitle("90 % intervals: thin before, thick now; orange where the truth lies outside", fontsize=9)
        panels[0].set_yticks(range(len(shown)), [_label(item) for item in shown], fontsize=7)
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=110))


def _bar(axis: Any, place: float, ends: Any, width: float, alpha: float, truth: float = 1.0) -> None:
    colour = palette.BLUE if ends[0] <= truth <= ends[1] else palette.VERMILLION
    axis.plot(ends, [place, place], lw=width, alpha=alpha, solid_capstyle="butt", color=colour)


def _label(item: dict[str, Any]) -> str:
    kind = "side to side" if item["effect"] == "soil_split" else "in mid-drive"
    return f"{item['drive'].rsplit(' ', 1)[-1]}, {kind}, {item['structure'] or 'plain'}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Drive, fit and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--summary", action="store_true", help="only figures and picture of the drives in the file")
    given = parser.parse_args(arguments)
    answers: list[dict[str, Any]] = json.loads(RESULT.read_text())["drives"] if RESULT.exists() else []
    for make in drives()[len(answers) :] if not given.summary else []:
        answers.append(answer(make()))
        _write(answers)
        print(answers[-1]["drive"], f"gain {answers[-1]['gain']:.0f}", f"{answers[-1]['seconds']:.0f} s", flush=True)
    _write(answers)
    draw(answers, RESULT.with_suffix(".png"))


def _write(answers: Sequence[dict[str, Any]]) -> None:
    write_json(
        RESULT, {"command": "python -m benchmarks.soil_sizes", "summary": summary(answers), "drives": list(answers)}
    )


if __name__ == "__main__":
    main()
