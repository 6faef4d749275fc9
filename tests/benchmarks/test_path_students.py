"""Students of the path tracker on the true pose: what is kept of them."""

from __future__ import annotations

import json

import pytest

pytest.importorskip("matplotlib", reason="needs the extra report")
pytest.importorskip("stable_baselines3", reason="the extra rl is not installed")

from agents.path_student import StudentSettings
from benchmarks.path_students import BASE, RESULT, STUDENTS, last_explained
from benchmarks.row_turn_plants import PLANTS


def test_what_is_explained_is_a_mean_over_the_last_rounds():
    assert last_explained({"explained": {"a": [-1.0, 0.1, 0.2, 0.3]}}) == {"a": pytest.approx(0.2)}


def test_the_record_has_every_student_on_every_plant():
    record = json.loads(RESULT.read_text())
    assert set(record["plants"]) == set(PLANTS)
    for found in record["plants"].values():
        assert list(found) == [BASE, *STUDENTS]
    assert {len(values) for values in record["explained"].values()} == {StudentSettings().rounds}
