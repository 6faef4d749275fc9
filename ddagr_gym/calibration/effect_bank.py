"""What ordinary drives do to every effect of the library: each is diagnosed with a robot calibrated without it.

The calibrated simulator is not right either. How much an effect seems to gain on a drive in which it is not there,
with a robot that was calibrated on the other drives, is what a diagnosis with this calibration has to exceed.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ddagr_gym.calibration.calibration_data import CalibrationData
from ddagr_gym.calibration.independent_steps import IndependentSteps
from ddagr_gym.calibration.joint_fit import FittedModel
from ddagr_gym.calibration.left_out import Forecast
from ddagr_gym.calibration.ordinary_drives import Ordinary
from ddagr_gym.calibration.ordinary_files import ordinary_as_mapping, ordinary_from_mapping
from ddagr_gym.calibration.simulator_values import fitted_robot, fitted_soil
from ddagr_gym.diagnosis.gates.thresholds import NullRun
from ddagr_gym.diagnosis.null_bank.bank import NullBank
from ddagr_gym.diagnosis.setting import Setting
from ddagr_gym.errors import InputError
from ddagr_gym.files import read_json, write_text
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.tasks import Task

NAME = "bank.json"
VERSION = 2
READ = (1, 2)
"""Versions that are read: the first one has no ordinary drives to compare others with."""

_FAULT = "is no bank of drives"
_REMEDY = "make it with `ddagr calibrate`, without --no-bank"

STRIDE = 18.0
"""Seconds between windows of 6 s (ours): a third of a drive, so that its scan takes about a minute."""


def ordinary_runs(
    data: CalibrationData,
    model: FittedModel,
    made: Sequence[Forecast],
    threads: int,
    steps: IndependentSteps,
) -> tuple[NullRun, ...]:
    """One run for each drive: gains of all effects beside the robot that was calibrated without it.

    Args:
        data: drives.
        model: joint fit.
        made: forecasts of the left-out drives, with the values of the fit without each.
        threads: of the simulator.
        steps: run the drives.
    """
    tasks = [_task(data, model, forecast, threads) for forecast in made]
    return tuple(steps.results("every effect of the library on each drive", tasks))


def _task(data: CalibrationData, model: FittedModel, forecast: Forecast, threads: int) -> Task:
    """Scan of the drive that a forecast left out."""
    number = int(forecast.windows.recording[0])
    values = forecast.values_of(model)
    robot = fitted_robot(model.model.robot, values)
    soil = fitted_soil(data, data.grounds[number], values)
    recording, name = data.prepared.recordings[number], f"{data.names[number]} {forecast.fold}"
    bank = NullBank(robot, soil, setting_of(data, threads), (recording,))
    return Task(name, scan_drive, (bank, f"real {name}"), f"bank {forecast.fold}")


def scan_drive(bank: NullBank, kind: str) -> NullRun:
    """Run of the only drive of a bank; workers call it by name."""
    (drive,) = bank.drives
    assert isinstance(drive, Recording)
    return bank.scan([drive], kind)


def setting_of(data: CalibrationData, threads: int) -> Setting:
    """Of the scans: windows as long as those of the fit, and fewer of them."""
    return Setting(threads=threads).with_windows(data.windows.duration, STRIDE)


def save_runs(runs: Sequence[NullRun], path: Path, ordinary: Ordinary | None = None) -> None:
    """Write runs, and what a comparison needs of the drives, as JSON."""
    compared = None if ordinary is None else ordinary_as_mapping(ordinary)
    body = {"version": VERSION, "runs": [asdict(run) for run in runs], "ordinary": compared}
    write_text(path, json.dumps(body, allow_nan=False) + "\n")


def load_runs(path: Path) -> tuple[NullRun, ...]:
    """Read runs.

    Raises:
        InputError: no such file, or another format.
    """
    body = _read(path)
    try:
        return tuple(NullRun(**{**run, "meaningless": tuple(run["meaningless"])}) for run in body["runs"])
    except (KeyError, TypeError) as error:
        raise _no_bank(path, error) from None


def load_ordinary(path: Path) -> Ordinary:
    """Read what a comparison needs of the drives.

    Raises:
        InputError: no such file, another format, or one without it.
    """
    body = _read(path)
    if not body.get("ordinary"):
        raise InputError(
            f"{path} says nothing of the sizes of effects in ordinary drives: calibrate again with two drives or more "
            "and without --no-bank."
        )
    try:
        return ordinary_from_mapping(body["ordinary"])
    except (KeyError, TypeError, ValueError) as error:
        raise _no_bank(path, error) from None


def _read(path: Path) -> dict[str, Any]:
    body = read_json(path, _FAULT, _REMEDY)
    try:
        version = body["version"]
    except (KeyError, TypeError) as error:
        raise _no_bank(path, error) from None
    if version not in READ:
        raise InputError(f"{path} has version {version!r}, this program reads {VERSION}: calibrate again.")
    found: dict[str, Any] = body
    return found


def _no_bank(path: Path, error: Exception) -> InputError:
    return InputError(f"{path} {_FAULT} ({error}): {_REMEDY}.")
