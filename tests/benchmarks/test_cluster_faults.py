"""Faults on a cluster of two nodes: nothing is lost, and nothing done twice but what was in flight."""

from __future__ import annotations

import errno
import json

import pytest

pytest.importorskip("matplotlib", reason="needs the extra report")

from benchmarks import cluster_faults
from benchmarks.cluster_faults import FAULTS, FullDisk, Run, alone, struck, two_nodes
from tests.needs_ray import NEEDS_RAY

NAMED = {"task raises": ["case 3: raised"], "task over its memory": ["case 3: over its memory"]}
AGAIN = {"worker killed": (1, 1), "node killed": (1, 1), "driver killed": (0, 2), "full disk at the store": (1, 2)}
"""Tasks that are begun more than once, from and to: of two nodes with one processor each, two are in flight."""


@pytest.fixture(scope="module")
def nodes():
    with two_nodes() as made:
        yield made


@pytest.mark.ray
@pytest.mark.slow
@NEEDS_RAY
@pytest.mark.parametrize("fault", FAULTS)
def test_nothing_is_lost_and_nothing_done_twice(nodes, tmp_path, fault):
    row = struck(fault, nodes, tmp_path, count=8)
    assert row["equal_to_one_process"]
    assert row["named"] == NAMED.get(fault, [])
    assert row["taken_from_store"] == row["stored_before"] >= 3
    assert row["stored_and_begun_again"] == 0
    least, most = AGAIN.get(fault, (0, 0))
    assert least <= row["begun_again"] <= most


def test_a_full_disk_keeps_what_fits(tmp_path):
    store = FullDisk(tmp_path / "store")
    for number, value in alone(4, tmp_path / "marks").items():
        store.put(number.replace(" ", "_"), value)
    with pytest.raises(OSError, match="space left") as caught:
        store.put("case_4", [0.1] * 40)
    assert caught.value.errno == errno.ENOSPC
    assert len(list(store.folder.iterdir())) == 4


def test_begun_again_counts_attempts(tmp_path):
    run = Run(tmp_path, 2, 0.0)
    for _ in range(2):
        cluster_faults.node_work.case(str(tmp_path), 1, 0.0)
    assert run.begun() == {1: 2}
    assert run.running() == 0


def test_the_record_holds_what_the_results_say():
    rows = json.loads(cluster_faults.RESULT.read_text())["faults"]
    assert [row["fault"] for row in rows] == list(FAULTS)
    assert all(row["equal_to_one_process"] and row["stored_and_begun_again"] == 0 for row in rows)
