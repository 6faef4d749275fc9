"""What is undone before the drivetrain of a diagnosis is fitted, what the fit is asked for, and what becomes of it."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ddagr_gym.api.drivetrain_fit import DrivetrainFit
from ddagr_gym.calibration.result import Calibration
from ddagr_gym.diagnosis.preprocessing.data_checks import DoubtedBanks
from ddagr_gym.diagnosis.preprocessing.mended_recordings import mend_recordings
from ddagr_gym.diagnosis.result.drivetrain_names import CompletedNominal
from ddagr_gym.errors import InputWarning
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import RobotGeometry
from tests.calibration.test_drivetrain_answer import calibration
from tests.calibration.test_sensor_findings import with_gains
from tests.recordings.conftest import Faults, drive

NOMINAL = SimpleNamespace(robot=get_robot("warthog"), soil=get_soil("thesis_a1"), soil_name="thesis_a1")


@pytest.fixture
def complete(monkeypatch: pytest.MonkeyPatch):
    """Function that completes the nominal simulator for a drive with faults; what was fitted is asked of ``asked``."""
    asked: list[tuple[Sequence[Any], Any]] = []

    def completed(
        faults: Faults, doubted: Sequence[str] = (), found: Calibration | None = None
    ) -> CompletedNominal | None:
        made = SimpleNamespace(calibration=found or calibration(), robot=NOMINAL.robot, soils={"ground": NOMINAL.soil})

        def calibrated(self: DrivetrainFit, recordings: Sequence[Any], settings: Any) -> Any:
            asked.append((recordings, settings))
            return made

        monkeypatch.setattr(DrivetrainFit, "_calibrated", calibrated)
        mended = mend_recordings([drive(RobotGeometry("warthog", 0.3, 0.54), faults)])
        return DrivetrainFit(NOMINAL, 1, 0, None, None).complete(
            {"encoder_left": 9.0}, mended, DoubtedBanks(tuple(doubted))
        )

    completed.asked = asked
    return completed


@pytest.mark.parametrize("doubted", [(), ("command_gain",), ("encoder_scale",)])
def test_a_sound_drive_is_fitted_as_it_is_and_the_fit_is_asked_for_what_is_in_doubt(complete, doubted):
    complete(Faults(), doubted)
    (((read,), settings),) = complete.asked
    np.testing.assert_array_equal(read["encoder_left"], drive(RobotGeometry("warthog", 0.3, 0.54))["encoder_left"])
    assert settings.doubted == doubted


def test_encoders_that_are_far_off_are_undone_and_the_fit_says_the_rest(complete):
    with pytest.warns(InputWarning, match="another wheel radius than that of warthog"):
        nominal = complete(Faults(right_scale=2.0, left_scale=2.0), ("command_gain",))
    (((read,), settings),) = complete.asked
    sound = drive(RobotGeometry("warthog", 0.3, 0.54))
    np.testing.assert_allclose(read["encoder_right"], sound["encoder_right"], rtol=0.15, atol=1e-9)
    assert settings.doubted == ("encoder_scale", "command_gain")
    (finding,) = [item for item in nominal.findings if item.name == "encoder_scale"]
    assert float(finding.parameters["right"]) == pytest.approx(2.0, rel=0.15)
    assert [effect.name for effect in nominal.effects] == ["encoder_scale"]


def test_what_was_fitted_without_a_name_is_in_the_simulator_only(complete):
    nominal = complete(Faults(), found=with_gains(0.98, 0.9))
    assert "command_gain" not in [finding.name for finding in nominal.findings]
    assert [(effect.right, effect.left) for effect in nominal.effects] == [pytest.approx((0.98, 0.9))]


@pytest.mark.parametrize(
    ("faults", "name"),
    [
        (Faults(gyro_scale=1.1), "gyro_scale"),
        (Faults(gyro_bias=0.06), "gyro_bias"),
        # read with the other sign: a bias is that of the gyro as it was turned
        (Faults(gyro_scale=-1.0, gyro_bias=0.06), "gyro_bias"),
    ],
)
def test_what_rests_and_poses_show_is_named_and_undone(complete, faults, name):
    nominal = complete(faults)
    (((read,), _),) = complete.asked
    sound = drive(RobotGeometry("warthog", 0.3, 0.54))
    assert np.std(read["yaw_rate"]) == pytest.approx(np.std(sound["yaw_rate"]), rel=0.02)
    assert np.mean(read["yaw_rate"]) == pytest.approx(np.mean(sound["yaw_rate"]), abs=0.003)
    assert name in [finding.name for finding in nominal.findings]
