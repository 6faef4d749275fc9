"""Controllers over frozen scenario sets: parallel, resumable, one row an episode."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ddagr_gym.envs.options import make_settings
from ddagr_gym.envs.settings import TurnSettings
from ddagr_gym.evaluation.controllers import EKF_CONTROLLERS, find_controller
from ddagr_gym.evaluation.metrics import turn_metrics
from ddagr_gym.evaluation.runs import TurnRun, drive_turn
from ddagr_gym.evaluation.scenarios import Scenario, load_scenarios

_CHUNK = 10
"""Episodes per task of a worker: a resumed run loses at most this many."""


@dataclass(frozen=True)
class Task:
    """A controller and some scenarios of a set."""

    controller: str
    set_name: str
    numbers: tuple[int, ...]


def scenario_settings(scenario: Scenario, ekf_features: bool = False) -> TurnSettings:
    """Settings of the environment in which a scenario is driven; the episode itself is frozen."""
    turn = scenario.episode.turn
    return make_settings(
        radius=turn.radius,
        side=turn.side,
        speed=turn.speed,
        run_in=turn.run_in,
        run_out=turn.run_out,
        ekf_features=ekf_features,
    )


def drive_scenario(controller: str, scenario: Scenario) -> TurnRun:
    """One scenario by one controller."""
    made = find_controller(controller, scenario.episode.turn)
    settings = scenario_settings(scenario, controller in EKF_CONTROLLERS)
    return drive_turn(made, settings, scenario.seed, scenario.episode)


def episode_row(controller: str, scenario: Scenario, run: TurnRun) -> dict[str, Any]:
    """Metrics 1 to 5 of a driven scenario as one flat row; what is undefined is None."""
    metrics = turn_metrics(run.columns, run.episode.turn, run.episode.robot)
    turn, leave = metrics.turn, metrics.exit
    row = {
        "controller": controller,
        "set": scenario.set_name,
        "number": scenario.number,
        "feasible": scenario.feasible,
        "radius": run.episode.turn.radius,
        "side": run.episode.turn.side,
        "ending": run.ending,
        "status": turn.status.name,
        "radius_error": turn.error,
        "fit_residual": turn.residual,
        "radius_disagreement": turn.disagreement,
        "radius_consistent": turn.consistent,
        "radial_error_rms": metrics.radial_error_rms,
        "radial_error_maximum": metrics.radial_error_maximum,
        "exit_lateral_error": None if leave is None else leave.lateral_error,
        "exit_heading_error": None if leave is None else leave.heading_error,
        "success": leave is not None and leave.wheels_fit,
        "within_practice": leave is not None and leave.within_practice,
        "headland_depth": metrics.headland_depth,
        "duration": metrics.duration,
        "slip_energy": metrics.slip_energy,
        "wheel_speed_variation": metrics.wheel_speed_variation,
        "bank_stalls": metrics.bank_stalls,
        "robot_stalls": metrics.robot_stalls,
    }
    return {key: value.item() if isinstance(value, np.generic) else value for key, value in row.items()}


def _work(task: Task) -> list[dict[str, Any]]:
    scenarios = load_scenarios(task.set_name)
    rows = []
    for number in task.numbers:
        scenario = scenarios[number]
        rows.append(episode_row(task.controller, scenario, drive_scenario(task.controller, scenario)))
    return rows


def plan(controllers: Sequence[str], sets: Sequence[str], done: set[tuple[str, str, int]]) -> list[Task]:
    """Tasks for all episodes that are not done, small enough to resume by."""
    tasks = []
    for set_name in sets:
        count = len(load_scenarios(set_name))
        for controller in controllers:
            open_ = [n for n in range(count) if (controller, set_name, n) not in done]
            tasks += [Task(controller, set_name, tuple(open_[k : k + _CHUNK])) for k in range(0, len(open_), _CHUNK)]
    return tasks


def read_rows(journal: Path) -> list[dict[str, Any]]:
    """Rows of a journal; a last line that was cut off by an interruption is dropped."""
    rows = []
    if journal.is_file():
        for line in journal.read_text(encoding="utf-8").splitlines():
            try:
                rows.append(json.loads(line))
            except json.JSONDecodeError:
                break
    return rows


def run_campaign(
    controllers: Sequence[str],
    sets: Sequence[str],
    journal: Path,
    *,
    processes: int = 2,
    progress: Callable[[int], None] = lambda episodes: None,
) -> list[dict[str, Any]]:
    """Drive every controller on every scenario of the sets, continuing what the journal holds.

    Args:
        controllers: names.
        sets: names of frozen sets.
        journal: JSON lines, appended as episodes end.
        processes: workers.
        progress: called with the number of episodes that a task added.

    Returns:
        All rows, ordered by controller, set and number.
    """
    rows = read_rows(journal)
    wanted = [row for row in rows if row["controller"] in controllers and row["set"] in sets]
    done = {(row["controller"], row["set"], row["number"]) for row in wanted}
    if wanted:
        progress(len(wanted))
    for added in _results(plan(controllers, sets, done), processes):
        with journal.open("a", encoding="utf-8") as file:
            file.writelines(json.dumps(row) + "\n" for row in added)
        wanted += added
        progress(len(added))
    order = {name: k for k, name in enumerate(controllers)}
    return sorted(wanted, key=lambda row: (order[row["controller"]], row["set"], row["number"]))


def _results(tasks: list[Task], processes: int) -> Iterator[list[dict[str, Any]]]:
    if processes <= 1 or len(tasks) <= 1:
        yield from map(_work, tasks)
        return
    with ProcessPoolExecutor(processes) as pool:
        futures = [pool.submit(_work, task) for task in tasks]
        try:
            for future in as_completed(futures):
                yield future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def absolute_errors(rows: Sequence[dict[str, Any]]) -> list[float]:
    """|e_R| of each row; a turn without a defined radius is infinitely wrong."""
    return [math.inf if row["radius_error"] is None else abs(row["radius_error"]) for row in rows]
