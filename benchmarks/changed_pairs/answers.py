"""Answers to a set of pairs, and the seed of a sealed one."""

from __future__ import annotations

import hashlib
import json
import secrets
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.changed_pairs.drives import simulate
from benchmarks.changed_pairs.plan import Pair
from benchmarks.commits import commit_of
from benchmarks.mid_drive_drives import as_recording
from ddagr_gym.diagnosis.change.run import what_changed_since
from ddagr_gym.diagnosis.result.files import as_mapping
from ddagr_gym.errors import InputError
from ddagr_gym.files import write_json
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.tasks import ResultStore, Task, TaskRunner, run_tasks

CHECKOUT = Path(__file__).resolve().parents[2]
RESULT = CHECKOUT / "benchmarks" / "results" / "changed_pairs.json"
COMMITMENT = RESULT.with_name("changed_pairs_commitment.json")
SOIL = "thesis_a1"
KEPT = ("verdict", "complete", "findings", "sentence", "detectable", "detectable_alone", "change", "checks", "seconds")
"""Entries of an answer."""


def recordings_of(pair: Pair, seed: int) -> tuple[list[Recording], list[Recording]]:
    """Drives before and after.

    Args:
        pair: of a set.
        seed: of it.
    """
    logs, last = simulate(pair, seed)
    robot = get_robot(pair.robot)
    before = [as_recording(log, robot, f"before {k}") for k, log in enumerate(logs, start=1)]
    return before, [as_recording(last, robot, "after")]


def answer(seed: int, pair: Pair) -> dict[str, Any]:
    """What is said of a pair, as JSON has it.

    Args:
        seed: of the set.
        pair: of it.
    """
    before, after = recordings_of(pair, seed)
    outcome, _ = what_changed_since(after, before, get_robot(pair.robot), get_soil(SOIL), same_ground=True)
    body = as_mapping(outcome.diagnosis)
    return {name: body[name] for name in KEPT if name in body}


def result_of(robot: str) -> Path:
    """File of the figures of a robot's set.

    Args:
        robot: key of :data:`benchmarks.changed_pairs.robots.ROBOTS`.
    """
    return RESULT if robot == "ddagr" else RESULT.with_stem(f"{RESULT.stem}_{robot}")


def digest_of(seed: int) -> str:
    """Hash by which a seed is committed to.

    Args:
        seed: of a set.
    """
    return hashlib.sha256(f"changed pairs {seed}".encode()).hexdigest()


def draw_secret(path: Path) -> None:
    """Draw the seed of a sealed set and commit to it.

    Args:
        path: new file for the seed.

    Raises:
        InputError: the file exists or lies in the checkout.
    """
    if path.exists() or path.resolve().is_relative_to(CHECKOUT):
        raise InputError(f"{path} exists or lies in the checkout: give a new file outside of it.")
    seed = secrets.randbits(128)
    write_json(path, {"seed": seed})
    write_json(COMMITMENT, {"seed": digest_of(seed), "commit": commit_of(CHECKOUT)})


def secret_seed(path: Path) -> int:
    """Seed of a sealed set.

    Args:
        path: file of :func:`draw_secret`.

    Raises:
        InputError: it is not the one that was committed to.
    """
    seed = int(json.loads(path.read_text())["seed"])
    if digest_of(seed) != json.loads(COMMITMENT.read_text())["seed"]:
        raise InputError(f"{path} holds another seed than the one that {COMMITMENT.name} is the hash of.")
    return seed


def answers_to(pairs: Sequence[Pair], seed: int, parts: Path, workers: int, cluster: str) -> dict[str, Any]:
    """Answers by pair, those that are missing made by workers.

    Args:
        pairs: to answer.
        seed: of the set.
        parts: folder of finished answers.
        workers: processes.
        cluster: a Ray cluster, as of :class:`ddagr_gym.tasks.TaskRunner`.
    """
    mark = digest_of(seed)[:12]
    tasks = [Task(pair.name, answer, (seed, pair), key=f"{mark}-{pair.name}") for pair in pairs]
    with TaskRunner(workers, cluster=cluster) as runner:
        found = run_tasks(tasks, "pairs", runner, ResultStore(parts))
    return {pair.name: entry for pair, entry in zip(pairs, found, strict=True)}
