"""Sweeps of tiny trainings: reading, bad input, the same bits on processes and on Ray Tune, stopped and resumed."""

from __future__ import annotations

import csv
import json
import os
import pickle
import shutil
import signal
import subprocess
import sys
import time
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="the extra rl is not installed")
pytest.importorskip("matplotlib", reason="needs the extra report")

from agents.run import POLICY, RESULT
from agents.sweep import COLUMNS, FIGURE, OBJECTIVE, STOPPED, TABLE, load_sweep, run_sweep
from ddagr_gym.cli import main
from ddagr_gym.errors import InputError
from ddagr_gym.progress import Progress
from tests.needs_ray import NEEDS_RAY

WORDS = ("steps=64", "environments=4", "ppo.rollout=8", "ppo.batch=16")
"""Changes that make a training tiny."""


def on_ray(test):
    """A test that starts a cluster."""
    return pytest.mark.ray(pytest.mark.slow(NEEDS_RAY(test)))


def sweep_file(
    folder: Path, *lines: str, second: str = "ppo.learning_rate=1e-2", seeds: int = 2, interval: int = 64
) -> Path:
    """A sweep of two configurations, of which the second has one more change."""
    both = (*WORDS, f"validation_interval={interval}")
    plain, other = (", ".join(words) for words in (both, (*both, second)))
    text = ["description: test", f"seeds: {seeds}", *lines, "configurations:"]
    text += [f"  plain: {{config: ppo_raw, set: [{plain}]}}", f"  other: {{config: ppo_raw, set: [{other}]}}"]
    path = folder / "sweep.yaml"
    path.write_text("\n".join(text) + "\n")
    return path


def table(folder: Path) -> list[dict[str, str]]:
    """Rows of the table without the time that they took."""
    with (folder / TABLE).open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [tuple(row) for row in rows] == [COLUMNS] * len(rows)
    return [{name: value for name, value in row.items() if name != "cpu_seconds"} for row in rows]


def policies(folder: Path) -> dict[str, bytes]:
    """Numbers of all policies, bit by bit."""
    found = {}
    for path in sorted(folder.glob(f"*/*/{POLICY}")):
        with np.load(path) as archive:
            found |= {f"{path.parent.name} {path.parents[1].name} {n}": archive[n].tobytes() for n in archive.files}
    return found


@pytest.fixture(scope="module")
def trained(tmp_path_factory) -> Path:
    """A sweep that one process trained."""
    folder = tmp_path_factory.mktemp("sweep")
    run_sweep(sweep_file(folder), folder / "out", workers=1)
    return folder / "out"


def test_a_sweep_is_read_as_configurations_by_seeds(tmp_path):
    sweep, trials = load_sweep(sweep_file(tmp_path))
    assert (sweep.seeds, sweep.median_stopping, sweep.grace) == (2, False, 0)
    assert [str(trial) for trial in trials] == ["plain seed 0", "plain seed 1", "other seed 0", "other seed 1"]
    assert [trial.settings.ppo.learning_rate for trial in trials] == [5e-4] * 2 + [1e-2] * 2
    assert {trial.settings.steps for trial in trials} == {64}


@pytest.mark.parametrize(
    ("lines", "part"),
    [
        (["seeds: 0", "configurations: {a: {config: ppo_raw}}"], "seeds is 0: give at least 1"),
        (["grace: -1", "configurations: {a: {config: ppo_raw}}"], "grace is -1: give at least 0"),
        (["configurations: {}"], "configurations is empty"),
        (["configurations: {../a: {config: ppo_raw}}"], "the configuration '../a' names a folder"),
        (["configurations: {a: {config: ppo_rew}}"], "configuration 'a': unknown"),
        (["configurations: {a: {config: ppo_raw, set: [steps=0]}}"], "steps is 0"),
        (["configurations: {a: {confg: ppo_raw}}"], "did you mean 'config'"),
        (["seeds: [0, 1]", "configurations: {a: {config: ppo_raw}}"], "give a whole number"),
    ],
)
def test_what_is_wrong_with_a_file_is_one_sentence(tmp_path, capsys, lines, part):
    path = tmp_path / "sweep.yaml"
    path.write_text("\n".join(["description: test", *lines]))
    assert main(["train", "--sweep", str(path), "--output", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert part in said
    assert said.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "part"),
    [
        ([], "nothing is named to train: give ppo, sac, all or --sweep FILE"),
        (["ppo", "--cluster", "local"], "--cluster is for a sweep"),
        (["ppo", "--sweep", "sweep.yaml"], "what is given with --sweep"),
        (["--sweep", "sweep.yaml", "--seed", "3"], "seed is given with --sweep"),
        (["--sweep", "sweep.yaml", "--workers", "0"], "--workers is 0"),
        (["--sweep", "none.yaml"], "none.yaml cannot be read"),
        (["--sweep", "sweep.yaml"], "give --cluster local, or set it to false"),
        (["--sweep", "sweep.yaml", "--cluster", "local"], ".[cluster]"),
    ],
)
def test_wrong_words_get_one_sentence(tmp_path, monkeypatch, capsys, words, part):
    sweep_file(tmp_path, "median_stopping: true")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("ddagr_gym.extras.find_spec", lambda name: None if name == "ray" else find_spec(name))
    assert main(["train", *words, "--output", "out"]) == 2
    said = capsys.readouterr().err
    assert part in said
    assert said.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_two_processes_train_the_same_bits(trained, tmp_path, capsys):
    assert main(["train", "--sweep", str(sweep_file(tmp_path)), "--output", str(tmp_path / "out")]) == 0
    assert table(tmp_path / "out") == table(trained)
    assert policies(tmp_path / "out") == policies(trained)
    assert len({row["mean_return"] for row in table(trained)}) == 4
    assert "plain" in capsys.readouterr().out
    assert (tmp_path / "out" / FIGURE).read_bytes().startswith(b"\x89PNG")


def test_a_repeated_command_trains_only_what_is_missing(trained, tmp_path):
    out = shutil.copytree(trained, tmp_path / "out")
    before = {path: path.stat().st_mtime_ns for path in out.glob(f"*/*/{RESULT}")}
    assert [row["ended"] for row in run_sweep(sweep_file(tmp_path, seeds=3), out, workers=1)] == ["finished"] * 6
    assert {path: path.stat().st_mtime_ns for path in before} == before
    assert len(list(out.glob(f"*/*/{RESULT}"))) == 6
    # nothing is left to do, so that no cluster is asked
    assert len(run_sweep(sweep_file(tmp_path), out, workers=1, cluster="nowhere")) == 4


def test_a_training_that_fails_is_named_and_the_table_has_the_others(trained, tmp_path, capsys):
    """A checkpoint of other settings is in the way of one of them."""
    out = tmp_path / "out"
    file = sweep_file(tmp_path)
    (out / "other" / "seed_1").mkdir(parents=True)
    (out / "other" / "seed_1" / "checkpoint.pkl").write_bytes(b"nothing")
    with pytest.raises(InputError, match=r"other seed 1: .*is not a checkpoint"):
        run_sweep(file, out, workers=1)
    rows = table(out)
    assert [row["ended"] for row in rows] == ["finished", "finished", "finished", ""]
    assert rows[:3] == table(trained)[:3]
    assert rows[3]["mean_return"] == ""


@NEEDS_RAY
def test_what_counts_trainings_works_as_a_copy_on_another_machine(tmp_path, monkeypatch, capsys):
    from agents.sweep_tune import _Ends

    _, trials = load_sweep(sweep_file(tmp_path))
    monkeypatch.chdir(tmp_path)
    with Progress(len(trials), "trainings") as progress:
        ends = _Ends(trials, Path("out"), progress)
        ends.on_trial_error(0, [], SimpleNamespace(config={"number": 1}))
        copy = pickle.loads(pickle.dumps(ends))
    assert "trainings: 25 %" in capsys.readouterr().err
    monkeypatch.chdir("/")
    trial = SimpleNamespace(config={"number": 0})
    copy.on_trial_result(1, [], trial, dict.fromkeys(("steps", "cpu_seconds", "success_rate", OBJECTIVE), 1.0))
    copy.on_trial_complete(1, [], trial)
    copy.on_trial_error(1, [], SimpleNamespace(config={"number": 1}))
    (kept,) = (tmp_path / "out").rglob(STOPPED)
    assert len(json.loads(kept.read_text())["course"]) == 1
    assert capsys.readouterr().err == ""


def command(file: Path, out: Path) -> list[str]:
    return [
        sys.executable,
        "-m",
        "ddagr_gym",
        "train",
        "--sweep",
        str(file),
        "--output",
        str(out),
        "--cluster",
        "local",
    ]


@on_ray
def test_a_killed_sweep_on_ray_goes_on_to_the_same_bits(trained, tmp_path):
    file, out = sweep_file(tmp_path), tmp_path / "out"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([os.getcwd(), *sys.path])}
    killed = subprocess.Popen(command(file, out), env=environment, stderr=subprocess.DEVNULL, start_new_session=True)
    try:
        end = time.monotonic() + 300.0
        while not list(out.glob(f"*/*/{RESULT}")) and time.monotonic() < end:
            time.sleep(0.05)
        os.kill(killed.pid, signal.SIGKILL)
        killed.wait(30.0)
    finally:
        killed.kill()
    kept = {path: path.stat().st_mtime_ns for path in out.glob(f"*/*/{RESULT}")}
    assert kept
    again = subprocess.run(command(file, out), env=environment, capture_output=True, text=True, check=False)
    assert again.returncode == 0, again.stderr
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    assert table(out) == table(trained)
    assert policies(out) == policies(trained)


@on_ray
def test_what_falls_behind_is_stopped_and_stays_so(tmp_path):
    """Without the feed-forward a policy that has not learnt yet cannot turn at all."""
    out = tmp_path / "out"
    stopping = {"second": "design.action=absolute", "interval": 32}
    file = sweep_file(tmp_path, "median_stopping: true", seeds=3, **stopping)
    rows = run_sweep(file, out, workers=2, cluster="local")
    ended = {(row["configuration"], row["seed"]): row["ended"] for row in rows}
    assert set(ended.values()) == {"finished", "stopped"}
    assert ended["other", 2] == "stopped"
    assert not (out / "other" / "seed_2" / RESULT).exists()
    assert (out / "other" / "seed_2" / STOPPED).is_file()
    before = (out / TABLE).read_bytes()
    assert run_sweep(file, out, workers=2, cluster="local") == rows
    assert (out / TABLE).read_bytes() == before
    # one more seed: those that have ended report what they had, and are not trained again
    kept = {path: path.stat().st_mtime_ns for path in out.glob(f"*/*/{RESULT}")}
    more = run_sweep(sweep_file(tmp_path, "median_stopping: true", seeds=4, **stopping), out, 2, "local")
    assert [row for row in more if row["seed"] < 3] == rows
    assert next(row["ended"] for row in more if row["configuration"] == "other" and row["seed"] == 3) == "stopped"
    assert {path: path.stat().st_mtime_ns for path in kept} == kept


@on_ray
def test_a_training_that_fails_on_ray_is_named(tmp_path):
    out = tmp_path / "out"
    (out / "other" / "seed_0").mkdir(parents=True)
    (out / "other" / "seed_0" / "checkpoint.pkl").write_bytes(b"nothing")
    with pytest.raises(InputError, match=r"other seed 0: .*is not a checkpoint"):
        run_sweep(sweep_file(tmp_path, seeds=1), out, workers=2, cluster="local")
    assert [row["ended"] for row in table(out)] == ["finished", ""]
