"""What a worker does: one call, its limit of memory, and its failure in words. No exception leaves a worker."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from threadpoolctl import ThreadpoolController

from ddagr_gym.errors import InputError
from ddagr_gym.tasks.shared import Handle
from ddagr_gym.tasks.task import Failure, Outcome


def attempt(function: Callable[..., Any], arguments: tuple[Any, ...], memory: int | None) -> Outcome:
    """Call a function with shared arguments in their place.

    Linear algebra runs in one thread: on several it gives other last bits, and workers would share the processors.

    Args:
        function: to call.
        arguments: of it; a :class:`~ddagr_gym.tasks.shared.Handle` stands for its content.
        memory: limit of the process's data [bytes].
    """
    try:
        with memory_limit(memory), linear_algebra().limit(limits=1, user_api="blas"):
            given = [item.content() if isinstance(item, Handle) else item for item in arguments]
            return Outcome(function(*given))
    except MemoryError as error:
        if memory is None:
            return Outcome(failure=_raised(error))
        return Outcome(failure=Failure("over its memory", f"limit of {memory / 2**20:.0f} MiB"))
    except Exception as error:
        return Outcome(failure=_raised(error))


@cache
def linear_algebra() -> ThreadpoolController:
    """Control of the threads of numpy's and scipy's linear algebra, which are loaded where they are not yet."""
    # it has a library of its own beside numpy's
    import scipy.linalg  # noqa: F401

    return ThreadpoolController()


def _raised(error: Exception) -> Failure:
    bad_input = isinstance(error, InputError)
    message = str(error) if bad_input else "".join(traceback.format_exception_only(error)).strip()
    return Failure("raised", message, "" if bad_input else traceback.format_exc(), bad_input)


def check_memory_limit(memory: int | None) -> None:
    """Refuse a limit that this system does not keep.

    Raises:
        InputError: not on Linux.
    """
    if memory is not None and sys.platform != "linux":
        raise InputError("a memory limit of a task needs Linux: leave it out.")


@contextmanager
def memory_limit(memory: int | None) -> Iterator[None]:
    """Block in which this process may hold so much data; what asks for more gets a MemoryError.

    Args:
        memory: limit [bytes]; None changes nothing.
    """
    if memory is None:
        yield
        return
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
    resource.setrlimit(resource.RLIMIT_DATA, (memory if hard == resource.RLIM_INFINITY else min(memory, hard), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))
