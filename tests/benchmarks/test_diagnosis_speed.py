"""The time of a diagnosis: its figure, its refusals and its committed result."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks import diagnosis_speed
from benchmarks.diagnosis_speed import AIMS, RESULT, Timed, draw, main
from ddagr_gym.diagnosis.pipeline import STEPS


def test_cases_are_timed_written_and_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def timed(folder: Path, thresholds: object, threads: int) -> Timed:
        return Timed(folder.name, 179.9, 78, 3.0, dict.fromkeys(STEPS, 10.0), ("slope", "pose_latency"))

    monkeypatch.setattr(diagnosis_speed, "timed", timed)
    monkeypatch.setattr(diagnosis_speed, "against_c", lambda **options: {"skipped": "no C compiler"})
    for name in ("case_001", "case_002"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "run_1.csv.gz").touch()
    path = tmp_path / "speed.json"
    assert main([str(tmp_path / "case_001"), str(tmp_path / "case_002"), "--output", str(path)]) == 0
    result = json.loads(path.read_text())
    assert [case["whole"] for case in result["cases"]] == [10.0 * len(STEPS)] * 2
    assert path.with_suffix(".png").stat().st_size > 10_000


def test_a_folder_without_drives_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main([str(tmp_path)])
    assert "name folders of cases" in capsys.readouterr().err


def test_the_committed_result_has_every_step(tmp_path: Path) -> None:
    result = json.loads(RESULT.read_text())
    assert result["aims"] == AIMS
    assert all(set(case["steps"]) == set(STEPS) for case in result["cases"])
    assert all(case["whole"] == pytest.approx(sum(case["steps"].values())) for case in result["cases"])
    draw(result, tmp_path / "again.png")
