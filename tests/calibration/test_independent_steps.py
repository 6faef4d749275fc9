"""Steps that do not depend on each other give the same bits on every engine, and are kept as they end."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest

from benchmarks.simulated_robots import drive
from ddagr_gym.calibration import files, fit_starts
from ddagr_gym.calibration.exchanged_parts import with_slow_motors
from ddagr_gym.calibration.independent_steps import IndependentSteps
from ddagr_gym.calibration.joint_fit import Standing
from ddagr_gym.calibration.ordinary_files import save_ordinary
from ddagr_gym.calibration.run import calibrate_drives
from ddagr_gym.calibration.settings import CalibrationSettings
from ddagr_gym.diagnosis.store import StepStore
from ddagr_gym.errors import InputError
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.tasks import FailedTasksError, Task, TaskRunner
from ddagr_gym.tasks.store import Kept
from tests.needs_ray import NEEDS_RAY
from tests.tasks import work

RAY = pytest.param(
    (2, "local"),
    id="ray",
    marks=[
        pytest.mark.ray,
        NEEDS_RAY,
    ],
)
FEW = CalibrationSettings(fitted=3, compared=2, judged=3, settlings=0)
"""Far too few windows to find anything, and enough for every step."""


def test_finished_steps_are_kept_and_not_run_again(tmp_path):
    lines: list[str] = []
    tasks = [Task(f"drive {n}", work.raises, (n,), f"drive {n}") for n in (0, 1, 3)]
    with TaskRunner() as runner:
        store = StepStore(tmp_path / "steps", "key")
        steps = IndependentSteps(runner, store, lines.append)
        assert steps.results("drives", tasks[:2]) == [0, 1]
        broken = [Task("drive 1", work.refuses, (1,), "drive 1"), *tasks]
        assert steps.results("drives", broken) == [1, 0, 1, 3]
    assert lines[:3] == ["drives", "drives: 1 of 2", "drives: 2 of 2"]
    assert StepStore(tmp_path / "steps", "key").find("drive 3") == Kept(3)
    assert not StepStore(tmp_path / "steps", "another key").has("drive 3")


def test_a_step_that_fails_is_named_and_the_others_are_kept(tmp_path):
    store = StepStore(tmp_path / "steps", "key")
    with TaskRunner() as runner:
        steps = IndependentSteps(runner, store)
        with pytest.raises(FailedTasksError, match=r"1 of 3 tasks failed: drive 2: raised \(ZeroDivisionError"):
            steps.results("drives", [Task(f"drive {n}", work.raises, (n,), f"drive {n}") for n in (1, 2, 3)])
        with pytest.raises(InputError, match="drive 7: drive 7 has no clock"):
            steps.results("drives", [Task("drive 7", work.refuses, (7,), "drive 7")])
    assert [store.has(f"drive {n}") for n in (1, 2, 3)] == [True, False, True]


def test_starts_share_what_they_have_in_common_and_the_best_is_weighed_again(monkeypatch):
    shared, sent = [], []
    rough = {"motor_rate": 0.5, "command_filter": 0.2}
    states = SimpleNamespace(
        fitted=SimpleNamespace(point=SimpleNamespace(states="states")),
        values=rough,
        standing=Standing(rough, None, True),
    )
    monkeypatch.setattr(fit_starts, "rough_fit", lambda *_: (states, "weights"))
    monkeypatch.setattr(fit_starts, "start_values", lambda *_: {})
    monkeypatch.setattr(fit_starts, "first_weights", lambda *_: "noise")
    monkeypatch.setattr(fit_starts, "weights_by_drive", lambda windows, left, noise: f"weights of {left}")
    monkeypatch.setattr(fit_starts, "fit_model", lambda *given, **_: made(given[3], given[4]))

    def made(weights, values):
        return SimpleNamespace(
            fitted=SimpleNamespace(prediction=f"fit {values['fits'] + 1} with {weights}"),
            standing=SimpleNamespace(values={"fits": values["fits"] + 1}, states=None),
        )

    monkeypatch.setattr(fit_starts, "size_of", len)
    tried = [("much", None), ("few", SimpleNamespace(values={"fits": 0}, states=None)), ("most of it", None)]
    steps = SimpleNamespace(
        runner=SimpleNamespace(share=lambda value: shared.append(value) or "handle"),
        results=lambda label, tasks: sent.extend(tasks) or tried,
    )
    model = SimpleNamespace(parameters=(), robot=get_robot("warthog"))
    found, weights = fit_starts.fit_from_several("data", "windows", model, {}, 1, steps)
    assert found.standing.values == {"fits": 1 + fit_starts.WEIGHINGS}
    # weighed by what the fit before left, in turn
    assert weights == "weights of fit 2 with weights of fit 1 with few"
    assert shared == [("data", "windows", model, "weights", 1, "states")]
    slow = with_slow_motors(states.standing, model.robot).values
    starts = [rough, *(rough | change for change in fit_starts.OTHER_STARTS.values()), slow]
    assert [task.arguments for task in sent] == [("handle", start) for start in starts]
    assert len({task.name for task in sent}) == len(sent)


@pytest.fixture(scope="module")
def drives():
    return [drive("field", seed, 60.0) for seed in (1, 2)]


def written(drives, folder, workers=1, cluster=""):
    """All that a calibration with its bank says, but the time that it took."""
    soil = {"field": get_soil("thesis_a1")}
    with TaskRunner(workers, cluster=cluster) as runner:
        made = calibrate_drives(
            drives, ["field"] * 2, get_robot("ddagr"), soil, FEW, with_bank=True, runner=runner, cache=folder / "steps"
        )
    save_ordinary(made.ordinary, folder / "bank.json")
    return files.as_text(replace(made.calibration, seconds=0.0)), (folder / "bank.json").read_bytes()


@pytest.fixture(scope="module")
def expected(drives, tmp_path_factory):
    return written(drives, tmp_path_factory.mktemp("here"))


@pytest.mark.slow
@pytest.mark.parametrize("engine", [pytest.param((2, ""), id="two processes"), RAY])
def test_a_calibration_has_the_same_bits_on_every_engine(drives, expected, tmp_path, engine):
    assert written(drives, tmp_path, *engine) == expected
