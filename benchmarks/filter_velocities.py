"""Do the filters know their errors of v_x and v_y? Turns on other plants, errors against the filters' variances.

    python -m benchmarks.filter_velocities [--scenarios 12] [--plants level,slope_3,...] [--output FILE]

Turns of B6, which stands for 0.8 s first, on the development scenarios of :mod:`benchmarks.row_turn_plants`; both
filters see the same samples. Errors count from the end of standing on. Coverage: share of control periods in which an
error is within 1.645 standard deviations, 90 % for a consistent filter. NEES: of both velocities over 2, 1 for a
consistent filter. Writes ``results/filter_velocities.json`` and a picture beside it.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from benchmarks.filter_study.summary import interval
from benchmarks.row_turn_plants import PLANTS, driven_on, plants_of, scenario
from ddagr_gym.control.timing import CONTROL_INTERVAL
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import (
    CHANNELS,
    FilterModel,
    InertialFilter,
    InertialModel,
    chi_square_band,
    run_filter,
)
from ddagr_gym.estimation.layout import COMMANDS
from ddagr_gym.evaluation.controllers import STANDING, find_controller
from ddagr_gym.evaluation.runs import drive_turn
from ddagr_gym.files import atomic_path
from ddagr_gym.parameters import Sensors
from ddagr_gym.presets import ddagr
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

Array = NDArray[np.float64]
Columns = Mapping[str, Array]

CONTROLLER = "B6"
"""That drives the turns."""

RESULT = Path(__file__).parent / "results" / "filter_velocities.json"

PROBABILITY = 0.90
DEVIATIONS = float(norm.ppf(0.5 + 0.5 * PROBABILITY))
"""Standard deviations either side that hold it."""

_EVERY = 12  # control periods from one judged instant to the next of the NEES: 0.96 s


def flat_velocities(columns: Columns) -> tuple[Array, Array]:
    """v_x, v_y (K, 2) of the filter that takes the ground for level, and covariances (K, 2, 2), by control period."""
    run = run_filter(FilterModel.of(ddagr(), Sensors()), columns)
    rows = slice(CONTROL_INTERVAL - 1, None, CONTROL_INTERVAL)
    return run.states[rows, :2], run.covariances[rows, :2, :2]


def inertial_velocities(columns: Columns) -> tuple[Array, Array]:
    """The same of the inertial filter."""
    one = InertialFilter(InertialModel.of(ddagr(), Sensors()))
    commands = np.column_stack([columns[name] for name in COMMANDS])
    readings = np.column_stack([columns[name] for name in CHANNELS])
    states, covariances = [], []
    for first in range(0, len(readings) - CONTROL_INTERVAL + 1, CONTROL_INTERVAL):
        block = slice(first, first + CONTROL_INTERVAL)
        one.run(commands[block], np.ascontiguousarray(readings[block]))
        states.append(one.state[:2].copy())
        covariances.append(one.covariance[:2, :2].copy())
    return np.array(states), np.array(covariances)


VELOCITY_FILTERS: dict[str, Callable[[Columns], tuple[Array, Array]]] = {
    "filter": flat_velocities,
    "inertial_filter": inertial_velocities,
}
"""By name."""


def judge_velocities(estimates: Array, covariances: Array, columns: Columns) -> dict[str, Any]:
    """Errors of one drive, from the end of standing on.

    Returns:
        ``square``: mean squared error of v_x and v_y [m^2/s^2]; ``covered``: share of control periods within
        DEVIATIONS of them; ``nees``: of both velocities together over 2, at instants about a second apart.
    """
    rows = slice(CONTROL_INTERVAL - 1, None, CONTROL_INTERVAL)
    truth = np.column_stack([columns["true_v_x"][rows], columns["true_v_y"][rows]])[: len(estimates)]
    errors, own = (estimates - truth)[STANDING:], covariances[STANDING:]
    spread = np.sqrt(np.diagonal(own, axis1=1, axis2=2))
    chosen = slice(_EVERY - 1, None, _EVERY)
    solved = np.linalg.solve(own[chosen], errors[chosen, :, None])[..., 0]
    return {
        "square": np.mean(errors**2, axis=0).tolist(),
        "covered": np.mean(np.abs(errors) <= DEVIATIONS * spread, axis=0).tolist(),
        "nees": (0.5 * np.sum(errors[chosen] * solved, axis=1)).tolist(),
    }


def velocity_drive(plant: str, number: int) -> dict[str, Any]:
    """One turn of B6, which stands first, as every filter sees it."""
    settings, episode, seed = scenario(plant, number)
    columns = drive_turn(find_controller(CONTROLLER, episode.turn), settings, seed, episode).columns
    return {name: judge_velocities(*of(columns), columns) for name, of in VELOCITY_FILTERS.items()}


def velocity_table(drives: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Of one plant, by filter: errors, coverage and NEES with 95 % intervals over drives (:func:`velocity_drive`)."""
    table: dict[str, Any] = {}
    for name in VELOCITY_FILTERS:
        own = [drive[name] for drive in drives]
        squares, covered = (np.array([item[key] for item in own]) for key in ("square", "covered"))
        shortest = min(len(item["nees"]) for item in own)
        nees = np.array([item["nees"][:shortest] for item in own])
        band, rng = chi_square_band(2, len(own), 0.95), np.random.default_rng(0)
        table[name] = {
            "drives": len(own),
            "v_x_rmse_mm_s": round(1e3 * float(np.sqrt(squares[:, 0].mean())), 2),
            "v_y_rmse_mm_s": round(1e3 * float(np.sqrt(squares[:, 1].mean())), 2),
            "v_x_covered": interval(covered[:, 0], np.mean, rng),
            "v_y_covered": interval(covered[:, 1], np.mean, rng),
            "nees": interval(nees.mean(axis=1), np.mean, rng),
            "nees_median_drive": float(np.median(nees.mean(axis=1))),
            "nees_band": list(band),
            "nees_share_of_instants_inside": float(band.contains(nees.mean(axis=0)).mean()),
        }
    return table


def study(plants: Sequence[str], scenarios: int) -> dict[str, Any]:
    """Both filters on every plant."""
    driven = driven_on(plants, (CONTROLLER,), scenarios, lambda name, plant, number: velocity_drive(plant, number))
    return {"scenarios": scenarios, "plants": {plant: velocity_table(own[CONTROLLER]) for plant, own in driven}}


_LOOKS = {"filter": ("filter, ground level", palette.BLUE), "inertial_filter": ("inertial filter", palette.ORANGE)}
_MARKS = {"v_x": "o", "v_y": "D"}


def draw(plants: Mapping[str, Mapping[str, Any]], path: Path) -> None:
    """Coverage above, NEES below, by plant; PNG."""
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(9.0, 6.4), layout="constrained")
        upper, lower = figure.subplots(2, 1, sharex=True)
        for number, (name, (label, colour)) in enumerate(_LOOKS.items()):
            for place, table in enumerate(plants.values()):
                own, at = table[name], place + 0.36 * (number - 0.5)
                for shift, (key, mark) in zip((-0.07, 0.07), _MARKS.items(), strict=True):
                    item, title = own[f"{key}_covered"], f"{label}, {key}" if place == 0 else None
                    upper.plot([at + shift] * 2, [100.0 * v for v in item["interval"]], "-", color=colour, lw=1.2)
                    upper.plot(at + shift, 100.0 * item["value"], mark, color=colour, ms=4.5, label=title)
                lower.plot([at] * 2, own["nees"]["interval"], "-", color=colour, lw=1.2)
                lower.plot(at, own["nees"]["value"], "o", color=colour, ms=4.5)
        upper.axhline(90.0, color=palette.GREY, lw=0.8)
        upper.set(title="Errors inside the filter's own 90 % interval", ylabel="share of time [%]", ylim=(0, 105))
        lower.axhspan(*next(iter(plants.values()))["filter"]["nees_band"], color=palette.BED, lw=0)
        lower.set(title="NEES of v_x and v_y over 2 (shaded: consistent)", ylabel="mean over drives", yscale="log")
        lower.set_xticks(range(len(plants)), [PLANTS[name].title.replace(" from", "\nfrom") for name in plants],
                         rotation=18, ha="right")  # fmt: skip
        figure.legend(*upper.get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False)
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=130))


def table(result: Mapping[str, Any]) -> str:
    """Markdown: a row a plant and filter."""
    lines = ["| plant | filter | v_x, v_y error [mm/s] | covered of 90 %: v_x, v_y | NEES |", "|---" * 5 + "|"]
    for plant, found in result["plants"].items():
        for name, own in found.items():
            covered = ", ".join(f"{100.0 * own[key]['value']:.0f}" for key in ("v_x_covered", "v_y_covered"))
            low, high = own["nees"]["interval"]
            lines.append(
                f"| {PLANTS[plant].title} | {_LOOKS[name][0]} | {own['v_x_rmse_mm_s']:.1f}, {own['v_y_rmse_mm_s']:.1f} "
                f"| {covered} | {own['nees']['value']:.1f} ({low:.1f} to {high:.1f}) |"
            )
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plants", default=",".join(PLANTS), help="names, separated by commas")
    parser.add_argument("--scenarios", type=int, default=12, help="turns on each plant")
    parser.add_argument("--output", type=Path, default=RESULT, help="JSON file; the picture lies beside it")
    given = parser.parse_args(arguments)
    try:
        plants = plants_of(given.plants, given.scenarios)
    except InputError as error:
        parser.error(str(error))
    result = study(plants, given.scenarios)
    with atomic_path(given.output) as temporary:
        temporary.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    draw(result["plants"], given.output.with_suffix(".png"))
    print(table(result))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
