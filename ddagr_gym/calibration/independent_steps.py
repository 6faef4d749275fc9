"""Steps of a calibration that do not depend on each other: run side by side, each kept as it ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Any

from ddagr_gym.tasks import Task, TaskRunner, results_of
from ddagr_gym.tasks.store import Store


@dataclass(frozen=True, eq=False)
class IndependentSteps:
    """What runs them.

    Attributes:
        runner: of this process, of worker processes or of a cluster; the results have the same bits.
        store: of finished steps, by the keys of the tasks.
        progress: called with a line of text as steps end.
    """

    runner: TaskRunner
    store: Store
    progress: Callable[[str], None] = lambda line: None

    def results(self, label: str, tasks: Sequence[Task]) -> list[Any]:
        """Results in the order of the tasks: kept ones, and those that are made now.

        Args:
            label: what is being done.
            tasks: with the names of the steps as keys.

        Raises:
            InputError: tasks failed, all of them by bad input; the others ended before.
            FailedTasksError: tasks failed; the others ended before.
        """
        ended = count(1)
        self.progress(label)
        return results_of(
            tasks, self.runner, self.store, lambda: self.progress(f"{label}: {next(ended)} of {len(tasks)}")
        )
