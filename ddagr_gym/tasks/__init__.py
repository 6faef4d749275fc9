"""Independent tasks on worker processes of this machine, or on a Ray cluster, behind one interface.

A :class:`Task` is a function by name with its arguments, the name of its case, and a key by content and code. A
:class:`TaskRunner` runs tasks and yields what became of each as it ends; with a :class:`ResultStore` the same command
does only what is missing::

    with TaskRunner(workers=2) as runner:
        drives = runner.share(recordings)
        tasks = [Task(f"null {n}", run_null, (drives, n), key=f"{bank}_{n:03d}") for n in range(60)]
        for ended in runner.run(tasks, store=ResultStore(folder)):
            ...

:func:`run_tasks` is the same with a bar of progress, and gives all results in the order of the tasks. A task that
raises, or exceeds its time or memory, is named with its case, and the rest goes on. A task whose worker was lost is
begun again. Results depend on the tasks alone: they have the same bits on either engine and on any number of workers.
"""

from ddagr_gym.tasks.run import results_of, run_tasks
from ddagr_gym.tasks.runner import TaskRunner
from ddagr_gym.tasks.shared import release
from ddagr_gym.tasks.store import ResultStore
from ddagr_gym.tasks.task import Ended, FailedTasksError, Failure, Limits, Task

__all__ = [
    "Ended",
    "FailedTasksError",
    "Failure",
    "Limits",
    "ResultStore",
    "Task",
    "TaskRunner",
    "release",
    "results_of",
    "run_tasks",
]
