"""Answers on many drives are the same on every engine, from files and from recordings."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from ddagr_gym.api.drive_tasks import Setting, answered, tasks_of
from ddagr_gym.diagnosis.store import encode
from ddagr_gym.recordings.storage import save_parquet
from tests.diagnosis.change.conftest import drive, ordinary_robot  # noqa: F401
from tests.needs_ray import NEEDS_RAY

RAY = pytest.param(
    (2, "local"),
    id="ray",
    marks=[
        pytest.mark.ray,
        NEEDS_RAY,
    ],
)


def content_of(answer):
    """All of an answer, to the last digit, but the time that it took; a refusal as it is."""
    if isinstance(answer, str):
        return answer
    arrays = {}
    tree = encode(replace(answer, diagnosis=replace(answer.diagnosis, seconds=0.0)), arrays)
    return json.dumps(tree), [(name, values.dtype.str, values.tobytes()) for name, values in arrays.values()]


@pytest.fixture(scope="module")
def given(ordinary_robot, tmp_path_factory):  # noqa: F811
    """A drive with a changed gyro as a file, one that is too short, and what one process answers on them."""
    folder = tmp_path_factory.mktemp("drives")
    for number, made in enumerate((drive(26, "gyro_bias=0.02", seconds=40.0), drive(42, seconds=8.0))):
        save_parquet(made, folder / f"run_{number + 1}.parquet")
    (folder / "run_3.csv").write_text("no drive\n")
    tasks, setting, calibrated = tasks_of(folder), Setting(folder, "field"), (ordinary_robot, {})
    return tasks, setting, calibrated, answers(tasks, setting, calibrated)


def answers(*arguments):
    return {task.name: content_of(answer) for task, answer in answered(*arguments[:3], *arguments[3:] or (1,))}


@pytest.mark.slow
@pytest.mark.parametrize("engine", [pytest.param((2, ""), id="two processes"), RAY])
def test_answers_have_the_same_bits_on_every_engine(given, engine):
    tasks, setting, calibrated, expected = given
    assert answers(tasks, setting, calibrated, *engine) == expected
    assert "gyro_bias" in expected["run_1.parquet"][0]
    assert expected["run_2.parquet"].startswith("run_2.parquet")
    assert "run_3.csv" in expected["run_3.csv"]
