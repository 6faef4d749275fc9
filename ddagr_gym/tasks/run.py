"""All results of some tasks, in their order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ddagr_gym.progress import Progress
from ddagr_gym.tasks.runner import TaskRunner
from ddagr_gym.tasks.store import Store
from ddagr_gym.tasks.task import Ended, Task, raise_failures


def run_tasks(tasks: Sequence[Task], label: str, runner: TaskRunner, store: Store | None = None) -> list[Any]:
    """Results of all tasks, with a bar of progress.

    Args:
        tasks: to run.
        label: what is being done.
        runner: to run them.
        store: of finished results.

    Raises:
        InputError: tasks failed, all of them by bad input; the others ended before.
        FailedTasksError: tasks failed; the others ended before.
    """
    if not tasks:
        return []
    with Progress(len(tasks), label) as progress:
        return results_of(tasks, runner, store, progress.advance)


def results_of(
    tasks: Sequence[Task],
    runner: TaskRunner,
    store: Store | None = None,
    progress: Callable[[], object] = lambda: None,
) -> list[Any]:
    """Results of all tasks.

    Args:
        tasks: to run.
        runner: to run them.
        store: of finished results.
        progress: called after each.

    Raises:
        InputError: as :func:`run_tasks`.
        FailedTasksError: likewise.
    """
    places = {id(task): place for place, task in enumerate(tasks)}
    ended: dict[int, Ended] = {}
    for item in runner.run(tasks, store):
        ended[places[id(item.task)]] = item
        progress()
    ordered = [ended[place] for place in range(len(tasks))]
    raise_failures([item for item in ordered if item.failure is not None], len(tasks))
    return [item.value for item in ordered]
