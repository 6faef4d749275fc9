"""Search for the gains of the ladder's closed loops: the same budget, scenarios and objective for every controller.

The search itself is :mod:`ddagr_gym.evaluation.gain_search`; the episodes of one of its stages do not depend on each
other and are driven by the runner of tasks, to the same bits on any number of workers. B6 is searched on other plants
than the nominal one, development scenarios of :mod:`benchmarks.row_turn_plants` with a seed of their own, all others on
the first scenarios of the validation set. Scenarios S0 to S8 and T are never touched.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from benchmarks.row_turn_plants import scenario
from ddagr_gym.control.pid import PidGains
from ddagr_gym.control.tracker_settings import LoopSettings
from ddagr_gym.envs.settings import Episode, TurnSettings
from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.evaluation.campaign import scenario_settings
from ddagr_gym.evaluation.controllers import EKF_CONTROLLERS, find_controller
from ddagr_gym.evaluation.gain_search import Outcome, SearchBox, Wanted, episodes_of, objective, search_box
from ddagr_gym.evaluation.ladder_gains import LadderGains, ladder_gains
from ddagr_gym.evaluation.metrics import turn_metrics
from ddagr_gym.evaluation.runs import drive_turn
from ddagr_gym.evaluation.scenarios import load_scenarios
from ddagr_gym.files import atomic_path
from ddagr_gym.tasks import Ended, Task, TaskRunner
from ddagr_gym.tasks.task import raise_failures

__all__ = ["SPACES", "STAGES", "GainSearch", "SearchSpace", "check_names", "episodes_of", "objective", "write_gains"]

VALIDATION_SET = "V"

PLANT_SEED = 78_002
"""Of the development plants of a search; those of ``benchmarks/results/row_turn_plants.json`` have another."""

STAGES = ((64, 8), (16, 24), (4, 40))
"""Candidates that are driven on so many scenarios; with the hand-chosen gains 872 episodes for each controller."""


_TRACKER = ("course", "ahead", "side_slip", "aligning")  # axes of B6 that are fields of LadderGains


@dataclass(frozen=True)
class SearchSpace(SearchBox):
    """Box of one controller.

    Attributes:
        apply: (gains, values by name) -> gains with these values.
        plants: names of :data:`benchmarks.row_turn_plants.PLANTS` that are driven in turn, instead of set V.
    """

    apply: Callable[[LadderGains, dict[str, float]], LadderGains]
    plants: tuple[str, ...] = ()


def _loop(field: str, limit: float) -> Callable[[LadderGains, dict[str, float]], LadderGains]:
    def apply(gains: LadderGains, values: dict[str, float]) -> LadderGains:
        pid = PidGains(values["proportional"], values["integral"], values.get("derivative", 0.0), limit)
        loop = LoopSettings(pid, values["lead_factor"])
        changed: dict[str, Any] = {field: loop}
        if "heading" in values:
            changed["true_path_heading"] = values["heading"]
        changed |= {f"path_tracker_{name}": values[name] for name in _TRACKER if name in values}
        return replace(gains, **changed)

    return apply


_LEAD = ("lead_factor", 0.3, 3.0)

SPACES = {
    "B2": SearchSpace(
        (("proportional", 0.05, 20.0), ("integral", 0.02, 20.0), ("derivative", 1e-3, 1.0), _LEAD),
        (2.0, 2.0, 0.0, 1.0),
        _loop("yaw_rate", 3.0),
    ),
    "B3": SearchSpace(
        (("proportional", 0.1, 30.0), ("integral", 0.01, 10.0), ("derivative", 1e-3, 3.0), _LEAD),
        (3.0, 0.5, 0.0, 1.0),
        _loop("radial", 2.0),
    ),
    "B4": SearchSpace(
        (("proportional", 0.02, 5.0), ("integral", 0.05, 20.0), ("derivative", 1e-4, 0.3), _LEAD),
        (0.3, 1.0, 0.0, 1.0),
        _loop("force_balance", 1.0),
    ),
    "B5": SearchSpace(
        (
            ("lateral", 1.0, 500.0),
            ("heading", 0.1, 50.0),
            ("speed", 0.5, 50.0),
            ("change", 0.002, 0.5),
            ("offset_rate", 0.01, 0.5),
        ),
        (20.0, 2.0, 5.0, 0.05, 0.1),
        lambda gains, values: replace(gains, predictive=replace(gains.predictive, **values)),  # type: ignore[arg-type]
    ),
    "B6": SearchSpace(
        (
            ("proportional", 20.0, 150.0),
            ("integral", 0.5, 50.0),
            ("course", 6.0, 30.0),
            ("lead_factor", 0.05, 1.0),
            ("ahead", 0.05, 0.4),
            ("side_slip", 0.3, 1.0),
            ("aligning", 0.1, 0.6),
        ),
        (73.0, 20.0, 18.0, 0.05, 0.2, 0.7, 0.3),
        _loop("path_tracker", 3.0),
        ("level", "slope_3", "late", "slope_5", "lateral_0.8", "slope_3", "weaker", "slope_5"),
    ),
    "true_curvature": SearchSpace(
        (("proportional", 0.02, 5.0), ("integral", 0.05, 40.0), ("derivative", 1e-4, 0.3), _LEAD),
        (0.5, 3.0, 0.0, 1.0),
        _loop("true_curvature", 2.0),
    ),
    "true_soil": SearchSpace(
        (("proportional", 0.02, 5.0), ("integral", 0.05, 40.0), ("derivative", 1e-4, 0.3), _LEAD),
        (0.5, 3.0, 0.0, 1.0),
        _loop("true_soil", 2.0),
    ),
    "true_path": SearchSpace(
        (("proportional", 1.0, 100.0), ("integral", 0.05, 50.0), ("heading", 0.5, 20.0), _LEAD),
        (10.0, 2.0, 4.0, 1.0),
        _loop("true_path", 3.0),
    ),
}
"""Controllers that have something to search for; B0 has nothing, B1 is calibrated on the nominal soil."""


class GainSearch:
    """Search of one controller, resumed from a journal of what has been driven.

    Args:
        controller: name in :data:`SPACES`.
        journal: JSON lines, appended as episodes end.
        seed: of the candidates.
        stages: see :data:`STAGES`; fewer scenarios and candidates in a later one.
        progress: called with the number of episodes as they end, those of the journal included.
        runner: drives the episodes; this process where it is None.

    Raises:
        InputError: a controller without gains.
    """

    def __init__(
        self,
        controller: str,
        journal: Path,
        *,
        seed: int = 0,
        stages: Sequence[tuple[int, int]] = STAGES,
        progress: Callable[[int], None] = lambda episodes: None,
        runner: TaskRunner | None = None,
    ) -> None:
        if controller not in SPACES:
            raise unknown_name("controller with gains", controller, SPACES)
        self.controller, self.space, self.seed = controller, SPACES[controller], seed
        self.stages, self._progress, self._journal = tuple(stages), progress, journal
        self._runner = runner
        self._scenarios = [] if self.space.plants else load_scenarios(VALIDATION_SET)[: self.stages[-1][1]]
        self._driven = self._read()

    def _read(self) -> dict[tuple[str, int], tuple[float | None, bool]]:
        driven = {}
        if self._journal.is_file():
            for line in self._journal.read_text(encoding="utf-8").splitlines():
                try:
                    item = json.loads(line)
                except json.JSONDecodeError:
                    break  # cut off by an interruption
                if item["controller"] == self.controller:
                    driven[item["values"], item["number"]] = (item["error"], item["success"])
        return driven

    def _scenario(self, number: int) -> tuple[TurnSettings, Episode, int]:
        plants = self.space.plants
        if plants:
            return scenario(plants[number % len(plants)], number, PLANT_SEED)
        found = self._scenarios[number]
        return scenario_settings(found, self.controller in EKF_CONTROLLERS), found.episode, found.seed

    def _drive(self, wanted: Sequence[Wanted]) -> list[Outcome]:
        keys = [(json.dumps(values), number) for values, number in wanted]
        missing = [key for key in dict.fromkeys(keys) if key not in self._driven]
        self._progress(len(wanted) - len(missing))
        if missing:
            self._drive_missing(missing)
        return [self._driven[key] for key in keys]

    def _drive_missing(self, keys: Sequence[tuple[str, int]]) -> None:
        """Drive episodes, each kept as it ends; those that fail are named when the others have ended."""
        tasks = {f"{self.controller} with {text} on {number}": (text, number) for text, number in keys}
        failed: list[Ended] = []
        with contextlib.ExitStack() as stack:
            runner = self._runner or stack.enter_context(TaskRunner())
            for ended in runner.run(Task(name, drive_once, self._arguments(*key)) for name, key in tasks.items()):
                if ended.failure is None:
                    self._keep(*tasks[ended.task.name], ended.value)
                else:
                    failed.append(ended)
        raise_failures(failed, len(tasks))

    def _arguments(self, values: str, number: int) -> tuple[str, LadderGains, TurnSettings, Episode, int]:
        return self.controller, self.space.apply(ladder_gains(), json.loads(values)), *self._scenario(number)

    def _keep(self, values: str, number: int, outcome: Outcome) -> None:
        error, success = outcome
        self._driven[values, number] = (error, success)
        row = {"controller": self.controller, "values": values, "number": number, "error": error, "success": success}
        with self._journal.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
        self._progress(1)

    def run(self) -> dict[str, Any]:
        """Best values, and the record of the search."""
        return {
            "controller": self.controller,
            "seed": self.seed,
            "stages": [list(stage) for stage in self.stages],
            "axes": [list(axis) for axis in self.space.axes],
            **search_box(self.space, self._drive, self.stages, self.seed),
        }


def drive_once(controller: str, gains: LadderGains, settings: TurnSettings, episode: Episode, seed: int) -> Outcome:
    """One episode of a controller with gains; workers call it by name."""
    run = drive_turn(find_controller(controller, episode.turn, gains), settings, seed, episode)
    error = turn_metrics(run.columns, run.episode.turn, run.episode.robot).turn.error
    return error, bool(run.success)


def write_gains(records: Sequence[dict[str, Any]], path: Path) -> LadderGains:
    """Write the present gains with what searches found in place, as YAML that :func:`ladder_gains` reads."""
    import yaml

    gains = ladder_gains()
    for record in records:
        gains = SPACES[record["controller"]].apply(gains, record["best"])
    head = (
        "# Gains of the controllers' loops; each output is a curvature [1/m] of at most `limit`. Found by\n"
        "# `ddagr tune-controllers` on the validation set, those of the path tracker on development plants; its\n"
        "# record is gain_search.json beside this file.\n"
    )
    with atomic_path(path) as temporary:
        temporary.write_text(head + yaml.safe_dump(asdict(gains), sort_keys=False), encoding="utf-8")
    return gains


def check_names(names: Sequence[str]) -> list[str]:
    """Names of controllers with gains, each once; InputError for others or none."""
    for name in names:
        if name not in SPACES:
            raise unknown_name("controller with gains", name, SPACES)
    if not names:
        raise InputError(f"no controller is named: give some of {', '.join(SPACES)}.")
    return list(dict.fromkeys(names))
