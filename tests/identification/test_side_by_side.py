"""Predictions on threads of their own."""

from __future__ import annotations

import threading
import time

import pytest

from ddagr_gym.identification.side_by_side import side_by_side


def test_results_come_in_order_from_as_many_threads_as_work_at_a_time():
    both_work = threading.Barrier(2, timeout=10.0)

    def make(item: int, threads: int) -> tuple[int, int, str]:
        both_work.wait()
        return item, threads, threading.current_thread().name

    made = list(side_by_side(make, range(6), 2))
    assert [(item, threads) for item, threads, _ in made] == [(k, 1) for k in range(6)]
    assert len({name for _, _, name in made}) == 2


@pytest.mark.parametrize(("count", "threads"), [(3, 1), (1, 2), (0, 2)])
def test_few_items_are_made_by_the_calling_thread_with_all_threads(count, threads):
    made = list(side_by_side(lambda item, given: (item, given, threading.get_ident()), range(count), threads))
    assert made == [(k, threads, threading.get_ident()) for k in range(count)]


def test_an_error_ends_what_has_not_begun():
    begun = []

    def make(item: int, threads: int) -> None:
        begun.append(item)
        if item == 0:
            raise ValueError("the first")
        time.sleep(0.01)

    with pytest.raises(ValueError, match="the first"):
        list(side_by_side(make, range(1000), 2))
    assert len(begun) < 1000
