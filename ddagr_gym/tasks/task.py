"""What a task is, its limits, and what became of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from ddagr_gym.errors import InputError

FailureKind = Literal["raised", "lost", "over its time", "over its memory"]

_NAMED = 5
"""Failures that a message names (ours); the others are counted."""


@dataclass(frozen=True)
class Task:
    """One call of a function.

    Attributes:
        name: of the case, as messages give it.
        function: of a module; workers find it by its name, so that it can be no lambda and no function of a function.
        arguments: that can be pickled; large ones that many tasks have in common through
            :meth:`ddagr_gym.tasks.runner.TaskRunner.share`.
        key: under which the result is stored: a hash of all that it depends on, data and code. Empty stores nothing.
    """

    name: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...] = ()
    key: str = ""


@dataclass(frozen=True)
class Limits:
    """Of every task.

    Attributes:
        seconds: after which a task is stopped; none when None. It needs a worker process of its own.
        memory: of a worker's data, what it has imported included [bytes]; Linux only, none when None.
        attempts: how often a task is begun whose worker was lost each time.
    """

    seconds: float | None = None
    memory: int | None = None
    attempts: int = 3

    def __post_init__(self) -> None:
        if self.seconds is not None and not self.seconds > 0.0:
            raise InputError(f"the time limit of a task is {self.seconds:g} s: give more than 0.")
        if self.memory is not None and self.memory < 1:
            raise InputError(f"the memory limit of a task is {self.memory} bytes: give at least 1.")
        if self.attempts < 1:
            raise InputError(f"a task has {self.attempts} attempts: give at least 1.")


@dataclass(frozen=True)
class Failure:
    """Why a task has no result.

    Attributes:
        kind: what happened.
        message: in words.
        traceback: of the worker, where the task raised.
        bad_input: whether the task raised an :class:`~ddagr_gym.errors.InputError`.
    """

    kind: FailureKind
    message: str
    traceback: str = ""
    bad_input: bool = False


@dataclass(frozen=True)
class Outcome:
    """What a worker gives back: a value, or a failure."""

    value: Any = None
    failure: Failure | None = None


@dataclass(frozen=True)
class Ended:
    """A task that has ended.

    Attributes:
        task: that was asked for.
        value: of the function; None after a failure.
        failure: None after success.
        stored: whether the value was there already.
    """

    task: Task
    value: Any = None
    failure: Failure | None = None
    stored: bool = False


class FailedTasksError(RuntimeError):
    """Some tasks have no result; all others ended and are stored where there is a store.

    Args:
        failed: tasks with their failures, at least one.
        count: of all tasks.
    """

    def __init__(self, failed: Sequence[Ended], count: int) -> None:
        self.failed = tuple(failed)
        super().__init__(f"{len(failed)} of {count} tasks failed: {_named(failed)}")
        for ended in failed[:_NAMED]:
            if ended.failure is not None and ended.failure.traceback:
                self.add_note(f"{ended.task.name}:\n{ended.failure.traceback}")


def raise_failures(failed: Sequence[Ended], count: int) -> None:
    """Raise for tasks that failed; nothing where there are none.

    Args:
        failed: tasks with their failures.
        count: of all tasks.

    Raises:
        InputError: all of them raised one.
        FailedTasksError: otherwise.
    """
    if failed and all(ended.failure is not None and ended.failure.bad_input for ended in failed):
        raise InputError(_named(failed))
    if failed:
        raise FailedTasksError(failed, count)


def _named(failed: Sequence[Ended]) -> str:
    words = []
    for ended in failed[:_NAMED]:
        failure = ended.failure
        assert failure is not None
        plain = failure.message if failure.bad_input else f"{failure.kind} ({failure.message})"
        words.append(f"{ended.task.name}: {plain}")
    others = len(failed) - len(words)
    return "; ".join(words) + (f"; and {others} more" if others else "")
