"""What is published of an arm: the selected policy, its record as JSON and picture, and a model card."""

from __future__ import annotations

import json
import math
import shutil
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from agents.main import training_folder
from agents.run import POLICY
from agents.settings import TrainingSettings
from ddagr_gym.commands.output import write_text
from ddagr_gym.config import dump_config
from ddagr_gym.files import atomic_path, make_folder
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

AIMS = {"radius_error_median": 0.02, "radius_error_p95": 0.06, "success_rate": 0.98}
"""Of the project: median and 95th percentile of |e_R| at most, share of successes at least."""


_MOST_FAILURES = 0.05
"""Share of validation turns beyond which a model card warns (ours)."""


def rank(result: dict[str, Any]) -> float:
    """How far a training is from the aims on the validation set: the worst of its three ratios, 1 at the aims."""
    found = result["validation"]
    if found["radius_error_p95"] is None or found["radius_error_median"] is None:
        return math.inf
    return max(
        found["radius_error_median"] / AIMS["radius_error_median"],
        found["radius_error_p95"] / AIMS["radius_error_p95"],
        (1.0 - found["success_rate"]) / (1.0 - AIMS["success_rate"]),
    )


def publish(name: str, settings: TrainingSettings, results: list[dict[str, Any]], output: Path, folder: Path) -> None:
    """Write ``folder``: policy.npz, seeds/seed_<k>.npz, settings.yaml, training.json, training.png, README.md.

    Args:
        name: of the arm.
        settings: of the arm.
        results: of all its seeds.
        output: folder of the trainings.
        folder: to write.
    """
    make_folder(folder)
    selected = min(results, key=rank)
    for result in results:
        trained = training_folder(output, name, result["seed"]) / POLICY
        _copy(trained, folder / "seeds" / f"seed_{result['seed']}.npz")
        if result is selected:
            _copy(trained, folder / POLICY)
    write_text(folder / "settings.yaml", dump_config(settings))
    record = {"arm": name, "digest": settings.digest(), "selected_seed": selected["seed"], "trainings": results}
    write_text(folder / "training.json", json.dumps(record, indent=1) + "\n")
    draw_course(settings, results, folder / "training.png")
    write_text(folder / "README.md", card(name, settings, results, selected))


def _copy(source: Path, target: Path) -> None:
    with atomic_path(target) as temporary:
        shutil.copyfile(source, temporary)


def draw_course(settings: TrainingSettings, results: list[dict[str, Any]], path: Path) -> None:
    """Validation of every seed over training: median and 95th percentile of |e_R|, and success."""
    panels = (
        ("radius_error_median", "median |e_R| [%]"),
        ("radius_error_p95", "95th percentile |e_R| [%]"),
        ("success_rate", "success [%]"),
    )
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(7.4, 2.4), layout="constrained")
        for axes, (key, label) in zip(figure.subplots(1, 3), panels, strict=True):
            for result in results:
                course = result["course"]
                steps = [entry["steps"] / 1e6 for entry in course] + [result["steps"] / 1e6]
                # a policy that fails most turns has no percentile
                values = [entry[key] for entry in [*course, result["validation"]]]
                percent = [math.nan if value is None else 100.0 * value for value in values]
                axes.plot(steps, percent, color=palette.BLUE, alpha=0.55)
            axes.axhline(100.0 * AIMS[key], color=palette.VERMILLION, linestyle=(0, (4, 2)), linewidth=1.0)
            axes.set(xlabel="million control steps", title=label)
            _scale(axes, 103.0 if key == "success_rate" else None)
        seeds = f"{len(results)} seed{'s' if len(results) > 1 else ''}"
        figure.suptitle(f"{settings.description} ({seeds}; dashed: aim)", x=0.01, ha="left", fontsize=8.5)
        with atomic_path(path) as temporary:
            figure.savefig(temporary, dpi=130.0, metadata={"Software": None})


def _scale(axes: Any, top: float | None) -> None:
    """From zero to ``top``, to the data where it is None, and logarithmic where these span more than a decade."""
    found = np.concatenate([line.get_ydata() for line in axes.lines]).astype(float)
    found = found[np.isfinite(found) & (found > 0.0)]
    if top is None and found.max() > 10.0 * found.min():
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    else:
        axes.set_ylim(0.0, top)


def card(name: str, settings: TrainingSettings, results: list[dict[str, Any]], selected: dict[str, Any]) -> str:
    """Model card in Markdown."""
    design, task = settings.design, settings.task
    rows = [
        f"| {r['seed']}{' (shipped)' if r is selected else ''} | {_percent(r['validation']['radius_error_median'])} | "
        f"{_percent(r['validation']['radius_error_p95'])} | {_percent(r['validation']['success_rate'])} | "
        f"{r['cpu_seconds']:.0f} |"
        for r in results
    ]
    spread = ", ".join(f"{key} {value:g}" for key, value in asdict(task.randomisation).items())
    reward = ", ".join(f"{key} {value:g}" for key, value in asdict(task.reward).items())
    low, high = task.radius
    return "\n".join(
        [
            f"# {name}: {settings.description}",
            "",
            "A policy that turns a DDAGR robot from one strawberry row into the next on soft soil, trained in "
            "simulation only. It has never driven a robot.",
            *_warning(selected),
            "",
            "## Use",
            "",
            "```sh",
            f"ddagr evaluate --controllers B1,B4,{name} --scenarios S0",
            "```",
            "",
            "```python",
            "from ddagr_gym.policies.controller import policy_controller",
            "",
            f'controller = policy_controller("{name}")  # (observation, info) -> action; reset() before each episode',
            "```",
            "",
            "`policy.npz` holds weights, normalisation and a JSON description, no pickle; numpy runs it. The policies "
            f"of all seeds are in `seeds/`, by name `{name}_seed_0` and so on.",
            "",
            "## What it sees and does",
            "",
            f"- Inputs ({len(design.inputs)}, mirrored so that every turn is to the left, dimensionless): "
            f"{', '.join(design.frame_inputs)}{_history(settings)}.",
            f"- Outputs: {_outputs(settings)}",
            f"- An output changes by at most {design.rate_limit:g} per control step of 0.08 s.",
            "- It never sees the true pose, speed or soil.",
            "",
            "## How it was trained",
            "",
            f"- {settings.algorithm.upper()} (Stable-Baselines3), {settings.steps} control steps in "
            f"{settings.environments} environments; all numbers in `settings.yaml`, digest `{settings.digest()[:12]}`.",
            f"- Soils drawn from `{task.soil}`, R* {low:g} to {high:g} m, {task.speed[0]:g} to {task.speed[1]:g} m/s.",
            f"- Randomised per episode (standard deviations, SI or relative): {spread}.",
            f"- Reward weights (true state, training only): {reward}.",
            "",
            "## Validation",
            "",
            "On the frozen validation set V, without exploration. Failures count as worst. The shipped seed is the one "
            "whose worst ratio to the aims (median 2 %, 95th percentile 6 %, failures 2 %) is smallest; the sets S0 to "
            "S8 took no part.",
            "",
            "| seed | median abs(e_R) | 95th percentile | success | CPU seconds |",
            "|---|---|---|---|---|",
            *rows,
            "",
            "![Course of training](training.png)",
            "",
            "## Limits",
            "",
            "Soils, masses and motors far from those of the training are outside its experience; so are other robots. "
            "What it does there, and how it compares with controllers that need no training, is in the README and in "
            "`benchmarks/results/row_turns.json`, not in this table.",
            "",
        ]
    )


def _warning(selected: dict[str, Any]) -> list[str]:
    """A sentence on a policy that is no good, with the empty line before it."""
    share = 1.0 - selected["validation"]["success_rate"]
    if share <= _MOST_FAILURES:
        return []
    return [
        "",
        f"**Not for use:** it fails {100.0 * share:.0f} % of the validation turns and is kept as a record only.",
    ]


def _history(settings: TrainingSettings) -> str:
    design = settings.design
    return f"; {design.frames} instants, {design.frame_interval} control steps apart" if design.frames > 1 else ""


def _outputs(settings: TrainingSettings) -> str:
    design = settings.design
    if design.action == "absolute":
        return "speeds of the outer and the inner bank, over the robot's maximum."
    if design.features == "path":
        return (
            f"corrections of curvature (up to {design.curvature_scale:g}/R*) and of speed (up to "
            f"{100 * design.speed_scale:g} %) that the path tracker (B6) wants, feed-forward and feedback kept. "
            "`@feed_forward` after the name drives without the network."
        )
    base = (
        "the filter's estimate, for a curvature that follows a dead-reckoned reference (gains "
        f"{design.offset_gain:g} and {design.course_gain:g})"
        if design.needs_filter
        else "the nominal soil (the filter's prior)"
    )
    return (
        f"corrections of curvature (up to {design.curvature_scale:g}/R*) and of speed (up to "
        f"{100 * design.speed_scale:g} %) on the feed-forward, which is the force balance at {base}. "
        "`@feed_forward` after the name drives without the network."
    )


def _percent(value: float | None) -> str:
    if value is None:
        return "no radius"
    return f"{100 * value:.2f} %" if value < 2.0 else "more than 200 %"
