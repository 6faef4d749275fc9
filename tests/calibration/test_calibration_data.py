"""What is said of a drive before it is fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.calibration.calibration_data import prepare_drives
from ddagr_gym.calibration.settings import CalibrationSettings
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import RobotGeometry
from tests.recordings.conftest import Faults, drive


@pytest.mark.parametrize(("scale", "said"), [(1.0, False), (1.1, True)])
def test_banks_that_are_faster_than_told_have_a_note(scale: float, said: bool) -> None:
    """A calibrated robot would not follow such commands: no drivetrain of it is faster than it was told."""
    geometry = RobotGeometry("warthog", 0.3, 0.54)
    made = drive(geometry, Faults(right_scale=scale, left_scale=scale), seconds=300.0)
    soils = {"ground": get_soil("thesis_a1")}
    data = prepare_drives([made], ["ground"], get_robot("warthog"), soils, CalibrationSettings())
    found = [note for note in data.notes[0] if "settle at 1.10" in note and "wheel radius" in note]
    assert bool(found) == said


def test_how_long_sensors_repeat_their_readings_is_kept() -> None:
    geometry = RobotGeometry("warthog", 0.3, 0.54)
    made = drive(geometry, Faults(), seconds=300.0)
    wheels = {name: np.repeat(made[name][::4], 4)[: len(made)] for name in ("encoder_right", "encoder_left")}
    held = replace(made, channels={**made.channels, **wheels})
    soils = {"ground": get_soil("thesis_a1")}
    data = prepare_drives([made, held], ["ground"] * 2, get_robot("warthog"), soils, CalibrationSettings())
    assert data.holds[0] == {}
    assert data.holds[1] == {"encoders": pytest.approx(3.0 * made.period, rel=0.05)}
