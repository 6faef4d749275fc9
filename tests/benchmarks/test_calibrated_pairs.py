"""What is asked of a robot that was calibrated with three drives, and how answers are kept."""

from __future__ import annotations

import json

import pytest

from benchmarks import calibrated_pairs
from benchmarks.calibrated_pairs import SEED, answers, questions
from benchmarks.changed_pairs.drives import label_of


def test_every_world_is_asked_about_as_it_is_and_with_other_changes():
    asked = questions(3, 2)
    assert [len(world) for world in asked] == [3, 3, 3]
    names = [question.name for world in asked for question in world]
    assert len(set(names)) == 9
    for world in asked:
        assert {question.pair.name for question in world} == {world[0].name}
        assert label_of(world[0].pair, SEED)["verdict"] == ["none"]
        changed = [label_of(question.pair, SEED) for question in world[1:]]
        assert all(label["kind"] == "single" and len(label["effects"]) == 1 for label in changed)
        assert all(question.pair.case.structure == world[0].pair.case.structure for question in world)


def test_answers_that_are_there_are_not_made_again(tmp_path, monkeypatch):
    made = []

    def once(folder, question):
        made.append(question.name)
        return {"verdict": ["none"]}

    monkeypatch.setattr(calibrated_pairs, "answer", once)
    (world,) = questions(1, 1)
    first = answers(tmp_path, world)
    assert answers(tmp_path, world) == first
    assert made == [question.name for question in world]


def test_results_and_picture_are_written(tmp_path, monkeypatch):
    monkeypatch.setattr(calibrated_pairs, "RESULT", tmp_path / "found.json")
    asked = questions(1, 1)
    said = {
        question.name: {
            "verdict": [name], "complete": True, "seconds": 1.0, "detectable": {}, "checks": [],
            "findings": [] if name == "none" else [{"name": name, "equivalence_set": {name: 1.0}, "parameters": {}}],
        }
        for question, name in zip(asked[0], ("none", "encoder_scale"), strict=True)
    }  # fmt: skip
    calibrated_pairs._write(asked, said)
    found = json.loads((tmp_path / "found.json").read_text())
    assert found["false_alarms"]["value"] == 0.0
    assert found["told_of_singles"]["value"] == 1.0
    assert found["about"]["drives"] == {"null": 1, "single": 1}
    assert (tmp_path / "found.png").stat().st_size > 10_000


@pytest.mark.slow
def test_a_robot_is_calibrated_once_and_asked(tmp_path):
    (world,) = questions(1, 0)
    found = answers(tmp_path, world)
    assert found[world[0].name]["verdict"] == ["none"]
    assert (tmp_path / world[0].name / "calibration.json").exists()
