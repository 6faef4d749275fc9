"""Comparison of two files of answers."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from benchmarks.answers.compare import differences, main

ANSWER = {"verdict": ["slope"], "complete": True, "findings": [{"gain": 12.5, "gate": None}], "seconds": 3.0}


def changed(**entries: object) -> dict[str, object]:
    return {**ANSWER, **entries}


def test_rounding_and_what_a_run_took_are_no_difference() -> None:
    after = changed(findings=[{"gain": 12.5 * (1.0 + 5e-7), "gate": None}], seconds=4.0)
    assert list(differences(ANSWER, after, 1e-6)) == []


@pytest.mark.parametrize(
    ("entries", "place"),
    [
        ({"verdict": ["none"]}, "/verdict[0]"),
        ({"verdict": ["slope", "payload"]}, "/verdict"),
        ({"complete": False}, "/complete"),
        ({"findings": [{"gain": 12.5001, "gate": None}]}, "/findings[0]/gain"),
        ({"findings": [{"gain": 12.5, "gate": 0.0}]}, "/findings[0]/gate"),
        ({"sentence": "The ground slopes."}, "/sentence"),
    ],
)
def test_every_other_change_is_named_with_its_place(entries: dict[str, object], place: str) -> None:
    (found,) = differences(ANSWER, changed(**entries), 1e-6)
    assert found.startswith(f"{place}: ")


def test_a_case_that_differs_or_is_missing_gives_exit_code_1(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    before, after = tmp_path / "before.json", tmp_path / "after.json"
    before.write_text(json.dumps({"case_1": ANSWER, "case_2": ANSWER}))
    after.write_text(json.dumps({"case_1": changed(seconds=9.0)}))
    monkeypatch.setattr(sys, "argv", ["compare", str(before), str(after)])
    assert main() == 1
    said = capsys.readouterr().out
    assert "case_1: the same" in said
    assert "1 of 2 cases differ" in said
