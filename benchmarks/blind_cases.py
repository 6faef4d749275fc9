"""Blind cases of public seeds, diagnosed names only: what the benchmarks on forms of effects share."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.concealed.cases import Case, plan
from benchmarks.concealed.simulate import simulate_case
from benchmarks.mid_drive_drives import as_recording
from ddagr_gym.api.diagnose import diagnose
from ddagr_gym.diagnosis.answer.verdict import Diagnosis
from ddagr_gym.presets import get_robot
from ddagr_gym.tasks import ResultStore, Task, TaskRunner, run_tasks

SET = "ninth"
SEEDS = (2001, 2002, 2003, 2004)

Answer = dict[str, Any]


def idle_cases(seed: int, most: int) -> list[tuple[int, Case]]:
    """Seed and case of the first ones of a set in which nothing is missing."""
    return [(seed, case) for case in plan(SET, seed) if case.kind.endswith("null")][:most]


def diagnosed(seed: int, case: Case) -> tuple[Diagnosis, Mapping[str, Any]]:
    """What is said of a case, and its label.

    Args:
        seed: of its set.
        case: of it.
    """
    logs, label = simulate_case(case, seed)
    robot = get_robot("ddagr")
    drives = [as_recording(log, robot, run) for run, log in logs.items()]
    return diagnose(drives, robot=robot, soil="thesis_a1", names_only=True).outcome.diagnosis, label


def answers_to(
    cases: Sequence[tuple[int, Case]], answer: Callable[[int, Case], Answer], workers: int, parts: Path
) -> list[Answer]:
    """Answers to cases in their order; those in the folder of parts are not made again.

    Args:
        cases: seed and case.
        answer: to one of them.
        workers: processes.
        parts: folder of finished answers.
    """
    tasks = [Task(f"{seed} {case.name}", answer, (seed, case), key=f"{seed}-{case.name}") for seed, case in cases]
    with TaskRunner(workers) as runner:
        return run_tasks(tasks, "cases", runner, ResultStore(parts))
