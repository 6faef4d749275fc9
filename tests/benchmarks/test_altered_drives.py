"""Altered real drives: scoring, resuming, the committed result and its picture."""

from __future__ import annotations

import hashlib
import json
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from benchmarks import altered_drives
from benchmarks.altered_changes import CHANGES, CONTROL, DRIVES, LATE_POSES, TURNED, Change, packed
from benchmarks.altered_drives import RESULT, covered, detectable, figures, main, scored, with_own
from benchmarks.altered_figure import draw, outcome
from benchmarks.answers import run_diagnoses
from ddagr_gym.rendering import palette
from tests.benchmarks.test_altered_changes import BY_NAME, TABLES

LIMITS = {"pose_latency": {"latency": 0.6}, "encoder_scale": {"right": 0.5, "left": None}}


def an_answer(verdict: list[str], found: dict[str, tuple[float, list[float]]] | None = None) -> dict[str, Any]:
    """Answer that names effects with one size and its interval each."""
    findings = [
        {
            "name": name,
            "parameters": {"latency": {"value": value, "interval": interval, "unit": "s"}},
            "equivalence_set": {name: 0.6, "sensor_hold": 0.4},
        }
        for name, (value, interval) in (found or {}).items()
    ]
    return {
        "verdict": verdict,
        "complete": verdict != ["unknown"],
        "findings": findings,
        "detectable": LIMITS,
        "seconds": 60.0,
        "commit": "c",
        "options": ["--names-only"],
        "suspects": [],
    }


NONE = an_answer(["none"])


def test_a_right_name_with_its_size() -> None:
    case = scored("d", BY_NAME["late_poses"], an_answer(["pose_latency"], {"pose_latency": (0.55, [0.4, 0.6])}), NONE)
    assert case["right"]
    assert case["named"]
    assert case["in_set"]
    assert case["covered"] == {"latency": True}
    assert case["found"]["pose_latency"]["latency"]["value"] == 0.55
    assert outcome(case) == (palette.GREEN, "pose latency\n0.55")


def test_a_name_among_others_is_not_right_and_one_in_the_set_not_named() -> None:
    both = {"pose_latency": (0.5, [0.4, 0.6]), "slope": (0.1, [0.0, 0.2])}
    among = scored("d", BY_NAME["late_poses"], an_answer(list(both), both), NONE)
    assert (among["right"], among["named"], among["in_set"]) == (False, True, True)
    change = Change("held", "held", "sensor_hold", {"duration": 0.5})
    inside = scored("d", change, an_answer(["pose_latency"], {"pose_latency": (0.5, [0.4, 0.6])}), NONE)
    assert (inside["named"], inside["in_set"], inside["covered"]) == (False, True, {})
    assert outcome(inside)[0] == outcome(among)[0] == palette.SKY_BLUE


def test_misses_are_told_apart() -> None:
    change = BY_NAME["gyro_reversed"]
    wrong = scored("d", change, an_answer(["pose_latency"], {"pose_latency": (0.5, [0.4, 0.6])}), NONE)
    failed = scored("d", change, an_answer([]) | {"failure": {"exit_code": 2, "message": "m"}}, NONE)
    cases = [wrong, failed, *(scored("d", change, an_answer([name]), NONE) for name in ("unknown", "none"))]
    assert not any(case["right"] or case["in_set"] for case in cases)
    colours = [outcome(case)[0] for case in cases]
    assert colours == [palette.ORANGE, palette.VERMILLION, palette.PALE_ORANGE, palette.PALE]


def test_the_drives_own_size_counts_where_the_control_names_it() -> None:
    control = an_answer(["pose_latency"], {"pose_latency": (0.12, [0.1, 0.2])})
    assert with_own(BY_NAME["late_poses"], control) == {"latency": pytest.approx(LATE_POSES + 0.12)}
    assert with_own(BY_NAME["late_poses"], NONE) == {"latency": LATE_POSES}
    assert with_own(BY_NAME["imu_turned"], control) == {"yaw": TURNED}
    answer = an_answer(["pose_latency"], {"pose_latency": (0.5, [0.4, 0.55])})
    assert covered("pose_latency", with_own(BY_NAME["late_poses"], control), answer) == {"latency": False}


def test_what_can_be_shown_is_what_the_control_states() -> None:
    assert detectable(CONTROL, NONE) is None
    assert detectable(BY_NAME["gyro_reversed"], NONE) is True
    assert detectable(BY_NAME["late_poses"], NONE) is False
    # distance from one, not from zero
    assert detectable(BY_NAME["encoders_scaled"], NONE) is False
    assert detectable(BY_NAME["encoders_doubled"], NONE) is True


def test_figures_count_controls_and_changes_apart() -> None:
    named = an_answer(["pose_latency"], {"pose_latency": (0.5, [0.4, 0.45])})
    cases = [
        scored("a", CONTROL, NONE, NONE),
        scored("b", CONTROL, named, NONE),
        scored("a", BY_NAME["late_poses"], named, NONE),
        scored("a", BY_NAME["gyro_reversed"], NONE | {"suspects": ["gyro_sign"]}, NONE),
    ]
    found = figures(cases)
    assert (found["controls_not_none"]["value"], found["controls_not_none"]["count"]) == (0.5, 2)
    assert (found["right_all"]["value"], found["right_all"]["count"]) == (0.5, 2)
    assert (found["right_detectable"]["value"], found["right_detectable"]["count"]) == (0.0, 1)
    assert found["suspected_by_checks_all"]["value"] == 0.5
    assert found["coverage"] == figures(cases[2:3])["coverage"]
    assert found["coverage"]["value"] == 0.0
    assert [case["change"] for case in found["failures"]] == ["nothing", "gyro_reversed"]


@pytest.fixture
def drives(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """Folder of drives, and the commands that would have been run; each finds nothing."""
    folder = tmp_path / "recordings" / "open"
    folder.mkdir(parents=True)
    for name in DRIVES:
        (folder / f"{name}.csv.gz").write_bytes(packed(TABLES["continuous" if "grass" in name else "in steps"]))
    monkeypatch.setenv("DDAGR_RECORDINGS", str(tmp_path / "recordings"))
    commands: list[list[str]] = []

    def run(command: list[str], limit: float) -> subprocess.CompletedProcess[str]:
        commands.append(command)
        output = Path(command[command.index("--output") + 1])
        output.mkdir()
        (output / "diagnosis.json").write_text(json.dumps(NONE))
        return subprocess.CompletedProcess(command, 0, "", "")

    suspicion = SimpleNamespace(suspects=("gyro_sign",))
    monkeypatch.setattr(run_diagnoses, "_run", run)
    monkeypatch.setattr(altered_drives, "check_recording", lambda *_: SimpleNamespace(suspicious=(suspicion,)))
    return commands


def test_cases_are_run_once_written_and_drawn(drives: list[list[str]], tmp_path: Path) -> None:
    words = ["--output", str(tmp_path / "altered.json"), "--parts", str(tmp_path / "parts"), "--limit", "4"]
    assert main(words) == 0
    result = json.loads((tmp_path / "altered.json").read_text())
    assert [(case["drive"], case["change"]) for case in result["cases"]] == [
        *((drive, "nothing") for drive in DRIVES),
        (DRIVES[0], "late_poses"),
    ]
    assert result["controls_not_none"]["value"] == 0.0
    assert result["right_all"]["count"] == len(result["failures"]) == 1
    assert all(case["suspects_of_checks"] == ["gyro_sign"] for case in result["cases"])
    assert (tmp_path / "altered.png").stat().st_size > 10_000
    assert all("--names-only" in command and "--stride" in command for command in drives)
    assert main(words) == 0
    assert len(drives) == 4


def test_finished_cases_are_run_again_with_another_bank(
    drives: list[list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ["--output", str(tmp_path / "altered.json"), "--limit", "1"]
    results = []
    for content in ("{}", "{ }", "{ }"):
        (tmp_path / "bank.json").write_text(content)
        monkeypatch.setattr(altered_drives, "REAL_BANK", tmp_path / "bank.json")
        assert main(words) == 0
        results.append(json.loads((tmp_path / "altered.json").read_text())["bank_sha256"])
    assert len(drives) == len(set(results)) == 2


def test_an_interrupted_run_writes_no_result(
    drives: list[list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(run_diagnoses, "_run", lambda command, limit: subprocess.CompletedProcess(command, 130, "", ""))
    assert main(["--output", str(tmp_path / "altered.json")]) == 130
    assert not (tmp_path / "altered.json").exists()
    assert "goes on from" in capsys.readouterr().err


def test_without_the_drives_nothing_is_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DDAGR_RECORDINGS", str(tmp_path))
    assert main(["--output", str(tmp_path / "altered.json")]) == 2
    assert list(tmp_path.iterdir()) == []


def test_the_committed_result_is_of_these_changes(tmp_path: Path) -> None:
    if not RESULT.is_file():
        pytest.skip("no result is committed: run python -m benchmarks.altered_drives")
    result = json.loads(RESULT.read_text())
    cases = result["cases"]
    assert {(case["drive"], case["change"]) for case in cases} == {(d, c.name) for d in DRIVES for c in CHANGES}
    assert all(case["written"] == dict(BY_NAME[case["change"]].truth) for case in cases)
    assert {name: result[name] for name in figures(cases)} == figures(cases)
    draw(cases, tmp_path / "again.png")


def test_the_committed_result_is_of_the_bank_that_ships():
    bank = hashlib.sha256(altered_drives.REAL_BANK.read_bytes()).hexdigest()
    assert json.loads(RESULT.read_text())["bank_sha256"] == bank
