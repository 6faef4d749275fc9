"""A drive of known physics, and recordings without any simulator in them."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.simulated_robots import stronger
from ddagr_gym.control.manoeuvres import MANOEUVRES
from ddagr_gym.identification.windows import CHANNELS as PREDICTED
from ddagr_gym.identification.windows import WindowSet
from ddagr_gym.parameters import Imu, PoseReceiver, Sensors
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.channels import CHANNELS
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import simulate

RATE = 50.0
SOIL = "sandy_loam_lll_15"
STRENGTH, MOTOR_RATE = 0.8, 0.85
"""Factors by which the simulated drive differs from the presets."""


def as_recording(columns: dict, robot=None, **more) -> Recording:
    kept = {name: values for name, values in columns.items() if name == "t" or name in CHANNELS}
    return Recording.from_columns(kept, robot or get_robot("ddagr"), **more)


def simulated(parts: tuple[str, ...], sensors: Sensors, seed: int = 3) -> Recording:
    """A drive of the DDAGR on soil of 0.8 times the preset's strength, with slower motors."""
    robot, soil = get_robot("ddagr"), get_soil(SOIL)
    true_soil = stronger(soil, STRENGTH)
    commands = np.concatenate([MANOEUVRES[name].commands(RATE) for name in parts])
    columns = simulate(
        replace(robot, motor_rate=MOTOR_RATE * robot.motor_rate), true_soil, commands, sensors=sensors, seed=seed
    )
    return as_recording(columns, source="drive.sim")


@pytest.fixture(scope="session")
def drive() -> Recording:
    """52 s of arcs and turns on the spot, with sensor noise."""
    sensors = Sensors(imu=Imu(sample_rate=RATE, gyro_noise=0.002, accelerometer_noise=0.05), pose=PoseReceiver(5.0))
    return simulated(("arcs", "spin"), sensors)


@pytest.fixture(scope="session")
def robot():
    return get_robot("ddagr")


@pytest.fixture(scope="session")
def soil():
    return get_soil(SOIL)


@pytest.fixture(scope="session")
def recordings_dir(repository) -> Path:
    """Real drives: DDAGR_RECORDINGS, else ``shared/recordings`` beside the checkout; skips when absent."""
    shared = os.environ.get("DDAGR_SHARED") or repository.parent / "shared"
    folder = Path(os.environ.get("DDAGR_RECORDINGS") or Path(shared) / "recordings")
    if not (folder / "open").is_dir():
        pytest.skip(f"real drives are not at {folder}: set DDAGR_RECORDINGS to their folder")
    return folder


def window_set(drive: np.ndarray, period: float = 0.05, kept: int = 10, **changes) -> WindowSet:
    """Windows around a drive (W, kept + T + kept, 2) with nothing measured."""
    count, samples = len(drive), drive.shape[1] - 2 * kept
    fields = {
        "period": period,
        "recording": np.zeros(count, dtype=np.int64),
        "start": np.arange(count) * samples,
        "time": np.arange(count) * samples * period,
        "commands": drive,
        "history": kept,
        "measured": np.full((count, samples, len(PREDICTED)), np.nan),
        "initial": np.zeros((count, 8)),
        "ahead": kept,
    }
    return WindowSet(**{**fields, **changes})


def plain_recording(seconds: float = 100.0, period: float = 0.05, **columns) -> Recording:
    """Columns on an even clock; all zero where not given."""
    t = np.arange(0.0, seconds, period)
    names = ("command_right", "command_left", "encoder_right", "encoder_left", "yaw_rate")
    more = {name: columns.pop(name) for name in ("command_valid", "segments", "spans") if name in columns}
    return as_recording({"t": t, **{name: np.zeros(t.size) for name in names}, **columns}, **more)


@pytest.fixture(scope="session")
def make_windows():
    """:func:`window_set`."""
    return window_set


@pytest.fixture(scope="session")
def make_recording():
    """:func:`plain_recording`."""
    return plain_recording


@pytest.fixture(scope="session")
def make_drive():
    """:func:`simulated`."""
    return simulated
