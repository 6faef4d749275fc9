"""Controllers over frozen scenario sets: parallel, resumable, one row an episode."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from ddagr_gym.envs.options import make_settings
from ddagr_gym.envs.settings import TurnSettings
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import FilterModel
from ddagr_gym.evaluation.controllers import (
    BOUNDS,
    controller_arm,
    controller_version,
    drives_on,
    find_batch,
    find_controller,
    is_policy,
    observation_options,
)
from ddagr_gym.evaluation.dataset import IDENTITY, EpisodeDataset, Key, episode_key
from ddagr_gym.evaluation.estimator_metrics import estimator_errors
from ddagr_gym.evaluation.metrics import TurnStatus, turn_metrics
from ddagr_gym.evaluation.policy_seeds import one_arm_each
from ddagr_gym.evaluation.runs import TurnRun, drive_turn, drive_turns
from ddagr_gym.evaluation.scenarios import Scenario, load_scenarios, set_hash
from ddagr_gym.parameters import Sensors
from ddagr_gym.physics.soil_laws import ground_effects
from ddagr_gym.policies.shipped import policy_file, split_estimate
from ddagr_gym.presets import ddagr
from ddagr_gym.tasks import Task, TaskRunner
from ddagr_gym.tasks.task import Ended, raise_failures

_CHUNK = 50
"""Episodes per task, driven side by side where the controller can: a stopped run loses at most a task."""
_SLOW_CHUNK = 10
"""Likewise of controllers that drive one turn at a time."""

EARLIER = "episodes.jsonl"
"""Rows of a campaign of an earlier version, beside the dataset."""


@dataclass(frozen=True)
class Episodes:
    """A controller and some scenarios of a set."""

    controller: str
    set_name: str
    numbers: tuple[int, ...]

    def __str__(self) -> str:
        """Name in messages."""
        return f"{self.controller} on {self.set_name} {self.numbers[0]} to {self.numbers[-1]}"


def scenario_settings(scenario: Scenario, ekf_features: bool = False, **observed: Any) -> TurnSettings:
    """Settings of the environment in which a scenario is driven; the episode itself is frozen.

    Args:
        scenario: to drive.
        ekf_features: see :func:`ddagr_gym.envs.options.make_settings`, as ``observed``.
        observed: what else the observation holds.
    """
    turn = scenario.episode.turn
    return make_settings(
        radius=turn.radius,
        side=turn.side,
        speed=turn.speed,
        run_in=turn.run_in,
        run_out=turn.run_out,
        effects=(*ground_effects(scenario.law), *scenario.effects),
        ekf_features=ekf_features,
        **observed,
    )


def drive_scenario(controller: str, scenario: Scenario) -> TurnRun:
    """One scenario by one controller."""
    made = find_controller(controller, scenario.episode.turn)
    settings = scenario_settings(scenario, **observation_options(controller))
    return drive_turn(made, settings, scenario.seed, scenario.episode)


def drive_scenarios(controller: str, scenarios: Sequence[Scenario]) -> list[TurnRun]:
    """Scenarios of one set by one controller, side by side where it can; the runs are those of one by one."""
    runs: dict[int, TurnRun] = {}
    for places in _alike(scenarios).values():
        group = [scenarios[place] for place in places]
        batch = find_batch(controller, len(group))
        if batch is None:
            driven = [drive_scenario(controller, item) for item in group]
        else:
            settings = scenario_settings(group[0], **observation_options(controller))
            driven = drive_turns(batch, settings, [item.seed for item in group], [item.episode for item in group])
        runs |= dict(zip(places, driven, strict=True))
    return [runs[place] for place in range(len(scenarios))]


def _alike(scenarios: Sequence[Scenario]) -> dict[Any, list[int]]:
    """Places of scenarios with the same effects whose soil grids have the same shape, as those of one batch must."""
    groups: dict[Any, list[int]] = {}
    for place, scenario in enumerate(scenarios):
        field = scenario.episode.field
        shape = None if field is None else field.values.shape
        groups.setdefault((shape, scenario.effects), []).append(place)
    return groups


@lru_cache(maxsize=1)
def nominal_filter() -> FilterModel:
    """The filter that knows the nominal robot and sensors."""
    return FilterModel.of(ddagr(), Sensors())


def episode_row(controller: str, scenario: Scenario, run: TurnRun) -> dict[str, Any]:
    """Metrics 1 to 6 of a driven scenario as one flat row; what is undefined is None."""
    episode = run.episode
    metrics = turn_metrics(run.columns, episode.turn, episode.robot)
    start = (-episode.turn.run_in, episode.lateral_offset, episode.heading_offset)
    estimator = estimator_errors(nominal_filter(), run.columns, episode.turn, start)
    turn, leave = metrics.turn, metrics.exit
    arm, repeat = controller_arm(controller)
    row = {
        "controller": controller,
        "arm": arm,
        "run": repeat,
        "set": scenario.set_name,
        "number": scenario.number,
        "radius": episode.turn.radius,
        "side": episode.turn.side,
        "ending": run.ending,
        "status": turn.status.name,
        # of a part of the turn it says nothing about the whole: it failed
        "radius_error": turn.error if turn.status is TurnStatus.COMPLETE else None,
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
    row |= {f"estimator_{name}": value for name, value in asdict(estimator).items()}
    return {key: value.item() if isinstance(value, np.generic) else value for key, value in row.items()}


def provenance(controller: str, set_name: str) -> str:
    """Short hash of a row's scenarios, controller and filter; a row with another hash is driven again."""
    parts = (set_hash(set_name), controller_version(controller), repr(nominal_filter()))
    return hashlib.sha256(" ".join(parts).encode()).hexdigest()[:12]


def _work(
    episodes: Episodes, scenarios: Sequence[Scenario], policy: Path | None, made_of: str, arm: tuple[str, int]
) -> list[dict[str, Any]]:
    """Rows of some episodes.

    Args:
        episodes: to drive.
        scenarios: all of the set.
        policy: file of the controller where it is a policy, which may have another name on another machine.
        made_of: provenance of the rows.
        arm: of the controller, and its run.
    """
    name = episodes.controller
    driver = name if policy is None else f"{policy}{name.removeprefix(split_estimate(name)[0])}"
    chosen = [scenarios[number] for number in episodes.numbers]
    named = {"controller": name, "arm": arm[0], "run": arm[1], "made_of": made_of}
    runs = drive_scenarios(driver, chosen)
    return [episode_row(driver, scenario, run) | named for scenario, run in zip(chosen, runs, strict=True)]


def with_bounds(controllers: Sequence[str]) -> list[str]:
    """Controllers, and the upper bounds that say which scenarios are feasible."""
    return list(dict.fromkeys([*controllers, *BOUNDS]))


def numbers_of(set_name: str, count: int | None = None) -> range:
    """Numbers of a set's scenarios, the first ``count`` of them where it is given; InputError below 1."""
    if count is not None and count < 1:
        raise InputError(f"{count} episodes of each set: give at least 1.")
    whole = len(load_scenarios(set_name))
    return range(whole if count is None else min(count, whole))


def wanted_episodes(controllers: Sequence[str], sets: Sequence[str], count: int | None = None) -> list[Key]:
    """Episodes of controllers on sets; a bound is left out on sets whose soil law it does not know."""
    return [
        (controller, name, number)
        for name in sets
        for controller in controllers
        if drives_on(controller, load_scenarios(name)[0].law)
        for number in numbers_of(name, count)
    ]


def plan(controllers: Sequence[str], sets: Sequence[str], done: set[Key], count: int | None = None) -> list[Episodes]:
    """Tasks for all episodes that are not done, small enough to resume by."""
    groups: dict[tuple[str, str], list[int]] = {}
    for controller, set_name, number in wanted_episodes(controllers, sets, count):
        if (controller, set_name, number) not in done:
            groups.setdefault((controller, set_name), []).append(number)
    tasks = []
    for (controller, set_name), numbers in groups.items():
        size = _SLOW_CHUNK if find_batch(controller, 1) is None else _CHUNK
        tasks += [Episodes(controller, set_name, tuple(numbers[k : k + size])) for k in range(0, len(numbers), size)]
    return tasks


def run_campaign(
    controllers: Sequence[str],
    sets: Sequence[str],
    folder: Path,
    *,
    processes: int = 2,
    cluster: str = "",
    count: int | None = None,
    progress: Callable[[int], None] = lambda episodes: None,
) -> list[dict[str, Any]]:
    """Drive every controller on every scenario of the sets, continuing what the dataset holds.

    The upper bounds are driven as well, asked for or not: a scenario is feasible if one of them succeeds.

    Args:
        controllers: names.
        sets: names of frozen sets.
        folder: of the :class:`~ddagr_gym.evaluation.dataset.EpisodeDataset`, to which episodes are added as they end;
            rows of other gains, policies or scenarios are driven again. ``episodes.jsonl`` beside it, of an earlier
            version, is taken over.
        processes: workers.
        cluster: as of :class:`ddagr_gym.tasks.TaskRunner`.
        count: only the first scenarios of each set.
        progress: called with the number of episodes that a task added, those of the bounds included.

    Raises:
        InputError: two controllers are one seed of one arm. Or episodes failed, all of them by bad input; the others
            are driven first. Or the dataset is not readable.
        FailedTasksError: episodes failed; the others are driven first.

    Returns:
        The rows of ``controllers`` with ``feasible``, ordered by controller, set and number.
    """
    one_arm_each(controllers)
    everyone = with_bounds(controllers)
    wanted = set(wanted_episodes(everyone, sets, count))
    dataset = EpisodeDataset(folder, folder.parent / EARLIER)
    kept = _keep_valid(dataset, wanted)
    if kept & wanted:
        progress(len(kept & wanted))
    try:
        for added in _results(plan(everyone, sets, kept, count), processes, cluster):
            dataset.append(added)
            progress(len(added))
    finally:
        dataset.write_manifest()
    rows = [row for row in dataset.read() if episode_key(row) in wanted]
    return _judged(rows, controllers, sets)


def _keep_valid(dataset: EpisodeDataset, wanted: set[Key]) -> set[Key]:
    """Drop wanted rows whose scenarios, controller or filter are no longer the same; the keys of the others."""
    now = {pair: provenance(*pair) for pair in {(controller, name) for controller, name, _ in wanted}}
    dataset.keep(lambda row: episode_key(row) not in wanted or row["made_of"] == now[episode_key(row)[:2]])
    return {episode_key(row) for row in dataset.read(IDENTITY)}


def _judged(rows: Sequence[dict[str, Any]], controllers: Sequence[str], sets: Sequence[str]) -> list[dict[str, Any]]:
    """Rows of ``controllers`` with the verdict of the bounds."""
    made = {(row["set"], row["number"]) for row in rows if row["controller"] in BOUNDS and row["success"]}
    order = {name: k for k, name in enumerate(controllers)}
    place = {name: k for k, name in enumerate(sets)}
    # arms by their present names: an earlier version may have stored others
    arms = {name: dict(zip(("arm", "run"), controller_arm(name), strict=True)) for name in controllers}
    mine = [
        row | arms[row["controller"]] | {"feasible": (row["set"], row["number"]) in made}
        for row in rows
        if row["controller"] in order
    ]
    return sorted(mine, key=lambda row: (order[row["controller"]], place[row["set"]], row["number"]))


def _results(wanted: list[Episodes], processes: int, cluster: str) -> Iterator[list[dict[str, Any]]]:
    if not wanted:
        return
    failed: list[Ended] = []
    with TaskRunner(min(processes, len(wanted)), cluster=cluster) as runner:
        for ended in runner.run(_tasks(wanted, runner)):
            if ended.failure is None:
                yield ended.value
            else:
                failed.append(ended)
    raise_failures(failed, len(wanted))


def _tasks(wanted: Sequence[Episodes], runner: TaskRunner) -> list[Task]:
    """Tasks with scenarios and policies by content."""
    sets = {name: runner.share(load_scenarios(name)) for name in {item.set_name for item in wanted}}
    names = {item.controller for item in wanted}
    policies = {name: runner.share_file(policy_file(split_estimate(name)[0])) for name in names if is_policy(name)}
    made_of = {pair: provenance(*pair) for pair in {(item.controller, item.set_name) for item in wanted}}
    return [
        Task(
            str(item),
            _work,
            (
                item,
                sets[item.set_name],
                policies.get(item.controller),
                made_of[item.controller, item.set_name],
                controller_arm(item.controller),
            ),
        )
        for item in wanted
    ]
