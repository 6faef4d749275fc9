"""One turn: what can be known of it, how wrong the filters are, and whether a smoother reaches the bound."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.row_turn_plants import scenario
from benchmarks.velocity_bound.filters import ESTIMATORS, estimated_motion
from benchmarks.velocity_bound.information import Bounds, accumulated_information, motion_bounds
from benchmarks.velocity_bound.smoother import smooth
from benchmarks.velocity_bound.turn_model import MOTION, TurnModel, reading_deviations
from ddagr_gym.control.timing import CONTROL_INTERVAL, CONTROL_PERIOD
from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.controllers import STANDING, find_controller
from ddagr_gym.evaluation.metrics import turn_metrics
from ddagr_gym.evaluation.runs import TurnRun, drive_turn
from ddagr_gym.files import write_json
from ddagr_gym.progress import Progress

Array = NDArray[np.float64]

PLANTS = ("level", "weaker")
"""Of :mod:`benchmarks.row_turn_plants`: constant soil, and strength x 0.7 from half of the turn on."""
CONTROLLER = "B6"
"""That drives the turns; it stands first."""

BOUNDS: dict[str, tuple[str, tuple[str, ...], tuple[int, ...]]] = {
    "task": ("all that the task draws is unknown", ("slope",), ()),
    "slope": ("and the ground's slope", (), ()),
    "biases": ("biases known", ("slope", "biases"), ()),
    "robot": ("robot and delay known", ("slope", "robot"), ()),
    "change": ("size and time of the change known", ("slope", "change"), ()),
    "variation": ("variation of the soil along the way known", ("slope", "variation"), ()),
    "soil": ("soil known", ("slope", "soil", "variation", "change"), ()),
    "no_accelerometer": ("without accelerometer", ("slope",), (0, 1)),
}
"""By name: title, groups of unknowns that are known, channels that are missing."""
SERIES = ("task", "slope")
"""Bounds that are kept over time."""
DRAWN, TASK = CHECKED_NOISE = ("drawn", "task")
"""Readings that the smoother is given: of its own model with Gaussian noise, and the task's own, made by numerics that
soften friction near rest less than its model does."""
OWN_READINGS = 2
"""Turns of each plant on which it is given the task's own too."""


class _Turn:
    """One driven turn at its control instants.

    Attributes:
        truth: MOTION (T, 6) at every sample.
        exit: control instant at the next row's start line, from standing on.
    """

    def __init__(self, plant: str, number: int) -> None:
        settings, episode, seed = scenario(plant, number)
        run = drive_turn(find_controller(CONTROLLER, episode.turn), settings, seed, episode)
        self.columns, self.episode, self.seed = run.columns, episode, seed
        self.truth = np.column_stack([self.columns[f"true_{name}"] for name in MOTION])
        commands = np.column_stack([self.columns["command_right"], self.columns["command_left"]])
        self.model = TurnModel(settings, episode, commands, self.truth[:, 3:])
        exit_at = exit_instant(run)
        if exit_at is None:
            raise InputError("a turn never reached the next row's start line: give another root seed.")
        self.exit = exit_at - STANDING

    def instants(self, series: Array) -> Array:
        """The control instants (K, ...) of a series by sample, from the end of standing on."""
        return series[CONTROL_INTERVAL - 1 :: CONTROL_INTERVAL][STANDING:]


def exit_instant(run: TurnRun) -> int | None:
    """Control instant at the next row's start line, from the start on; None where it was never reached."""
    found = turn_metrics(run.columns, run.episode.turn, run.episode.robot).exit
    if found is None:
        return None
    return min(round(found.time / CONTROL_PERIOD), len(run.columns["t"]) // CONTROL_INTERVAL) - 1


def _figures(turn: _Turn, squares: Array, exit_squares: Array) -> dict[str, Any]:
    """Mean squares of v_x, v_y (K, 2) up to the exit; squares at the exit of the pose along, across, heading (3,)."""
    return {"velocity": _numbers(squares[: turn.exit + 1].mean(axis=0)), "exit": _numbers(exit_squares)}


def _numbers(values: Array) -> list[Any]:
    """As lists; None where a filter broke down."""
    return np.where(np.isfinite(values), values, np.array(None)).tolist()  # type: ignore[no-any-return]


def _diagonal(covariances: Array) -> Array:
    return np.asarray(np.diagonal(covariances, axis1=1, axis2=2))


def _bounds_of(turn: _Turn, name: str, motion: Array, readings: Array) -> Bounds:
    _, known, missing = BOUNDS[name]
    free = ~np.isin(turn.model.groups, known)
    deviations = reading_deviations(turn.episode.sensors)
    deviations[list(missing)] = np.inf
    information = accumulated_information(readings[..., free], deviations, CONTROL_INTERVAL)
    rows = slice(CONTROL_INTERVAL - 1, None, CONTROL_INTERVAL)
    return motion_bounds(information, motion[rows][..., free], turn.truth[rows, 3:], CONTROL_PERIOD)


def turn_result(plant: str, number: int) -> dict[str, Any]:
    """Bounds and the filters' errors of one turn of one of PLANTS, as numbers for JSON."""
    turn = _Turn(plant, number)
    by_motion, by_reading = turn.model.derivatives(turn.model.truth)
    found: dict[str, Any] = {"kept": turn.model.kept, "unknowns": len(turn.model.names), "exit": turn.exit}
    found["bounds"], found["series"] = {}, {}
    for name in BOUNDS:
        if name == "change" and "change" not in turn.model.groups:
            continue
        bounds = _bounds_of(turn, name, by_motion, by_reading)
        variances = _diagonal(bounds.filtered)[STANDING:]
        own = _figures(turn, variances[:, :2], variances[turn.exit, 3:])
        found["bounds"][name] = own | {"reckoned": _diagonal(bounds.reckoned)[STANDING + turn.exit].tolist()}
        if name in SERIES:
            found["series"][f"bound_{name}"] = variances[:, :2].tolist()
    found["filters"] = {}
    for name in ESTIMATORS:
        squares = turn.instants(estimated_motion(name, turn.columns, turn.episode) - turn.truth) ** 2
        found["filters"][name] = _figures(turn, squares[:, :2], squares[turn.exit, 3:])
        found["series"][name] = _numbers(squares[:, :2])
    found["turning"] = np.abs(turn.instants(turn.truth[:, 5])).tolist()
    return found


def check_result(plant: str, number: int) -> dict[str, Any]:
    """The smoother's errors in one turn beside their bound, as numbers for JSON."""
    turn = _Turn(plant, number)
    by_motion, by_reading = turn.model.derivatives(turn.model.truth)
    smoothed = _diagonal(_bounds_of(turn, "task", by_motion, by_reading).smoothed)[STANDING:]
    found: dict[str, Any] = {"bound": smoothed.mean(axis=0).tolist(), "bound_at_end": smoothed[-1].tolist()}
    for noise in CHECKED_NOISE[: 2 if number < OWN_READINGS else 1]:
        found[noise] = _smoother_errors(turn, by_reading, noise)
    return found


def _smoother_errors(turn: _Turn, by_reading: Array, noise: str) -> dict[str, Any]:
    """Mean squares of the smoother's errors of MOTION over the turn, and at its end."""
    model, sensors = turn.model, turn.episode.sensors
    known = np.isin(model.groups, BOUNDS["task"][1])
    deviations = reading_deviations(sensors)
    truth, readings = turn.truth, _own_readings(turn)
    if noise == DRAWN:
        motion, exact = model.simulate(model.truth[None])
        draws = np.random.default_rng([turn.seed, 1]).standard_normal(exact[0].shape)
        truth, readings = motion[0], exact[0] + deviations * draws
    best = smooth(model, known, deviations, by_reading, readings)
    squares = turn.instants(best.motion - truth) ** 2
    wrong = (best.unknowns - model.truth)[~known]
    information = accumulated_information(by_reading[..., ~known], deviations, len(readings))[-1]
    return {
        "square": squares.mean(axis=0).tolist(),
        "square_at_end": squares[-1].tolist(),
        "unknowns": float(wrong @ information @ wrong / len(wrong)),
        "cost": best.cost.tolist(),
    }


def _own_readings(turn: _Turn) -> Array:
    """The task's readings (T, 5) with the encoders' speeds summed to angles; counts are rounded down."""
    imu = [turn.columns[name] for name in ("specific_force_x", "specific_force_y", "yaw_rate")]
    sensors = turn.episode.sensors
    half = np.pi / sensors.encoder.counts_per_revolution
    wheels = [sensors.period * np.cumsum(turn.columns[f"encoder_{side}"]) + half for side in ("right", "left")]
    return np.column_stack([*imu, *wheels])


def run(plants: Sequence[str], scenarios: int, checked: int, work: Path) -> dict[str, list[dict[str, Any]]]:
    """Turns of every plant; those that the folder of work holds are not driven again.

    Args:
        plants: names.
        scenarios: turns of each.
        checked: of these with a smoother; no more than scenarios.
        work: folder of what is finished.
    """
    found: dict[str, list[dict[str, Any]]] = {plant: [] for plant in plants}
    with Progress(len(plants) * (scenarios + checked), "turns") as progress:
        for number in range(scenarios):
            for plant in plants:
                turn = _kept(work / f"{plant}_{number}.json", turn_result, plant, number)
                progress.advance()
                if number < checked:
                    turn["smoother"] = _kept(work / f"{plant}_{number}_checked.json", check_result, plant, number)
                    progress.advance()
                found[plant].append(turn)
    return found


def _kept(path: Path, make: Callable[[str, int], dict[str, Any]], plant: str, number: int) -> dict[str, Any]:
    """What a file of finished work holds; it is made first where there is none."""
    if not path.is_file():
        write_json(path, make(plant, number))
    return dict(json.loads(path.read_text(encoding="utf-8")))
