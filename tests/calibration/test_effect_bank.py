"""What ordinary drives do to every effect, beside the robot that was calibrated without each of them."""

from __future__ import annotations

import pytest

from ddagr_gym.calibration.calibration_data import prepare_drives
from ddagr_gym.calibration.effect_bank import NAME, load_runs, ordinary_runs, save_runs, setting_of
from ddagr_gym.calibration.fit_starts import start_values
from ddagr_gym.calibration.independent_steps import IndependentSteps
from ddagr_gym.calibration.joint_fit import complete_model, weigh_and_fit
from ddagr_gym.calibration.left_out import forecasts
from ddagr_gym.calibration.parts import PARTS
from ddagr_gym.calibration.settings import CalibrationSettings
from ddagr_gym.diagnosis.gates.thresholds import NullRun
from ddagr_gym.diagnosis.null_bank.bank import NullBank
from ddagr_gym.diagnosis.store import StepStore
from ddagr_gym.errors import InputError
from ddagr_gym.physics.effects.registry import absolute_effect_kinds
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.tasks import TaskRunner
from tests.calibration.conftest import drive

FEW = CalibrationSettings(fitted=6, judged=4)
HELD = frozenset(part.name for part in PARTS if part.name not in ("speed_loop", "command_delay"))
"""The true robot differs from its data sheet in the other two."""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Runs of two drives, the names that were kept on the way, and the same of one drive beside the data sheet."""
    sheet = get_robot("ddagr")
    drives = [drive("field", seed, 70.0) for seed in (1, 2)]
    data = prepare_drives(drives, ("field", "field"), sheet, {"field": get_soil("thesis_a1")}, FEW)
    complete, held = complete_model(data)
    windows, model = data.spread(FEW.fitted), complete.without(HELD, sheet)
    start = {name: v for name, v in start_values(data, windows, model.parameters).items() if name in model.free}
    fitted, weights = weigh_and_fit(data, windows, model, {**held, **start}, 1)
    out = tuple(forecasts(data, fitted, data.spread(FEW.judged), weights, 1))
    store, lines = StepStore(tmp_path_factory.mktemp("bank") / "steps", "key"), []
    with TaskRunner() as runner:
        steps = IndependentSteps(runner, store, lines.append)
        runs = ordinary_runs(data, fitted, out, 1, steps)
        again = ordinary_runs(data, fitted, out, 1, steps)
    return runs, again, lines, beside_the_data_sheet(data)


def beside_the_data_sheet(data) -> NullRun:
    recording = data.prepared.recordings[0]
    return NullBank(data.robot, data.soils["field"], setting_of(data, 1), (recording,)).scan([recording], "real")


@pytest.mark.slow
def test_every_drive_is_scanned_for_every_effect(made):
    runs, again, lines, _ = made
    assert [run.kind for run in runs] == ["real field_1.csv 0", "real field_2.csv 1"]
    for run in runs:
        # an effect of which nothing shows in a drive has no gain there
        assert set(absolute_effect_kinds()) - set(run.gains) <= {"sensor_hold"}
        assert run.windows >= 3
    # what is kept on the way comes back as it was
    assert again == runs
    label = "every effect of the library on each drive"
    assert lines == 2 * [label, f"{label}: 1 of 2", f"{label}: 2 of 2"]


@pytest.mark.slow
def test_what_the_calibration_holds_gains_nothing_any_more(made):
    """The commands are late by 0.22 s and the motor is slow; the data sheet knows of neither."""
    runs, _, _, before = made
    for name in ("command_delay", "motor_lag"):
        assert runs[0].gains[name] < 0.05 * before.gains[name]


@pytest.mark.slow
def test_the_file_reads_back(made, tmp_path):
    runs = made[0]
    save_runs(runs, tmp_path / NAME)
    assert load_runs(tmp_path / NAME) == runs


def test_no_bank_is_said(tmp_path):
    with pytest.raises(InputError, match="make it with `ddagr calibrate`, without --no-bank"):
        load_runs(tmp_path / NAME)
    for text in ("[]", '{"runs": []}', '{"version": 1, "runs": [{}]}'):
        (tmp_path / NAME).write_text(text)
        with pytest.raises(InputError, match="make it with `ddagr calibrate`, without --no-bank"):
            load_runs(tmp_path / NAME)
    (tmp_path / NAME).write_text('{"version": 0, "runs": [{}]}')
    with pytest.raises(InputError, match="calibrate again"):
        load_runs(tmp_path / NAME)
