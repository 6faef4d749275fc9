"""Where is the next row by the inertial filter? Its velocities integrated as they come, and its own pose.

    python -m benchmarks.row_pose [--scenarios 100] [--plants level,slope_3,...] [--output FILE]

Turns of B6 on the development scenarios of :mod:`benchmarks.row_turn_plants`; both estimates are of the same filter on
the same readings, from the known start. Errors at the next row's start line along and across it and in heading, root
mean squares over turns that reach it; ratios of pose to integral over the same turns, with 95 % bootstrap intervals.
NEES: of the pose over 3, 1 for a consistent filter. About two minutes of one core. Writes ``results/row_pose.json`` and
a picture, ``row_pose.png``; ``--summary`` only makes the picture of the file.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.filter_study.summary import interval
from benchmarks.row_turn_plants import PLANTS, driven_on, plants_of, scenario
from benchmarks.velocity_bound.filters import placed_motion
from benchmarks.velocity_bound.study import exit_instant
from benchmarks.velocity_bound.summary import root_ratio
from ddagr_gym.control.timing import CONTROL_INTERVAL
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import (
    InertialModel,
    normalised_estimation_error,
    run_inertial_filter,
    run_inertial_track,
)
from ddagr_gym.evaluation.controllers import find_controller
from ddagr_gym.evaluation.runs import TurnRun, drive_turn
from ddagr_gym.files import write_json
from ddagr_gym.parameters import Sensors
from ddagr_gym.presets import ddagr
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

Array = NDArray[np.float64]

CONTROLLER = "B6"
"""That drives the turns."""
RESULT = Path(__file__).parent / "results" / "row_pose.json"
UNITS = {"along": ("mm", 1e3), "across": ("mm", 1e3), "heading": ("deg", float(np.degrees(1.0)))}
"""Errors at the next row: unit, and how many of it are 1 m or 1 rad."""


def judge(run: TurnRun) -> dict[str, Any] | None:
    """Squared errors (3,) at the next row [m^2, rad^2] by ``integrated`` velocities and by the ``pose``, and the pose's
    ``nees``; None for a turn that never reaches the row."""
    reached = exit_instant(run)
    if reached is None:
        return None
    model, columns, episode = InertialModel.of(ddagr(), Sensors()), run.columns, run.episode
    at = CONTROL_INTERVAL * (reached + 1) - 1
    truth = np.array([columns[f"true_{name}"][at] for name in ("x", "y", "yaw")])
    velocities = run_inertial_filter(model, columns)[0][:, :3]
    start = -episode.turn.run_in, episode.lateral_offset, episode.heading_offset
    poses, covariances = run_inertial_track(model, columns, start)
    errors = {"integrated": placed_motion(velocities, episode)[at, 3:] - truth, "pose": poses[at] - truth}
    found: dict[str, Any] = {name: (in_row(error, truth[2]) ** 2).tolist() for name, error in errors.items()}
    return found | {"nees": float(normalised_estimation_error(errors["pose"], covariances[at]))}


def in_row(error: Array, yaw: float) -> Array:
    """Error (3,) of x, y, yaw in the world as along, across and heading of a robot that points to ``yaw``."""
    cosine, sine = np.cos(yaw), np.sin(yaw)
    return np.array([cosine * error[0] + sine * error[1], cosine * error[1] - sine * error[0], error[2]])


def drive(plant: str, number: int) -> dict[str, Any] | None:
    """One turn."""
    settings, episode, seed = scenario(plant, number)
    return judge(drive_turn(find_controller(CONTROLLER, episode.turn), settings, seed, episode))


def plant_table(turns: Sequence[Mapping[str, Any] | None]) -> dict[str, Any]:
    """Of one plant: errors of both, their ratio and the NEES, with 95 % intervals over turns that reach the row."""
    reached, rng = [turn for turn in turns if turn is not None], np.random.default_rng(0)
    found: dict[str, Any] = {"turns": len(turns), "reached": len(reached)}
    if not reached:
        return found
    squares = {name: np.array([turn[name] for turn in reached]) for name in ("integrated", "pose")}
    for name, own in squares.items():
        found[name] = {
            f"{key}_{unit}": root_ratio(size**2 * own[:, i], None, rng) for i, (key, (unit, size)) in _entries()
        }
    found["pose_over_integrated"] = {
        key: root_ratio(squares["pose"][:, i], squares["integrated"][:, i], rng) for i, (key, _) in _entries()
    }
    return found | {"nees": interval(np.array([turn["nees"] for turn in reached]), np.mean, rng)}


def _entries() -> enumerate[tuple[str, tuple[str, float]]]:
    return enumerate(UNITS.items())


def study(plants: Sequence[str], scenarios: int) -> dict[str, Any]:
    """Every plant."""
    driven = driven_on(plants, (CONTROLLER,), scenarios, lambda name, plant, number: drive(plant, number))
    return {"scenarios": scenarios, "plants": {plant: plant_table(own[CONTROLLER]) for plant, own in driven}}


def _short(value: float) -> str:
    return f"{value:.2g}" if value < 10.0 else f"{value:.0f}"


def _with_interval(found: Mapping[str, Any]) -> str:
    return f"{_short(found['value'])} ({' to '.join(_short(v) for v in found['interval'])})"


def table(result: Mapping[str, Any]) -> str:
    """Markdown: a row a plant; errors along, across, heading."""
    lines = [
        "| plant | integrated [mm, mm, deg] | pose | pose over integrated: along, across | NEES |",
        "|---" * 5 + "|",
    ]
    for plant, found in result["plants"].items():
        if not found["reached"]:
            lines.append(f"| {PLANTS[plant].title} | the row was never reached | | | |")
            continue
        cells = [
            ", ".join(_short(found[name][f"{key}_{unit}"]["value"]) for key, (unit, _) in UNITS.items())
            for name in ("integrated", "pose")
        ]
        ratios = found["pose_over_integrated"]
        cells += [", ".join(_with_interval(ratios[key]) for key in ("along", "across")), _with_interval(found["nees"])]
        lines.append(f"| {PLANTS[plant].title} | {' | '.join(cells)} |")
    return "\n".join(lines)


def draw(result: Mapping[str, Any], path: Path) -> None:
    """Errors of both at the next row by plant, with 95 % intervals.

    Args:
        result: of :func:`study`.
        path: of the PNG file.
    """
    from matplotlib.figure import Figure

    plants = [name for name, found in result["plants"].items() if found["reached"]]
    with house_style():
        figure = Figure(figsize=(11.0, 1.4 + 0.42 * len(plants)), layout="constrained")
        panels = figure.subplots(1, len(UNITS), sharey=True)
        for panel, (key, (unit, _)) in zip(panels, UNITS.items(), strict=True):
            for place, plant in enumerate(plants):
                for name, shift, colour in (("integrated", -0.15, palette.ORANGE), ("pose", 0.15, palette.BLUE)):
                    entry = result["plants"][plant][name][f"{key}_{unit}"]
                    panel.plot(entry["interval"], [place + shift] * 2, color=colour, lw=1.6)
                    panel.plot(entry["value"], place + shift, "o", color=colour, ms=5)
            panel.set_xlim(left=0.0)
            panel.set_xlabel(f"{key} [{unit}]")
        panels[0].set_yticks(range(len(plants)), [PLANTS[name].title for name in plants])
        panels[0].set_ylim(len(plants) - 0.5, -0.5)
        figure.suptitle("Error at the next row: velocities integrated (orange), pose among the states (blue)")
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=110))


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plants", default=",".join(PLANTS), help="names, separated by commas")
    parser.add_argument("--scenarios", type=int, default=100, help="turns on each plant")
    parser.add_argument("--output", type=Path, default=RESULT, help="JSON file")
    parser.add_argument("--summary", action="store_true", help="only the picture of the file")
    given = parser.parse_args(arguments)
    try:
        plants = plants_of(given.plants, given.scenarios)
    except InputError as error:
        parser.error(str(error))
    if not given.summary:
        write_json(given.output, study(plants, given.scenarios))
    result = json.loads(given.output.read_text())
    draw(result, given.output.with_suffix(".png"))
    print(table(result))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
