"""What is published of a learned estimator: its network, the record of its training with a picture, and a card."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from agents.velocity_drives import WIDE, Plan
from agents.velocity_training import ESTIMATED, Variant, VelocityTraining
from ddagr_gym.estimation.learned_inputs import SENSOR_INPUTS
from ddagr_gym.estimation.learned_network import VelocityNetwork, save_network
from ddagr_gym.files import atomic_path, make_folder, write_json, write_text
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style


def publish_estimator(training: VelocityTraining, network: VelocityNetwork, plan: Plan, folder: Path) -> None:
    """Write ``folder``: network.npz, training.json, training.png, README.md."""
    make_folder(folder)
    save_network(network, folder / "network.npz")
    record: dict[str, Any] = {
        "name": training.name,
        "settings": asdict(training.settings),
        "plan": asdict(plan),
        "calibration": network.description.calibration,
        "seconds": round(training.seconds),
        "device": training.device,
        "course": training.course,
    }
    if training.settings.wide:
        record["wide_plan"] = asdict(WIDE)
    write_json(folder / "training.json", record)
    draw_training(record, folder / "training.png")
    write_text(folder / "README.md", card(record, training.variant))


def draw_training(record: dict[str, Any], path: Path) -> None:
    """Errors and coverage on the validation turns over training; PNG."""
    course = record["course"]
    passes = range(1, len(course) + 1)
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(7.4, 3.0), layout="constrained")
        errors, covered = figure.subplots(1, 2)
        colours = (palette.BLUE, palette.ORANGE, palette.GREEN, palette.PURPLE)
        for (name, unit), colour in zip(ESTIMATED, colours, strict=True):
            if f"{name}_covered" not in course[0]:
                continue
            for kind, style, label in (("median", "-", name), ("rmse", ":", f"{name}, root mean square")):
                errors.plot(
                    passes, [entry[f"{name}_{kind}_{unit}"] for entry in course], style, color=colour, label=label
                )
            covered.plot(passes, [100.0 * entry[f"{name}_covered"] for entry in course], color=colour, label=name)
        errors.set(xlabel="passes over the turns", title="error on validation [mm/s; mm], median", yscale="log")
        errors.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        covered.axhline(90.0, color=palette.VERMILLION, linestyle=(0, (4, 2)), linewidth=1.0)
        covered.set(xlabel="passes over the turns", title="covered of 90 % [%], before calibration")
        figure.legend(*errors.get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
        with atomic_path(path) as temporary:
            figure.savefig(temporary, dpi=130.0, metadata={"Software": None})


def card(record: dict[str, Any], variant: Variant) -> str:
    """Card in Markdown.

    Args:
        record: of the training; ``turns`` in words where they are not those of the settings.
        variant: that was trained.
    """
    drawn = [] if len(record["course"]) < 2 else ["![Course of training](training.png)", ""]
    return "\n".join(
        [
            f"# {record['name']}: learned estimator that {variant.description}",
            "",
            f"A recurrent network (gated recurrent units) that estimates forward speed and side slip"
            f"{' and the place' if variant.place else ''} of a DDAGR robot in a row turn, with their covariance, from "
            "gyro, accelerometer, encoders and commands. It learnt from simulated turns alone and has never seen a "
            "robot's own recording.",
            "",
            "## Use",
            "",
            "```python",
            f"from ddagr_gym.estimation import LearnedModel, {'reckoned_track, ' if variant.place else ''}"
            "run_learned_filter",
            "from ddagr_gym.parameters import Sensors",
            "from ddagr_gym.presets import ddagr",
            "",
            f'model = LearnedModel.of(ddagr(), Sensors(), "{record["name"]}")',
            "states, velocities, covariances = run_learned_filter(model, columns)",
            *(["poses = reckoned_track(model, columns)"] if variant.place else []),
            "```",
            "",
            "`network.npz` holds weights, normalisation and a JSON description, no pickle; numpy runs it.",
            "",
            "## What it sees",
            "",
            _inputs(variant),
            "",
            "## How it was trained",
            "",
            *_training(record),
            "",
            "## Validation",
            "",
            _validation(record, variant),
            "",
            *drawn,
            "## Limits",
            "",
            "It knows this robot, these sensors at 125 Hz and commands every ten samples. Slopes, soil that changes "
            "and scaled lateral forces were in its training; another law of the soil was not. Where it fails, and how "
            "it compares with the filters, is in `benchmarks/results/learned_estimator.json` and "
            "`docs/results/filter.md`.",
            "",
        ]
    )


def _inputs(variant: Variant) -> str:
    filtered = (
        "" if variant.inputs == SENSOR_INPUTS else ", and the inertial filter's state, deviations and innovations"
    )
    carried = ", and the pose that it carries" if variant.place else ""
    return (
        f"{len(variant.inputs)} inputs every 0.08 s: means of the last ten samples' halves (25 Hz), commands, heading "
        f"by the gyro, means over the rest before the drive{filtered}{carried}."
    )


def _training(record: dict[str, Any]) -> list[str]:
    """Lines of a list."""
    settings, plan = record["settings"], record["plan"]
    layers = settings.get("layers", 1)
    units = f"{settings['units']} units" if layers == 1 else f"{layers} layers of {settings['units']} units"
    turns = record.get("turns", _turns(settings))
    device = "a GPU" if record.get("device", "cpu") == "cuda" else "a CPU core"
    return [
        f"- {turns} No scenario of a frozen set took part.",
        "- Driven by B6 (60 %), B4 (25 %) and two constant speeds (15 %), their gains times a half to two, their "
        "commands wandering in most turns; 0.3 to 1.3 s of standing first.",
        f"- Shares of turns: {_shares(plan)}. Slopes up to 6 degrees, lateral forces x 0.75 to 1.3, strength and "
        "stiffness x 0.6 to 1.6 from some time on, dead time up to 0.25 s, mass x 0.9 to 1.25, variation of the "
        "soil up to 10 %.",
        *_wide_turns(record),
        *_beginning(settings),
        f"- Gaussian likelihood of each pair with its correlation; {units}, "
        f"{settings['epochs']} passes, seed {settings['seed']}; turns mirrored at random; "
        f"{record['seconds']} seconds of {device}.",
    ]


def _beginning(settings: dict[str, Any]) -> list[str]:
    """Line on the network that a training goes on from, where there is one."""
    if not settings.get("begun"):
        return []
    return [
        f"- It began with the weights of `{settings['begun']}`, at a learning rate of {settings['learning_rate']:g}."
    ]


def _shares(plan: dict[str, float]) -> str:
    """Shares of turns that differ from the task, in words."""
    return ", ".join(f"{key.replace('_', ' ')} {100.0 * value:.0f} %" for key, value in plan.items() if value)


def _wide_turns(record: dict[str, Any]) -> list[str]:
    """Line on the turns of the wide plan, where there are some."""
    if "wide_plan" not in record:
        return []
    return [
        f"- Of the wide turns: {_shares(record['wide_plan'])}. Motors of 40 to 200 N m a bank, payloads of 5 to 50 kg "
        "at a place on the platform, patches of strength x 0.5 to 1.6, one side stronger by up to a third, ruts, slip "
        "sinkage or soil pushed aside."
    ]


def _turns(settings: dict[str, Any]) -> str:
    """Turns that a training learnt from, by its settings."""
    seed, near, wide = settings["root_seed"], settings.get("near", 0), settings.get("wide", 0)
    further = f" {near} more are of the task as it is, of the seed {seed + 1}." if near else ""
    if wide:
        further += (
            f" {wide} more are of robots, grounds and sensors that differ more, of the seed {seed + 2}; the next "
            f"{settings['validation']} of these are validation, too."
        )
    return (
        f"{settings['turns']} simulated turns, numbers 0 to {settings['turns'] - 1} of the seed {seed}; the next "
        f"{settings['validation']} are its validation.{further}"
    )


def _validation(record: dict[str, Any], variant: Variant) -> str:
    last = record["course"][-1]
    told = [(name, unit, unit.replace("_", "/")) for name, unit in ESTIMATED[: 4 if variant.place else 2]]
    errors = ", ".join(
        f"{name} {last[f'{name}_rmse_{unit}']:.1f} {text} (median {last[f'{name}_median_{unit}']:.1f})"
        for name, unit, text in told
    )
    covered = ", ".join(f"{100 * last[f'{name}_covered']:.0f}" for name, _, _ in told)
    factors = ", ".join(f"{factor:.2f}" for factor in record["calibration"])
    settings = record["settings"]
    count = settings["validation"] * (2 if settings.get("wide") else 1)
    return (
        f"On {count} turns of the same draws, while driving: {errors}; of 90 % intervals "
        f"{covered} % were covered. Calibrated by the factors {factors} on the deviations, with which 90 % are covered "
        "on these turns. Root mean squares are those of the few turns on which the robot gets stuck or the filter "
        "diverges."
    )
