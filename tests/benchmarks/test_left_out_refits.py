"""Errors of forecasts of left-out drives by several fits."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.left_out_refits import FITS, draw, row_of
from ddagr_gym.calibration.left_out import ENCODERS, Forecast
from ddagr_gym.identification.windows import WindowSet, cut_windows
from ddagr_gym.parameters import Imu, PoseReceiver, Sensors
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.channels import CHANNELS as SCHEMA
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import simulate


@pytest.fixture(scope="module")
def windows() -> WindowSet:
    """Of a drive of 40 s."""
    robot = get_robot("ddagr")
    commands = np.repeat(np.random.default_rng(1).uniform(-1.0, 1.0, (10, 2)), 80, axis=0)
    sensors = Sensors(Imu(sample_rate=20.0), pose=PoseReceiver(rate=4.0))
    columns = simulate(robot, get_soil("thesis_a1"), commands, sensors=sensors, seed=1)
    kept = {name: values for name, values in columns.items() if name == "t" or name in SCHEMA}
    drive = Recording.from_columns(kept, robot)
    return cut_windows([drive], 4.0, wheel_radius=robot.outer_radius, half_track=robot.half_track)


def test_rows_have_the_median_of_the_wheel_speeds_and_are_drawn(windows: WindowSet, tmp_path: Path):
    outcome = SimpleNamespace(data=SimpleNamespace(names=["a.csv.gz"]))
    rows = []
    for number, name in enumerate(FITS, 1):
        prediction = windows.measured.copy()
        prediction[..., ENCODERS] += 0.1 * number
        rows.append(row_of(outcome, name, Forecast(0, windows, np.zeros(1), prediction), seed=0))
    assert [row["median"] for row in rows] == pytest.approx([0.1, 0.2, 0.3])
    assert rows[1]["interval"] == pytest.approx((0.2, 0.2))
    known = np.isfinite(windows.measured[..., ENCODERS]).sum()
    assert [row["count"] for row in rows] == [known] * 3
    draw(rows, tmp_path / "refits.png")
    assert (tmp_path / "refits.png").stat().st_size > 5_000
