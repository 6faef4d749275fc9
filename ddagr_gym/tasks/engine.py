"""What runs tasks: this process, worker processes, or a cluster."""

from __future__ import annotations

from collections import deque
from pathlib import Path
from typing import Any, Protocol

from ddagr_gym.tasks.attempt import attempt
from ddagr_gym.tasks.task import Limits, Outcome, Task


class Engine(Protocol):
    """Runs tasks by number. Its methods are called by one thread."""

    @property
    def slots(self) -> int:
        """Tasks that it runs at once."""

    def begin(self, number: int, task: Task) -> None:
        """Take a task."""

    def ended(self, seconds: float) -> list[tuple[int, Outcome]]:
        """Tasks that have ended since the last call; waits for the first, but not longer than so many seconds."""

    def share(self, value: Any) -> Any:
        """Handle of a value."""

    def share_file(self, path: Path) -> Any:
        """Handle of a file, or of a folder's files."""

    def close(self) -> None:
        """End when nothing runs."""

    def stop(self) -> None:
        """End at once, with all that runs."""


class ThisProcess:
    """Runs one task at a time in this process.

    Args:
        limits: of a task; a limit of time needs other processes.
    """

    slots = 1

    def __init__(self, limits: Limits) -> None:
        if limits.seconds is not None:
            raise ValueError("a limit of time needs a worker process")
        self._limits = limits
        self._taken: deque[tuple[int, Task]] = deque()

    def begin(self, number: int, task: Task) -> None:
        """Take a task, which :meth:`ended` runs."""
        self._taken.append((number, task))

    def ended(self, seconds: float) -> list[tuple[int, Outcome]]:
        """Run the next task."""
        number, task = self._taken.popleft()
        return [(number, attempt(task.function, task.arguments, self._limits.memory))]

    def share(self, value: Any) -> Any:
        """The value itself."""
        return value

    def share_file(self, path: Path) -> Any:
        """The path itself."""
        return path

    def close(self) -> None:
        """Nothing is left."""

    def stop(self) -> None:
        """Nothing runs."""
