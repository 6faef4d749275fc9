"""Runs independent tasks: what is stored is not run, what was lost is begun again, what fails is named."""

from __future__ import annotations

import signal
import threading
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from itertools import count
from pathlib import Path
from types import FrameType, TracebackType
from typing import Any

from ddagr_gym.errors import at_least
from ddagr_gym.extras import need
from ddagr_gym.tasks.attempt import check_memory_limit
from ddagr_gym.tasks.engine import Engine, ThisProcess
from ddagr_gym.tasks.store import Kept, Store
from ddagr_gym.tasks.task import Ended, Failure, Limits, Outcome, Task

STOPPED = 128 + signal.SIGTERM
"""Exit code of a command that was asked to end, as shells give it."""
AHEAD = 2
"""Tasks that an engine holds for each that it runs (ours): no worker waits, and memory does not grow with the tasks."""
WAIT = 0.5
"""Longest wait for a task before interrupts are looked at [s] (ours)."""


@dataclass
class _Attempt:
    task: Task
    begun: int = 0


class TaskRunner(AbstractContextManager["TaskRunner"]):
    """Engine for as long as a block lasts; workers end with it, by an exception or SIGTERM at once.

    Args:
        workers: processes; 1 without limit of time runs the tasks in this process.
        cluster: empty for processes of this machine, "local" for a Ray cluster that is started here with so many
            processors, or the address of one.
        limits: of every task.
        fresh: whether every task has a process of its own.
        engine: to use instead of one of these.

    Raises:
        InputError: no worker, a limit that is not kept here, or a cluster that does not answer.
    """

    def __init__(
        self,
        workers: int = 1,
        *,
        cluster: str = "",
        limits: Limits | None = None,
        fresh: bool = False,
        engine: Engine | None = None,
    ) -> None:
        at_least(workers=(workers, 1))
        self._limits = limits or Limits()
        check_memory_limit(self._limits.memory)
        self._given = engine
        self._make = partial(_engine, workers, cluster, self._limits, fresh)
        self._numbers = count()
        self._asked_to_end = False

    def __enter__(self) -> TaskRunner:
        """Start the engine, and take SIGTERM as a request to end it and leave; of the main thread only."""
        main = threading.current_thread() is threading.main_thread()
        self._before: Any = signal.getsignal(signal.SIGTERM) if main else None
        self._engine = self._given or self._make()
        if main:
            signal.signal(signal.SIGTERM, self._end)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the engine."""
        try:
            (self._engine.close if kind is None else self._engine.stop)()
        finally:
            if self._before is not None:
                signal.signal(signal.SIGTERM, self._before)
        if self._asked_to_end:
            # an engine may have put an exit of its own in place of this one
            raise SystemExit(STOPPED)

    def _end(self, number: int, frame: FrameType | None) -> None:
        self._asked_to_end = True
        raise SystemExit(STOPPED)

    def share(self, value: Any) -> Any:
        """Handle of a value that many tasks need, to give among their arguments: sent once to a worker or node."""
        return self._engine.share(value)

    def share_file(self, path: Path) -> Any:
        """Handle of a file, or of a folder's files; the task gets a path at which its content lies on the node."""
        return self._engine.share_file(path)

    def run(self, tasks: Iterable[Task], store: Store | None = None) -> Iterator[Ended]:
        """What becomes of tasks, as they end; those whose results are stored first come as they are met.

        Args:
            tasks: taken as workers get free, so that they may be many.
            store: of finished results; a result is stored before it is given.
        """
        source, again = iter(tasks), deque[_Attempt]()
        running: dict[int, _Attempt] = {}
        left = True
        while left or again or running:
            while (left or again) and len(running) < AHEAD * self._engine.slots:
                item = again.popleft() if again else _next(source)
                if item is None:
                    left = False
                elif (kept := _find(store, item.task)) is not None:
                    yield Ended(item.task, kept.value, stored=True)
                else:
                    self._begin(item, running)
            if running:
                yield from self._ended(running, again, store)

    def _begin(self, item: _Attempt, running: dict[int, _Attempt]) -> None:
        number = next(self._numbers)
        item.begun += 1
        running[number] = item
        self._engine.begin(number, item.task)

    def _ended(self, running: dict[int, _Attempt], again: deque[_Attempt], store: Store | None) -> Iterator[Ended]:
        for number, outcome in self._engine.ended(WAIT):
            item = running.pop(number)
            failure = outcome.failure
            if failure is not None and failure.kind == "lost" and item.begun < self._limits.attempts:
                again.append(item)
                continue
            value = outcome.value
            if failure is None and store is not None and item.task.key:
                value = store.put(item.task.key, value)
            yield Ended(item.task, value, _with_attempts(outcome, item.begun))


def _with_attempts(outcome: Outcome, begun: int) -> Failure | None:
    failure = outcome.failure
    if failure is None or failure.kind != "lost":
        return failure
    return Failure("lost", f"{failure.message}, {begun} times")


def _find(store: Store | None, task: Task) -> Kept | None:
    """The stored result of a task; none for one without a key."""
    return store.find(task.key) if store is not None and task.key else None


def _next(source: Iterator[Task]) -> _Attempt | None:
    task = next(source, None)
    return None if task is None else _Attempt(task)


def _engine(workers: int, cluster: str, limits: Limits, fresh: bool) -> Engine:
    if cluster:
        need("ray")
        from ddagr_gym.tasks.engine_ray import RayCluster

        return RayCluster(cluster, workers, limits, fresh)
    if workers == 1 and limits.seconds is None and not fresh:
        return ThisProcess(limits)
    from ddagr_gym.tasks.engine_local import LocalProcesses

    return LocalProcesses(workers, limits, fresh)
