"""Worker processes that never outlive the command that started them."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from types import FrameType
from typing import Any

STOPPED = 128 + signal.SIGTERM
"""Exit code of a command that was asked to end, as shells give it."""
POLL = 0.5
"""Time between a worker's looks at whether its parent lives [s] (ours)."""


@contextmanager
def worker_pool(processes: int) -> Iterator[ProcessPoolExecutor]:
    """Pool of processes that end at once when the block ends by an exception, SIGTERM included.

    A worker whose parent was killed ends by itself within :data:`POLL`. An interrupt from the terminal is the parent's,
    which ends the workers.

    Args:
        processes: workers.
    """
    with _sigterm_raises():
        pool = ProcessPoolExecutor(processes, initializer=_follow_parent)
        try:
            yield pool
        except BaseException:
            # No public way before Python 3.14; shutdown forgets them.
            workers = list((pool._processes or {}).values())
            pool.shutdown(wait=False, cancel_futures=True)
            for worker in workers:
                worker.terminate()
            raise
        pool.shutdown()


@contextmanager
def _sigterm_raises() -> Iterator[None]:
    """SIGTERM ends the block by SystemExit, so that what it began is cleared away; main thread only."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before: Any = signal.signal(signal.SIGTERM, _raise_exit)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _raise_exit(number: int, frame: FrameType | None) -> None:
    raise SystemExit(STOPPED)


def _follow_parent() -> None:
    """Leave interrupts to the parent, and end when it is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(POLL)
    os._exit(1)
