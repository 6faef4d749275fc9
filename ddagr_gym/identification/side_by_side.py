"""Independent predictions on threads of their own: compiled steps do not hold Python's lock.

Many predictions with a thread each use two processors better than one after the other with two threads for its windows:
nobody waits at the end of each, and what Python does for one runs beside the steps of another.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import repeat
from typing import TypeVar

Given = TypeVar("Given")
Made = TypeVar("Made")


def side_by_side(make: Callable[[Given, int], Made], given: Sequence[Given], threads: int) -> Iterator[Made]:
    """What is made of each item, in their order; one after the other where there are fewer items than threads.

    Args:
        make: of an item on a number of threads; it must depend on nothing that another call changes.
        given: items.
        threads: that may work at a time.
    """
    if len(given) < threads or threads == 1:
        yield from (make(item, threads) for item in given)
        return
    with ThreadPoolExecutor(threads, thread_name_prefix="predictions") as pool:
        yield from pool.map(make, given, repeat(1))
