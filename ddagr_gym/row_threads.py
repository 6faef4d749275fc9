"""Threads that share the rows of one batch: whoever is free takes the next row.

They are no tasks of :mod:`ddagr_gym.tasks`: a call takes a millisecond, and compiled steps do not hold Python's lock. A
helper is woken by a lock and not through an executor, which takes as long as some rows.
"""

from __future__ import annotations

import contextlib
import threading
import time
import weakref
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.simulator_kernel import advance_rows, wait_until_finished

_LOOKS = 200_000  # (ours) about 0.2 ms, some rows' time, after which a thread sleeps until the others are done
_SLEEP = 1e-4  # (ours) [s]
_WORTH_WAKING = 100  # (ours) samples of all rows together below which a thread that wakes up comes too late


_NOTHING: tuple[Any, ...] = ()
_IDLE: list[_Helper] = []
"""Helpers of batches that are gone: fits make thousands of batches, and a thread takes as long to start as rows do."""


class _Helper:
    """A thread that sleeps until it is woken, and then advances what rows are left of the latest call."""

    def __init__(self) -> None:
        self._call = _NOTHING
        self._woken, self._rested = 0, 0
        self._asleep = threading.Lock()
        self._asleep.acquire()
        self._thread = threading.Thread(target=self._work, name="rows", daemon=True)
        self._thread.start()

    @property
    def is_there(self) -> bool:
        """False in a process that was forked off."""
        return self._thread.is_alive()

    def wake(self, call: tuple[Any, ...]) -> None:
        """Let it help with a call: arguments of :func:`advance_rows`. One that still works then takes the latest."""
        self._call = call
        self._woken += 1
        if self._asleep.locked():
            self._asleep.release()

    def wait(self) -> None:
        """Until it works no more, or is not there."""
        while self.is_there and self._rested < self._woken:
            time.sleep(_SLEEP)

    def forget(self) -> None:
        """Let the arrays of its last call go."""
        self._call = _NOTHING

    def _work(self) -> None:
        while True:
            self._asleep.acquire()
            woken, call = self._woken, self._call
            if call:
                advance_rows(*call)
                del call
            self._rested = woken


def _take_helper() -> _Helper:
    with contextlib.suppress(IndexError):  # another thread may take the last one
        while not (helper := _IDLE.pop()).is_there:
            pass
        return helper
    return _Helper()


def _give_back(helpers: list[_Helper]) -> None:
    for helper in helpers:
        helper.forget()
    _IDLE.extend(helpers)


class RowThreads:
    """The calling thread and its helpers.

    Args:
        count: number of rows N.
        threads: that share them, the calling one included.
    """

    def __init__(self, count: int, threads: int) -> None:
        threads = min(threads, count)
        self._count, self._size = count, threads
        self._turn = 0
        self._ends = np.linspace(0, count, threads + 1).astype(np.int64)
        self._claims = np.zeros(count, dtype=np.int64)
        self._finished = np.zeros(1, dtype=np.int64)
        self._helpers = [_take_helper() for _ in range(1, threads)]
        self._end = weakref.finalize(self, _give_back, self._helpers)

    def __reduce__(self) -> tuple[type[RowThreads], tuple[int, int]]:
        return RowThreads, (self._count, self._size)  # a copy has helpers of its own

    def advance(self, rows: NDArray[np.float64], samples: int, *shared: Any) -> None:
        """Advance all rows; returns when every one is done.

        Args:
            rows: (N, layout.SIZE), updated.
            samples: by which each is advanced.
            shared: stretch, grids, actions and numerics of :func:`advance_rows`.
        """
        self._turn += 1
        call = (self._turn, self._claims, self._finished, *shared)
        helpers = self._helpers if self._count * samples >= _WORTH_WAKING else []
        for part, helper in enumerate(helpers, start=1):
            helper.wake((rows, self._ends, part, *call))
        try:
            advance_rows(rows, self._ends, 0, *call)
            while helpers and not wait_until_finished(self._finished, self._turn * self._count, _LOOKS):
                time.sleep(_SLEEP)
        except BaseException:
            self._abandon()
            raise

    def _abandon(self) -> None:
        """Leave rows that nobody has begun where they are, and let no helper work on."""
        self._claims[:] = self._turn
        for helper in self._helpers:
            helper.wait()
        self._finished[0] = self._turn * self._count

    def close(self) -> None:
        """Give the helpers away; may be called again. Afterwards the calling thread does all rows."""
        self._end()
        self._helpers = []
