"""All results of some tasks, with a bar of progress."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ddagr_gym.progress import Progress
from ddagr_gym.tasks.runner import TaskRunner
from ddagr_gym.tasks.store import ResultStore
from ddagr_gym.tasks.task import Ended, Task, raise_failures


def run_tasks(tasks: Sequence[Task], label: str, runner: TaskRunner, store: ResultStore | None = None) -> list[Any]:
    """Results of all tasks, in their order.

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
    ended: dict[int, Ended] = {}
    with Progress(len(tasks), label) as progress:
        places = {id(task): place for place, task in enumerate(tasks)}
        for item in runner.run(tasks, store):
            ended[places[id(item.task)]] = item
            progress.advance()
    ordered = [ended[place] for place in range(len(tasks))]
    raise_failures([item for item in ordered if item.failure is not None], len(tasks))
    return [item.value for item in ordered]
