"""The speed benchmark runs on tiny sizes and measures what it says; no time is asserted."""

import numpy as np
import pytest

from benchmarks import speed
from benchmarks.c_kernel import kernel_candidates
from benchmarks.timing import interleaved


def test_candidates_take_turns():
    calls = []
    found = interleaved({"a": lambda: calls.append("a"), "b": lambda: calls.append("b")}, 2)
    assert calls == ["a", "b", "a", "b", "a", "b"]
    assert found["a"].low <= found["a"].median <= found["a"].high


def test_kernel_in_c_gives_the_same_forces():
    candidates, nodes, difference = kernel_candidates(8, 7)
    assert nodes == 256 * 8 * 14
    if "C" not in candidates:
        pytest.skip("no C compiler")
    assert difference < 1e-9


def test_more_nodes_are_more_accurate():
    table = speed.accuracy_cost(1, count=20)
    errors = {(a["section_nodes"], a["contact_nodes"]): a["force_error_median"] for a in table}
    assert errors[16, 16] < errors[8, 7] < errors[8, 2]


def test_memory_is_flat_over_resets():
    growth = speed.reset_memory(200)["growth_megabytes"]
    assert growth < 5.0


def test_policy_like_actions_are_in_the_box():
    actions = speed.policy_like(np.random.default_rng(0), 1000)
    assert actions.min() >= -1.0
    assert actions.max() <= 1.0
    assert actions.std() > 0.1
