"""The answering script: which cases, which options, what is kept, going on after an interruption."""

import gzip
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from benchmarks.answers import run_diagnoses
from benchmarks.answers.run_diagnoses import (
    Case,
    _answer,
    chosen_for_all,
    collect,
    diagnose,
    synthetic_cases,
    with_options,
    write_answers,
)
from ddagr_gym.tasks import FailedTasksError

CASES = [Case(f"case_{number:03d}", ()) for number in range(1, 125)]


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """Commands that would have been run; each writes a diagnosis of nothing."""
    commands: list[list[str]] = []

    def run(command: list[str], limit: float) -> subprocess.CompletedProcess[str]:
        commands.append(command)
        folder = Path(command[command.index("--output") + 1])
        folder.mkdir()
        (folder / "diagnosis.json").write_text(json.dumps({"verdict": ["none"], "complete": True, "seconds": 3.0}))
        return subprocess.CompletedProcess(command, 0, "", "")

    monkeypatch.setattr(run_diagnoses, "_run", run)
    return commands


def test_a_failure_is_an_answer_too(tmp_path: Path) -> None:
    done = subprocess.CompletedProcess([], 2, "", "progress\nddagr: the file is empty.\n")
    found = _answer(tmp_path / "absent.json", done)
    assert found["verdict"] == []
    assert found["failure"] == {"exit_code": 2, "message": "ddagr: the file is empty."}


def test_cases_are_folders_with_runs(tmp_path: Path) -> None:
    (tmp_path / "case_02").mkdir()
    (tmp_path / "case_02" / "run_1.csv.gz").touch()
    (tmp_path / "notes").mkdir()
    (case,) = synthetic_cases(tmp_path)
    assert case.name == "case_02"
    assert case.arguments[0].endswith("run_1.csv.gz")


def test_a_share_of_the_cases_is_run_to_the_end_by_their_names_alone() -> None:
    chosen = [case.name for case in CASES if chosen_for_all(case.name, 4, 0)]
    # 31 expected, standard deviation of the binomial 4.8
    assert 31 - 15 < len(chosen) < 31 + 15
    assert chosen != [case.name for case in CASES if chosen_for_all(case.name, 4, 1)]
    assert all(chosen_for_all(case.name, 1, 0) for case in CASES)
    optioned = with_options(CASES, ("--seed", "2"), 4, 0)
    assert [case.name for case in optioned if case.options == ("--seed", "2")] == chosen
    assert {case.options for case in optioned} == {("--seed", "2"), ("--seed", "2", "--names-only")}
    assert {case.options for case in with_options(CASES, (), None, 0)} == {()}


def test_answers_keep_what_was_said_and_how(runs: list[list[str]], tmp_path: Path) -> None:
    cases = [replace(case, options=("--names-only",)) for case in CASES[:2]]
    write_answers(cases, tmp_path / "answers.json", 1, 10.0)
    found = json.loads((tmp_path / "answers.json").read_text())
    assert list(found) == ["case_001", "case_002"]
    assert found["case_001"]["verdict"] == ["none"]
    assert found["case_001"]["options"] == ["--names-only"]
    assert found["case_001"]["seconds"] == 3.0
    assert all("--names-only" in command and "--threads" in command for command in runs)
    assert [path.name for path in tmp_path.iterdir()] == ["answers.json"]


def test_arguments_are_kept_without_places_of_this_machine() -> None:
    bank = str(run_diagnoses.CHECKOUT / "ddagr_gym/data/null_bank_warthog.json")
    kept = run_diagnoses.shown(("/home/me/run_1.csv.gz", "--soil", "firm_ground", "--thresholds", bank))
    assert kept == ["run_1.csv.gz", "--soil", "firm_ground", "--thresholds", "ddagr_gym/data/null_bank_warthog.json"]


def test_finished_cases_are_not_run_again_unless_options_differ(runs: list[list[str]], tmp_path: Path) -> None:
    for options in ((), (), ("--names-only",)):
        diagnose(replace(CASES[0], options=options), tmp_path, 1, 10.0)
    assert len(runs) == 2


def test_finished_cases_are_collected_and_kept(runs: list[list[str]], tmp_path: Path) -> None:
    parts = tmp_path / "answers.parts"
    parts.mkdir()
    diagnose(CASES[1], parts, 1, 10.0)
    assert collect(CASES[:3], tmp_path / "answers.json") == 1
    assert list(json.loads((tmp_path / "answers.json").read_text())) == ["case_002"]
    write_answers(CASES[:3], tmp_path / "answers.json", 1, 10.0)
    assert len(runs) == 3
    assert len(json.loads((tmp_path / "answers.json").read_text())) == 3


def test_an_interrupted_run_is_no_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(command: list[str], limit: float) -> subprocess.CompletedProcess[str]:
        return subprocess.CompletedProcess(command, 130, "", "ddagr: interrupted")

    monkeypatch.setattr(run_diagnoses, "_run", interrupted)
    with pytest.raises(FailedTasksError, match="case_001"):
        write_answers(CASES[:3], tmp_path / "answers.json", 1, 10.0)
    assert not (tmp_path / "answers.json").exists()
    assert list((tmp_path / "answers.parts").iterdir()) == []


def test_a_run_that_takes_too_long_is_stopped_and_is_an_answer(tmp_path: Path) -> None:
    done = run_diagnoses._run(["sleep", "20"], 0.05)
    assert done.returncode == 124
    found: dict[str, Any] = _answer(tmp_path / "absent.json", done)
    assert found["failure"] == {"exit_code": 124, "message": "stopped after 0.05 s"}


def test_a_kept_answer_is_of_the_same_recordings_and_arguments(runs: list[list[str]], tmp_path: Path) -> None:
    parts, file = tmp_path / "parts", tmp_path / "run_1.csv.gz"
    parts.mkdir()
    file.write_bytes(b"drive")
    case = Case("case_001", (str(file), "--robot", "ddagr"))
    for number, (content, robot) in enumerate([(b"drive", "ddagr"), (b"drive", "husky"), (b"other", "husky")], 1):
        file.write_bytes(content)
        asked = replace(case, arguments=(str(file), "--robot", robot))
        diagnose(asked, parts, 1, 10.0)
        diagnose(asked, parts, 1, 10.0)
        assert len(runs) == number


def test_what_changed_is_asked_of_the_robot_of_a_calibration_in_drives_that_it_is_not_of(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("concealed/warthog_1", "concealed/warthog_2", "concealed/husky_1", "open/warthog_sand"):
        path = tmp_path / f"{name}.csv.gz"
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(b"")
    drives = (SimpleNamespace(source="warthog_2.csv.gz"), SimpleNamespace(source="warthog_sand.csv.gz"))
    made = SimpleNamespace(drives=drives, robot="warthog")
    monkeypatch.setattr(run_diagnoses, "load_calibration", lambda folder: made)
    (case,) = run_diagnoses.changed_cases(tmp_path, tmp_path / "CAL")
    assert case.name == "warthog_1"
    assert run_diagnoses.shown(case.arguments) == ["warthog_1.csv.gz", "--calibration", "CAL"]


@pytest.mark.slow
def test_a_case_that_fails_is_named_while_the_others_are_kept_on_any_number_of_workers(tmp_path: Path) -> None:
    files = [tmp_path / f"run_{number}.csv.gz" for number in range(3)]
    for file in files[:2]:
        file.write_bytes(gzip.compress(b"time\n", mtime=0))
    cases = [Case(f"case_{number}", (str(file), "--robot", "ddagr")) for number, file in enumerate(files)]
    found = []
    for workers in (1, 2):
        output = tmp_path / f"answers_{workers}.json"
        files[2].unlink(missing_ok=True)
        with pytest.raises(FailedTasksError, match=r"1 of 3 tasks failed: case_2: .*run_2\.csv\.gz"):
            write_answers(cases, output, workers, 60.0)
        assert not output.exists()
        kept = {part: part.read_bytes() for part in output.with_suffix(".parts").glob("*.json")}
        assert sorted(part.stem for part in kept) == ["case_0", "case_1"]
        files[2].write_bytes(files[0].read_bytes())
        write_answers(cases, output, workers, 60.0)
        answers = json.loads(output.read_text())
        # seconds are of the clock: an answer that was run again would have others
        assert all(answers[part.stem] == json.loads(content) for part, content in kept.items())
        found.append({name: {**answer, "seconds": 0.0} for name, answer in answers.items()})
    assert found[0] == found[1]
    assert all(answer["failure"]["exit_code"] == 2 for answer in found[0].values())


def test_a_script_that_is_ended_takes_the_runs_of_its_workers_with_it(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "import os, sys\n"
        "from pathlib import Path\n"
        "from benchmarks.answers.run_diagnoses import _run\n"
        "from ddagr_gym.tasks import Task, TaskRunner\n"
        "if __name__ == '__main__':\n"
        "    command = ['sh', '-c', f'echo $$ > {sys.argv[1]}; exec sleep 60']\n"
        "    with TaskRunner(2) as runner:\n"
        "        list(runner.run([Task('case', _run, (command, 60.0))]))\n"
    )
    written = tmp_path / "number"
    driver = subprocess.Popen(
        [sys.executable, str(script), str(written)],
        env=os.environ | {"PYTHONPATH": f"{run_diagnoses.CHECKOUT}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"},
    )
    until = time.monotonic() + 60.0
    while not (written.exists() and written.read_text().strip()) and time.monotonic() < until:
        time.sleep(0.05)
    number = int(written.read_text())
    driver.send_signal(signal.SIGTERM)
    assert driver.wait(30.0) == 128 + signal.SIGTERM
    with pytest.raises(ProcessLookupError):
        os.kill(number, 0)
