"""The speed benchmark at tiny sizes: it runs, and measures what it says. No time is asserted."""

from __future__ import annotations

import json
from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks import speed
from benchmarks.speeds import (
    accuracy,
    environments,
    free_cores,
    kernel_share,
    kernel_time,
    memory,
    peers,
    tables,
    workloads,
)
from benchmarks.speeds.figure import speed_figure
from benchmarks.speeds.timing import Contestant, Rates, race, ratio
from ddagr_gym.parameters import Numerics
from ddagr_gym.physics import layout

TINY = speed.Effort(
    repeats=2, steps=4, batches=(1, 2), shared_batches=(3,), evaluations=256, states=2, samples=20, resets=3
)


@pytest.fixture(scope="module")
def actions():
    return workloads.action_tables()


@pytest.fixture(scope="module")
def results():
    parts = []
    found = speed.measure(TINY, parts.append)
    assert len(parts) == 8
    return found


def test_contestants_take_turns_from_changing_places():
    calls = []

    def contestant(name):
        return Contestant(name, lambda: calls.append(name) or 1.0)

    rates = race([contestant("a"), contestant("b"), contestant("c")], 3)
    assert calls == [*"abc", *"abc", *"bca", *"cab"]
    assert all(found.values.shape == (3,) for found in rates.values())


def test_ratios_are_paired_by_repeat_and_by_the_clock_asked_for():
    rates = {
        "one": Rates(np.array([1.0, 2.0, 4.0]), np.array([1.0, 1.0, 1.0])),
        "two": Rates(np.array([2.0, 4.0, 8.0]), np.array([3.0, 3.0, 6.0]), threads=2),
    }
    assert ratio(rates, "two", "one", clock="cpu") == {"of": "two", "to": "one", "median": 2.0, "quartiles": [2.0, 2.0]}
    assert ratio(rates, "two", "one", clock="wall")["median"] == 3.0
    # several threads count by the wall clock, one by its processor time
    assert ratio(rates, "two", "one")["median"] == 1.5


def test_turns_count_while_the_second_core_is_free(monkeypatch):
    said = iter([1.0, 0.99, 0.98, 0.6, 0.7, 1.0, 0.96, 0.97, 0.5])
    monkeypatch.setattr(free_cores.SecondCore, "measure", lambda self: next(said))
    calls = []
    one, two = (Contestant(name, lambda name=name: calls.append(name) or 1.0) for name in ("one", "two"))
    found = free_cores.turns_beside_control(one, two, turns=2, most=10)
    assert found["second_core"].tolist() == [0.99, 0.6, 0.7, 0.96]
    assert found["free"].tolist() == [True, False, False, True]
    assert found["gain"].shape == (4,)
    assert calls == ["one", "two", *["two", "one", "one", "two"] * 2]


def test_turns_without_a_free_core_are_no_more_than_asked_for(monkeypatch):
    monkeypatch.setattr(free_cores.SecondCore, "measure", lambda self: 0.5)
    one, two = Contestant("one", lambda: 1.0), Contestant("two", lambda: 1.0)
    found = free_cores.turns_beside_control(one, two, turns=2, most=5)
    assert found["free"].tolist() == [False] * 5


def test_control_of_the_second_core_is_the_time_of_one_thread_over_that_of_two(monkeypatch):
    clock = iter([0.0, 3.0, 8.0])
    control = free_cores.SecondCore(count=2, samples=5)
    driven = []
    monkeypatch.setattr(control, "_drive", driven.append)
    monkeypatch.setattr(free_cores, "time", SimpleNamespace(perf_counter=lambda: next(clock)))
    assert control.measure() == pytest.approx(3.0 / 5.0)
    assert sorted(driven) == [0, 0, 1]


def test_control_drives_two_batches_that_share_nothing():
    control = free_cores.SecondCore(count=2, samples=5)
    assert control.measure() > 0.0
    first, second = (simulator.rows for simulator in control._simulators)
    assert not np.shares_memory(first, second)
    samples = [rows[:, layout.TIME] / rows[:, layout.SAMPLE_PERIOD] for rows in (first, second)]
    np.testing.assert_allclose(samples, [[10.0, 10.0], [5.0, 5.0]])


def test_workloads_are_actions_that_differ_by_their_noise(actions):
    assert tuple(actions) == workloads.WORKLOADS
    for table in actions.values():
        assert table.shape == (workloads.EPISODES, 312, 2)
        assert table.dtype == np.float32
        assert np.abs(table).max() <= 1.0
    turn = actions["row_turn"]
    assert (turn == turn[0]).all()
    assert np.ptp(turn[0, :, 0]) > 0.1
    assert np.std(actions["trained_policy"] - turn) == pytest.approx(0.15, abs=0.01)
    assert np.mean(np.abs(actions["untrained_policy"]) == 1.0) == pytest.approx(0.317, abs=0.02)


def test_an_episode_that_ends_is_reset_and_the_next_sequence_played():
    calls = Counter()

    class Short:
        def reset(self):
            calls["reset"] += 1

        def step(self, action):
            calls[f"action {action[0]:g}"] += 1
            return None, 0.0, action[0] == 1 and calls["action 1"] == 2, False, {}

    environments.play(Short(), np.array([[[1.0, 0.0]] * 3, [[2.0, 0.0]] * 3]), 5)
    assert calls == {"reset": 3, "action 1": 2, "action 2": 3}


def test_kernel_in_c_gives_the_same_wrenches():
    found = kernel_time.against_c(1, 256)
    if "skipped" in found:
        pytest.skip(found["skipped"])
    assert set(found["nanoseconds"]) == {"ours", *kernel_time.BUILDS}
    assert found["nodes"] == 64


def test_a_missing_compiler_is_named(monkeypatch):
    monkeypatch.setattr(kernel_time, "compiler", lambda: None)
    assert "no C compiler" in kernel_time.against_c(1, 256)["skipped"]


def test_missing_peers_are_named_and_left_out(monkeypatch, actions):
    monkeypatch.setattr(peers, "missing", lambda: "peers left out: reason.")
    found = speed.steps_per_second(actions, TINY)
    assert found["skipped"] == "peers left out: reason."
    assert len(found["rates"]) == 3


def test_rigid_skid_steer_turns_left_when_the_right_bank_is_faster():
    if peers.missing():
        pytest.skip(peers.missing())
    motion = peers.turning_on_rigid_ground()
    assert motion["yaw_rate"] > 0.01
    assert motion["speed"] == pytest.approx(0.21, abs=0.03)


def test_finer_rules_have_smaller_errors():
    states = accuracy.wheel_states(10)
    median = [
        np.median(accuracy.force_errors(Numerics(section_nodes=section, contact_nodes=contact), states))
        for section, contact in ((8, 2), (8, 7), (16, 16))
    ]
    assert median[0] > 10 * median[1] > 100 * median[2]


def test_kernel_share_is_read_off_slopes(actions):
    found = kernel_share.share(actions["row_turn"][:1], 50, 2, 256)
    assert found["microseconds_per_sample"] > 0
    assert min(found.values()) >= 0


def test_memory_is_flat_over_resets():
    found = memory.over_resets(150, 100)
    if "skipped" in found:
        pytest.skip(found["skipped"])
    assert len(found["resident_mebibytes"]) == 11
    assert found["growth_mebibytes"] < 2.0


def test_results_are_complete_and_become_tables(results):
    again = json.loads(json.dumps(results, allow_nan=False))
    text = tables.tables_of(again)
    for words in (
        "row turn",
        "untrained_policy",
        "Native batch",
        "between resets",
        "share in the kernel",
        "default",
        "Memory",
    ):
        assert words in text
    assert [row["environments"] for row in results["batch"]["row_turn"]] == [1, 2]
    assert sum(row["default"] for row in results["quadrature"]) == 1
    assert set(results["time_step"]) == set(workloads.WORKLOADS)


def test_figure_is_written(results, tmp_path):
    pytest.importorskip("matplotlib")
    for path in speed_figure(results, tmp_path / "speed"):
        assert path.stat().st_size > 10_000
