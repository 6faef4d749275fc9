"""Which episodes of a campaign a page shows, driven again: paths, the filter's estimate, the worst, a typical turn."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.estimation import run_filter
from ddagr_gym.estimation.dead_reckoning import integrate_track, reckoned_track
from ddagr_gym.estimation.inertial_filter import run_inertial_track
from ddagr_gym.evaluation.campaign import drive_scenario, episode_row, nominal_filter
from ddagr_gym.evaluation.controllers import (
    DEFAULT,
    LEARNED_ESTIMATORS,
    estimates_path,
    find_controller,
    has_inertial_filter,
    inertial_model,
    learned_model,
)
from ddagr_gym.evaluation.metrics import headland_samples
from ddagr_gym.evaluation.report_data import (
    Evaluation,
    Row,
    ShownDrive,
    arm_name,
    badness,
    best_arm,
    size_of,
)
from ddagr_gym.evaluation.runs import TurnRun
from ddagr_gym.evaluation.scenarios import Scenario, load_scenarios, scenario_names
from ddagr_gym.frames import body_to_world
from ddagr_gym.tasks import Task, TaskRunner, results_of

Array = NDArray[np.float64]

OVERLAID = 8
"""Scenarios whose paths lie over each other in the figure of an arm."""

MOST_ARMS = 8
"""Arms with such a figure."""

_SPACING = 12
"""Samples between the points of a shown path: about 0.1 s."""


def parse_replay(text: str) -> tuple[str, str, int]:
    """Controller, set and number of ``controller:set:number``.

    Raises:
        InputError: another form, an unknown controller or set, or a number that the set does not have.
    """
    parts = text.rsplit(":", 2)
    if len(parts) != 3 or not all(parts) or not parts[2].isdecimal():
        raise InputError(f"--replay {text}: give controller, set and number, such as B4:S1:17.")
    controller, set_name, number = parts[0], parts[1], int(parts[2])
    if set_name not in scenario_names():
        raise unknown_name("scenario set", set_name, scenario_names())
    scenarios = load_scenarios(set_name)
    if number >= len(scenarios):
        raise InputError(f"--replay {text}: set {set_name} has scenarios 0 to {len(scenarios) - 1}.")
    find_controller(controller, scenarios[number].episode.turn)
    return controller, set_name, number


def estimated_track(run: TurnRun, controller: str = "") -> Array:
    """Pose by the filter after each sample (T, 3): x, y [m], yaw [rad], from the known start.

    The filter is run over the drive's readings anew: the inertial one, with the nominal robot and the controller's
    network where it has one, where it is that of the controller; else that of the features, whose speeds and yaw rate
    are integrated.

    Args:
        run: the drive.
        controller: its name.
    """
    episode = run.episode
    start = (-episode.turn.run_in, episode.lateral_offset, episode.heading_offset)
    if controller in LEARNED_ESTIMATORS:
        return reckoned_track(learned_model(LEARNED_ESTIMATORS[controller]), run.columns, start)
    if has_inertial_filter(controller):
        return run_inertial_track(inertial_model(), run.columns, start)[0]
    states = run_filter(nominal_filter(), run.columns).states
    track = integrate_track(states[:, 0], states[:, 1], states[:, 2], nominal_filter().sample_period)
    return np.column_stack([body_to_world(track[:, :2], *start), track[:, 2] + start[2]])


def shown_drive(row: Row, run: TurnRun, with_estimate: bool) -> ShownDrive:
    """A driven episode thinned for a picture, to the exit where there is one."""
    columns, turn = run.columns, run.episode.turn
    window, crossed = headland_samples(columns["true_x"], columns["true_yaw"], turn.side)
    path = np.column_stack([columns["true_x"], columns["true_y"]])
    estimate, error = None, None
    if with_estimate:
        whole = estimated_track(run, row["controller"])[:, :2]
        end = window.stop - 1 if window is not None and crossed else len(path) - 1
        length = float(np.hypot(*np.diff(path[: end + 1], axis=0).T).sum())
        error = float(np.hypot(*(whole[end] - path[end]))) / max(length, 1e-3)
        estimate = _thinned(whole)
    return ShownDrive(
        arm_name(row), row["set"], row["number"], turn, _thinned(path), row["radius_error"], bool(row["success"]),
        estimate, error,
    )  # fmt: skip


def _thinned(points: Array) -> Array:
    return np.ascontiguousarray(np.vstack([points[:-1:_SPACING], points[-1:]]))


def overlaid_rows(evaluation: Evaluation, count: int = OVERLAID, most: int = MOST_ARMS) -> list[Row]:
    """Episodes of the path figure: the same feasible scenarios, spread over the set, for each of the main arms."""
    rows = []
    for name in main_arms(evaluation, most):
        mine = _first_run(evaluation.rows_of(name, evaluation.judged))
        numbers = sorted(row["number"] for row in mine)
        picked = {numbers[k] for k in np.linspace(0, len(numbers) - 1, min(count, len(numbers))).astype(int)}
        rows += [row for row in mine if row["number"] in picked]
    return rows


def _first_run(rows: Sequence[Row]) -> list[Row]:
    """Of several training seeds the lowest."""
    first = min((row.get("run", 0) for row in rows), default=0)
    return [row for row in rows if row.get("run", 0) == first]


def main_arms(evaluation: Evaluation, most: int) -> list[str]:
    """Deployable arms by importance: headline, best, ladder, others; in the order of the tables."""
    best = best_arm(evaluation)
    deployable = [
        arm
        for arm in evaluation.arms
        if arm.deployable and not arm.ablation and evaluation.rows_of(arm.name, evaluation.judged)
    ]
    first = [arm for arm in deployable if arm.name in (evaluation.headline, best.name if best else "")]
    ladder = [arm for arm in deployable if not arm.learned and arm not in first]
    others = [arm for arm in deployable if arm.learned and arm not in first]
    chosen = [*first, *ladder, *others][:most]
    return [arm.name for arm in deployable if arm in chosen]


def tracked_rows(evaluation: Evaluation, most: int = 3) -> list[Row]:
    """A typical episode of each main arm that steers by the filter: the one at the median |e_R|."""
    rows = []
    for name in main_arms(evaluation, 2 * MOST_ARMS):
        mine = sorted(_first_run(evaluation.rows_of(name, evaluation.judged)), key=size_of)
        if mine and estimates_path(mine[0]["controller"]):
            rows.append(mine[(len(mine) - 1) // 2])
    return _important(evaluation, rows, most)


def _important(evaluation: Evaluation, rows: list[Row], most: int) -> list[Row]:
    best = best_arm(evaluation)
    wanted = (DEFAULT, best.name if best else "", evaluation.headline)
    ranked = sorted(rows, key=lambda row: arm_name(row) not in wanted)[:most]
    return [row for row in rows if row in ranked]


def film_rows(evaluation: Evaluation) -> list[tuple[str, Row]]:
    """Episodes that get a video, with a phrase: a typical turn, the worst one, and the worst of B1."""
    best = best_arm(evaluation)
    if best is None:
        return []
    typical = sorted(_first_run(evaluation.rows_of(best.name, evaluation.judged)), key=size_of)
    chosen = [(f"A typical turn of {best.name}", typical[(len(typical) - 1) // 2])]
    for name in dict.fromkeys((best.name, "B1")):
        mine = [row for row in evaluation.rows if arm_name(row) == name and row["feasible"]]
        if mine:
            chosen.append((f"The worst turn of {name}", max(mine, key=badness)))
    return chosen


def drive_shown(
    rows: Sequence[Row], with_estimate: bool, processes: int = 1, progress: Callable[[], None] = lambda: None
) -> list[ShownDrive]:
    """Episodes driven again, in their order.

    Args:
        rows: of the campaign.
        with_estimate: whether to run the filter over them.
        processes: workers.
        progress: called after each.
    """
    if not rows:
        return []
    tasks = [
        Task(f"{row['controller']} on {row['set']} {row['number']}", _shown, (row, scenario_of(row), with_estimate))
        for row in rows
    ]
    with TaskRunner(min(processes, len(tasks))) as runner:
        return results_of(tasks, runner, progress=progress)


def _shown(row: Row, scenario: Scenario, with_estimate: bool) -> ShownDrive:
    return shown_drive(row, drive_scenario(row["controller"], scenario), with_estimate)


def scenario_of(row: Row) -> Scenario:
    """Scenario of an episode."""
    return load_scenarios(row["set"])[row["number"]]


def infeasible_soils(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Scenarios that no upper bound makes, each with its soil's parameters, side and radius."""
    keys = sorted({(row["set"], row["number"]) for row in rows if not row["feasible"]})
    found = []
    for name, number in keys:
        episode = load_scenarios(name)[number].episode
        soil: Any = episode.soils
        found.append(
            {
                "scenario": f"{name} {number}",
                "cohesion [Pa]": soil.cohesion,
                "friction [°]": float(np.degrees(soil.friction_angle)),
                "exponent [-]": soil.sinkage_exponent,
                "k_c": soil.cohesive_modulus,
                "k_phi": soil.frictional_modulus,
                "shear modulus [mm]": 1e3 * soil.shear_modulus,
                "radius [m]": episode.turn.radius,
            }
        )
    return found


def replayed(controller: str, set_name: str, number: int) -> tuple[Mapping[str, Any], TurnRun]:
    """One scenario driven by one controller, with its row of metrics."""
    scenario = load_scenarios(set_name)[number]
    run = drive_scenario(controller, scenario)
    return episode_row(controller, scenario, run), run
