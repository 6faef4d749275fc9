"""Scores of answers against labels, and what the answering script keeps."""

import subprocess
from typing import Any

import pytest

from benchmarks.answers.run_diagnoses import Case, _answer, synthetic_cases
from benchmarks.score_concealed import score, share


def label(kind: str, *names: str, **parameters: float) -> dict[str, Any]:
    effects = [
        {"name": n, "variant": "form", "tag": "same", "parameters": parameters}
        for n in names
        if n not in ("none", "unknown")
    ]
    return {"kind": kind, "verdict": list(names), "effects": effects, "structure": ""}


def answer(
    *verdict: str, complete: bool = True, interval: tuple[float, float] | None = None, **also: float
) -> dict[str, Any]:
    findings = [
        {"name": n, "equivalence_set": {n: 1.0, **also}, "parameters": {"delay": {"value": 0.1, "interval": interval}}}
        for n in verdict
        if n not in ("none", "unknown")
    ]
    return {"verdict": list(verdict), "complete": complete, "findings": findings, "seconds": 1.0}


def test_each_figure_counts_what_its_name_says() -> None:
    labels = {
        "a": label("null", "none"),
        "b": label("structural null", "none"),
        "c": label("single", "command_delay", delay=0.1),
        "d": label("single", "command_delay", delay=0.3),
        "e": label("double", "slope", "gyro_bias", delay=0.1),
        "f": label("outside", "unknown"),
        "g": label("outside", "unknown"),
    }
    answers = {
        "a": answer("none"),
        "b": answer("slope"),
        "c": answer("command_delay", interval=(0.05, 0.15)),
        "d": answer("motor_lag", interval=(0.05, 0.15), command_delay=0.4),
        "e": answer("gyro_bias", "slope"),
        "f": answer("unknown", complete=False),
        "g": answer("slope"),
    }
    found = score(labels, answers)
    assert found["false_alarm_rate"]["value"] == 0.5
    assert found["false_alarm_rate_structural"]["value"] == 1.0
    assert found["top1"] == found["top1_all_singles"]
    assert found["top1"]["value"] == 0.5
    assert found["in_set"]["value"] == 1.0
    assert found["top1_doubles"]["value"] == 1.0
    assert found["unknown_outside"]["value"] == 0.5
    assert found["confident_wrong"]["value"] == 0.5
    assert found["coverage"] == {**share([True]), "count": 1}
    assert [entry["case"] for entry in found["failures"]] == ["b", "d", "g"]


def test_effects_below_the_stated_limit_do_not_count_as_missed() -> None:
    labels = {"a": label("single", "command_delay", delay=0.1)}
    missed = {**answer("none"), "detectable": {"command_delay": {"delay": 0.2}}}
    assert score(labels, {"a": missed})["top1"]["count"] == 0
    assert score(labels, {"a": missed})["top1_all_singles"]["value"] == 0.0


def test_a_failure_is_an_answer_too(tmp_path: Any) -> None:
    done = subprocess.CompletedProcess([], 2, "", "progress\nddagr: the file is empty.\n")
    found = _answer(tmp_path / "absent.json", done)
    assert found["verdict"] == []
    assert found["failure"] == {"exit_code": 2, "message": "ddagr: the file is empty."}


def test_cases_are_folders_with_runs(tmp_path: Any) -> None:
    (tmp_path / "case_02").mkdir()
    (tmp_path / "case_02" / "run_1.csv.gz").touch()
    (tmp_path / "notes").mkdir()
    (case,) = synthetic_cases(tmp_path)
    assert isinstance(case, Case)
    assert case.name == "case_02"
    assert case.arguments[0].endswith("run_1.csv.gz")


def test_share_of_nothing_is_not_a_number() -> None:
    assert share([])["value"] is None
    assert share([True, False])["value"] == pytest.approx(0.5)
