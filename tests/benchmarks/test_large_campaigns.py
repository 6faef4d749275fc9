"""The arithmetic of large campaigns: the simulated cluster keeps time, and the record is what the formulas give."""

from __future__ import annotations

import json

import pytest

pytest.importorskip("matplotlib", reason="needs the extra report")
pytest.importorskip("pyarrow", reason="needs the extra io")

from benchmarks import large_campaigns
from benchmarks.large_campaigns import (
    FOLDER,
    PER_TASK,
    RECORDINGS,
    SimulatedCluster,
    room_of_diagnoses,
    sending_time,
    simulate,
    size_of,
)


@pytest.fixture(scope="module")
def record():
    return json.loads(large_campaigns.RESULT.read_text())


def test_without_losses_busy_processors_take_the_ideal_time(monkeypatch):
    monkeypatch.setattr(large_campaigns, "LOST", 0.0)
    found = simulate(400, 20, 0.0, 10.0)
    assert (found["done"], found["failed"], found["lost_attempts"]) == (400, 0, 0)
    assert found["time_over_ideal"] == pytest.approx(1.0)


def test_a_driver_that_sends_slowly_sets_the_time(monkeypatch):
    monkeypatch.setattr(large_campaigns, "LOST", 0.0)
    found = simulate(1000, 100, 0.5, 10.0)
    assert 3600.0 * found["simulated_hours"] == pytest.approx(1000 * 0.5 + 10.0)


def test_lost_attempts_are_begun_again_by_the_runner():
    found = simulate(5000, 50, 0.001, 1.0)
    assert found["done"] + found["failed"] == 5000
    assert 20 < found["lost_attempts"] < 90
    assert found["failed"] <= 1


def test_what_is_always_lost_is_named(monkeypatch):
    monkeypatch.setattr(large_campaigns, "LOST", 1.0)
    found = simulate(10, 2, 0.0, 1.0)
    assert (found["failed"], found["lost_attempts"]) == (10, 30)


def test_a_processor_runs_one_task_at_a_time():
    engine = SimulatedCluster(1, 0.0, 2.0)
    engine._rng = type("Never", (), {"random": staticmethod(lambda: 1.0)})()
    for number in range(3):
        engine.begin(number, None)
    ends = []
    while engine._ends:
        ends += [(engine.clock, number) for number, _ in engine.ended(0.5)]
    assert [number for _, number in ends] == [0, 1, 2]
    assert engine.clock == 6.0


def test_a_folder_is_as_large_as_its_files(tmp_path):
    (tmp_path / "figures").mkdir()
    for name, size in (("index.html", 1000), ("figures/gains.png", 234)):
        (tmp_path / name).write_bytes(bytes(size))
    assert size_of(tmp_path) == 1234


def test_the_record_adds_up(record):
    cluster, found = record["cluster"], record["diagnoses"]
    processors = cluster["nodes"] * cluster["processors"]
    assert found["core_hours"] == pytest.approx(RECORDINGS * found["core_seconds_each"]["mean"] / 3600.0)
    assert found["cost"] == pytest.approx(found["core_hours"] * cluster["price_per_core_hour"])
    assert found["hours"] * processors == pytest.approx(found["core_hours"])
    room = room_of_diagnoses(found["bytes_per_folder"], cluster["processors"])
    assert {name: found[name] for name in room} == pytest.approx(room)
    assert room["store_GiB"] * 2**30 == pytest.approx(RECORDINGS * FOLDER)
    largest = max(
        drive["gibibytes"] for drive in json.loads((large_campaigns.RESULTS / "long_drives.json").read_text())["drives"]
    )
    assert room["memory_GiB_per_node"] == pytest.approx(cluster["processors"] * largest)
    evaluation = record["evaluation"]
    assert evaluation["tasks"] * PER_TASK == pytest.approx(evaluation["episodes"])
    assert record["measured"]["sending_seconds"] == pytest.approx(sending_time())
    assert [row["done"] + row["failed"] for row in record["simulated"]] == [1_000_000] * len(record["simulated"])
