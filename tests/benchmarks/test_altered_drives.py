"""Altered real drives: scoring, resuming, the committed result and its picture."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from benchmarks import altered_drives
from benchmarks.altered_changes import ABSOLUTE, CONTROL, DRIVES, LATE_POSES, LATE_SENSORS, packed
from benchmarks.altered_drives import RESULT, figures, main, scored
from benchmarks.altered_figure import draw, outcome
from benchmarks.answers import run_diagnoses
from ddagr_gym.rendering import palette
from tests.benchmarks.test_altered_changes import BY_NAME, TABLES

OWN = ["sensor_hold", "command_delay", "pose_latency", "imu_lever_arm"]
"""What the data sheet lacks against an ordinary drive."""


def an_answer(verdict: list[str], **found: dict[str, tuple[float, list[float] | None]]) -> dict[str, Any]:
    """Answer with sizes and intervals of some of its names."""
    findings = [
        {"name": name, "parameters": {f: {"value": v, "interval": i, "unit": "-"} for f, (v, i) in sizes.items()}}
        for name, sizes in found.items()
    ]
    return {
        "verdict": verdict,
        "complete": False,
        "findings": findings,
        "drivetrain": {"explained": 0.97},
        "seconds": 60.0,
        "commit": "c",
        "options": ["--names-only"],
        "suspects": [],
    }


PLAIN = an_answer(OWN, command_delay={"command_delay": (0.13, [0.1, 0.16])}, pose_latency={"latency": (0.7, None)})


def test_a_name_that_the_unaltered_drive_lacks_is_named_with_its_size() -> None:
    said = an_answer([*OWN, "imu_misalignment"], imu_misalignment={"yaw": (0.29, [0.27, 0.31])})
    case = scored("d", BY_NAME["imu_turned"], said, PLAIN)
    assert case["named"]
    assert case["others"] == []
    assert case["covered"] == {"yaw": True}
    assert case["explained"] == 0.97
    assert outcome(case) == (palette.GREEN, "yaw 0.29 of 0.3")


@pytest.mark.parametrize(("late", "told"), [(1.19, True), (0.72, False)])
def test_a_size_that_the_unaltered_drive_has_too_must_have_moved(late: float, told: bool) -> None:
    said = an_answer(OWN, pose_latency={"latency": (late, None)})
    case = scored("d", BY_NAME["late_poses"], said, PLAIN)
    assert case["truth"] == {"latency": pytest.approx(LATE_POSES + 0.7)}
    assert (case["named"], case["covered"]) == (told, {})


def test_a_set_of_names_counts_where_it_is_small() -> None:
    said = an_answer([*OWN, "encoder_scale"], encoder_scale=dict.fromkeys(("right", "left"), (1.18, [1.1, 1.2])))
    (finding,) = said["findings"]
    finding["equivalence_set"] = ["encoder_scale", "command_gain"]
    case = scored("d", ABSOLUTE["both_commanded"], said, PLAIN)
    assert (case["named"], case["others"], case["covered"]) == (True, [], {"right": True, "left": True})
    finding["equivalence_set"] += ["wheel_radius_uneven", "motor_droop"]
    case = scored("d", ABSOLUTE["both_commanded"], said, PLAIN)
    assert (case["named"], case["others"], case["covered"]) == (False, ["encoder_scale"], {})


def test_a_part_of_the_drivetrain_has_the_field_of_its_effect() -> None:
    said = an_answer(OWN, command_delay={"command_delay": (0.42, [0.4, 0.44])})
    case = scored("d", BY_NAME["late_sensors"], said, PLAIN)
    assert case["truth"] == {"delay": pytest.approx(LATE_SENSORS + 0.13)}
    assert (case["named"], case["covered"]) == (True, {"delay": True})


def test_names_that_are_neither_expected_nor_parts_of_the_drivetrain_are_others() -> None:
    said = an_answer([*OWN, "power_limit", "soil_change"])
    case = scored("d", BY_NAME["gyro_reversed"], said, PLAIN)
    assert (case["named"], case["others"]) == (False, ["soil_change"])
    assert outcome(case) == (palette.ORANGE, "soil change")


def test_misses_are_told_apart() -> None:
    change = BY_NAME["gyro_reversed"]
    silent = scored("d", change, PLAIN, PLAIN)
    suspected = scored("d", change, PLAIN | {"suspects": ["gyro_sign"]}, PLAIN)
    failed = scored("d", change, an_answer([]) | {"failure": {"exit_code": 2, "message": "m"}}, PLAIN)
    colours = [outcome(case)[0] for case in (silent, suspected, failed)]
    assert colours == [palette.PALE, palette.SKY_BLUE, palette.VERMILLION]


def test_figures_leave_the_unaltered_drives_out() -> None:
    turned = an_answer([*OWN, "imu_misalignment"], imu_misalignment={"yaw": (0.2, [0.15, 0.25])})
    cases = [
        scored("a", CONTROL, PLAIN, PLAIN),
        scored("a", BY_NAME["imu_turned"], turned, PLAIN),
        scored("a", BY_NAME["gyro_reversed"], PLAIN | {"suspects": ["gyro_sign"]}, PLAIN),
    ]
    found = figures(cases)
    assert (found["named"]["value"], found["named"]["count"]) == (0.5, 2)
    assert found["named_or_suspected"]["value"] == 1.0
    assert found["suspected_by_checks"]["value"] == 0.5
    assert (found["coverage"]["value"], found["coverage"]["count"]) == (0.0, 1)
    assert found["missed"] == ["a gyro_reversed"]


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
        (output / "diagnosis.json").write_text(json.dumps(PLAIN))
        return subprocess.CompletedProcess(command, 0, "", "")

    suspicion = SimpleNamespace(suspects=("gyro_sign",))
    monkeypatch.setattr(run_diagnoses, "_run", run)
    monkeypatch.setattr(altered_drives, "check_recording", lambda *_: SimpleNamespace(suspicious=(suspicion,)))
    return commands


def test_cases_are_run_once_written_and_drawn(drives: list[list[str]], tmp_path: Path) -> None:
    words = ["--output", str(tmp_path / "altered.json"), "--parts", str(tmp_path / "parts")]
    words += ["--drives", *DRIVES[:2], "--changes", "late_poses"]
    assert main(words) == 0
    result = json.loads((tmp_path / "altered.json").read_text())
    assert [(case["drive"], case["change"]) for case in result["cases"]] == [
        (drive, change) for drive in DRIVES[:2] for change in ("nothing", "late_poses")
    ]
    assert (result["named"]["value"], result["named"]["count"]) == (0.0, 2)
    assert all(case["suspects_of_checks"] == ["gyro_sign"] for case in result["cases"])
    assert (tmp_path / "altered.png").stat().st_size > 10_000
    assert all("--names-only" in command and "--thresholds" not in command for command in drives)
    assert main(words) == 0
    assert len(drives) == 4


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
    result = json.loads(RESULT.read_text())
    cases = result["cases"]
    drives = {case["drive"] for case in cases}
    assert {(case["drive"], case["change"]) for case in cases} == {(d, name) for d in drives for name in ABSOLUTE}
    assert all(case["written"] == dict(ABSOLUTE[case["change"]].truth) for case in cases)
    assert {name: result[name] for name in figures(cases)} == figures(cases)
    draw(cases, tmp_path / "again.png")
