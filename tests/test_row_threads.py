"""Threads that share the rows of a batch: late, interrupted, ended and forked ones leave nothing wrong."""

import copy
import gc
import os
import threading
import weakref

import numpy as np
import pytest

from ddagr_gym import row_threads
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.simulator import Simulator
from ddagr_gym.simulator_kernel import advance_rows

COMMANDS = np.full((5, 2), 1.0)


def _batch(threads=2):
    simulator = Simulator(5, threads=threads)
    for n in range(5):
        simulator.configure(n, get_robot("ddagr"), get_soil("thesis_a1"))
    simulator.reset()
    return simulator


def _moved(batch, before):
    return (batch.rows != before).any(axis=1).tolist()


def test_a_row_that_another_thread_has_claimed_is_left_alone(monkeypatch):
    """Also by a thread that has done its own part and helps with the others."""
    batch = _batch()
    before = batch.rows.copy()

    def with_claims(rows, ends, part, turn, claims, finished, *rest):
        if part == 0:
            claims[[1, 3]] = turn
            finished[0] += 2
        return advance_rows(rows, ends, part, turn, claims, finished, *rest)

    monkeypatch.setattr(row_threads, "advance_rows", with_claims)
    monkeypatch.setattr(row_threads, "_WORTH_WAKING", 1000)
    batch.step(COMMANDS, samples=30)
    assert _moved(batch, before) == [True, False, True, False, True]


def test_a_helper_that_comes_late_changes_nothing(monkeypatch):
    batch, alone = _batch(), _batch(threads=1)
    begun, go, calls = threading.Event(), threading.Event(), []

    def late(rows, ends, part, *rest):
        if part == 1:
            begun.set()
            go.wait()
            calls.append(rest[0])
        return advance_rows(rows, ends, part, *rest)

    monkeypatch.setattr(row_threads, "advance_rows", late)
    batch.step(COMMANDS, samples=30)
    begun.wait()
    for _ in range(2):
        batch.step(COMMANDS, samples=30)
    after = batch.rows.copy()
    go.set()
    batch._threads._helpers[0].wait()
    for _ in range(3):
        alone.step(COMMANDS, samples=30)
    assert calls == [1, 3]  # it has slept through the second call
    np.testing.assert_array_equal(batch.rows, after)
    np.testing.assert_array_equal(batch.rows, alone.rows)


def test_an_interrupted_call_leaves_rows_alone_that_nobody_has_begun_and_the_next_one_works(monkeypatch):
    batch = _batch()
    before = batch.rows.copy()

    def interrupted(rows, ends, part, *rest):
        if part == 0:
            raise KeyboardInterrupt
        return None

    with monkeypatch.context() as patch:
        patch.setattr(row_threads, "advance_rows", interrupted)
        with pytest.raises(KeyboardInterrupt):
            batch.step(COMMANDS, samples=30)
    assert not any(_moved(batch, before))
    batch.step(COMMANDS, samples=30)
    assert all(_moved(batch, before))


def test_helpers_of_a_batch_that_is_closed_or_gone_help_the_next_one(monkeypatch):
    gc.collect()  # batches of other tests
    monkeypatch.setattr(row_threads, "_IDLE", [])
    batch = _batch(threads=3)
    first = list(batch._threads._helpers)
    batch.close()
    batch.close()
    before = batch.rows.copy()
    batch.step(COMMANDS, samples=30)  # the calling thread does it all
    assert all(_moved(batch, before))
    other = _batch(threads=2)
    assert other._threads._helpers[0] in first
    other.step(COMMANDS, samples=30)
    np.testing.assert_array_equal(other.rows, batch.rows)
    del other
    gc.collect()
    assert set(row_threads._IDLE) >= set(first)


def test_a_helper_that_is_given_back_holds_no_arrays(monkeypatch):
    monkeypatch.setattr(row_threads, "_IDLE", [])
    batch = _batch()
    batch.step(COMMANDS, samples=30)
    rows = weakref.ref(batch.rows)
    batch._threads._helpers[0].wait()
    del batch
    gc.collect()
    assert rows() is None


def test_a_copy_has_helpers_of_its_own():
    batch = _batch(threads=3)
    copied = copy.deepcopy(batch)
    batch.close()
    assert len(copied._threads._helpers) == 2
    for each in (batch, copied):
        each.step(COMMANDS, samples=30)
    np.testing.assert_array_equal(batch.rows, copied.rows)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
@pytest.mark.filterwarnings("ignore:This process")  # Python 3.12 warns of threads at a fork
def test_a_forked_process_has_no_helpers_and_works(monkeypatch):
    batch, alone = _batch(), _batch(threads=1)
    alone.step(COMMANDS, samples=30)
    child = os.fork()
    if child == 0:
        batch.step(COMMANDS, samples=30)
        os._exit(0 if np.array_equal(batch.rows, alone.rows, equal_nan=True) else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
