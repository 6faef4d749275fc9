"""Worker processes of this machine.

Pebble, because it loses one task with a killed worker and stops a task that exceeds its time: with two workers of which
one was killed, ``concurrent.futures`` and loky failed the 16 of 20 tasks that had not ended and their pools were of no
further use; the cost of a task was alike (0.1 % of 1 s).
"""

from __future__ import annotations

import os
import pickle
import shutil
import signal
import tempfile
import threading
import time
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from multiprocessing import current_process, get_context
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from pebble import ProcessExpired, ProcessPool

from ddagr_gym.errors import InputError
from ddagr_gym.tasks.attempt import attempt, linear_algebra
from ddagr_gym.tasks.shared import SharedFile, SharedPath, pickled
from ddagr_gym.tasks.task import Failure, Limits, Outcome, Task

POLL = 0.5
"""Time between a worker's looks at whether its parent lives [s] (ours)."""


class LocalProcesses:
    """Worker processes that end with this one, however it ends.

    An interrupt from the terminal is the parent's, which ends the workers. A worker whose parent was killed ends by
    itself within :data:`POLL`.

    Args:
        workers: processes, started as tasks come.
        limits: of a task.
        fresh: whether every task has a process of its own.
    """

    def __init__(self, workers: int, limits: Limits, fresh: bool = False) -> None:
        if _starting():
            # a worker that runs its parent's script anew: silent, for the parent says what to do
            raise SystemExit(1)
        self.slots = workers
        self._limits = limits
        self._done: SimpleQueue[tuple[int, Future[Any]]] = SimpleQueue()
        self._folder: Path | None = None
        # spawn: a fork would copy the locks of this process's threads
        self._pool = ProcessPool(
            workers, max_tasks=1 if fresh else 0, initializer=_follow_parent, context=get_context("spawn")
        )

    def begin(self, number: int, task: Task) -> None:
        """Give a task to the pool."""
        call = pickle.dumps((task.function, task.arguments))
        future = self._pool.schedule(_attempt, args=(call, self._limits.memory), timeout=self._limits.seconds)
        future.add_done_callback(partial(self._put, number))

    def _put(self, number: int, future: Future[Any]) -> None:
        self._done.put((number, future))

    def ended(self, seconds: float) -> list[tuple[int, Outcome]]:
        """What has ended."""
        found = []
        try:
            found.append(self._done.get(timeout=seconds))
            while True:
                found.append(self._done.get_nowait())
        except Empty:
            return [(number, self._outcome(future)) for number, future in found]

    def _outcome(self, future: Future[Any]) -> Outcome:
        error = future.exception()
        if error is None:
            outcome: Outcome = pickle.loads(future.result())
            return outcome
        if isinstance(error, ProcessExpired):
            return Outcome(failure=Failure("lost", f"its worker ended with code {error.exitcode}"))
        if isinstance(error, BrokenProcessPool):
            raise InputError(
                "the worker processes ended while they started: in a script, which each of them runs anew, put the "
                'work below `if __name__ == "__main__":`, or let one process do it (processes=1).'
            ) from None
        if isinstance(error, TimeoutError):
            return Outcome(failure=Failure("over its time", f"limit of {self._limits.seconds:g} s"))
        raise error

    def share(self, value: Any) -> SharedFile:
        """Handle of a value, which is written once to a temporary file."""
        digest, data = pickled(value)
        self._folder = self._folder or Path(tempfile.mkdtemp(prefix="ddagr-shared-"))
        file = self._folder / digest
        if not file.is_file():
            file.write_bytes(data)
        return SharedFile(digest, str(file))

    def share_file(self, path: Path) -> SharedPath:
        """Handle of a file where it is."""
        return SharedPath("", str(path.resolve()))

    def close(self) -> None:
        """Wait for the workers to end."""
        self._pool.close()
        self._pool.join()
        self._remove_folder()

    def stop(self) -> None:
        """End the workers."""
        self._pool.stop()
        self._pool.join()
        self._remove_folder()

    def _remove_folder(self) -> None:
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)


def _starting() -> bool:
    """Whether this is a worker that still loads its parent's script."""
    return bool(getattr(current_process(), "_inheriting", False))


def _attempt(call: bytes, memory: int | None) -> bytes:
    """One call, there and back as bytes: the pool's own pickling of a result that cannot be sent ends its worker."""
    function, arguments = pickle.loads(call)
    outcome = attempt(function, arguments, memory)
    try:
        return pickle.dumps(outcome)
    except Exception as error:
        return pickle.dumps(Outcome(failure=Failure("raised", f"its result cannot be sent: {error}")))


def _follow_parent() -> None:
    """Leave interrupts to the parent, and end when it is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    # what every task needs is loaded before the time of the first one counts
    linear_algebra()


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(POLL)
    os._exit(1)
