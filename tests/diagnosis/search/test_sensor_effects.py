"""Effects on readings give the same column from a recorded simulation as from one of their own."""

from collections.abc import Callable

import numpy as np
import pytest

from ddagr_gym.diagnosis.search.candidates import candidates_of
from ddagr_gym.diagnosis.search.scan import drive_extent, probe_columns
from ddagr_gym.diagnosis.search.sensor_effects import acts_on_readings_only, record_drives
from ddagr_gym.identification.gauss_newton import fit
from ddagr_gym.identification.problem import Problem
from ddagr_gym.physics.effects.registry import effect_kinds
from ddagr_gym.recordings.schema import Recording

READINGS = ("accelerometer_bias", "encoder_scale", "gyro_scale", "imu_lever_arm", "imu_tilt", "pose_latency")


def test_columns_agree_to_the_bit(drive: Callable[..., Recording], problem_of: Callable[..., Problem]) -> None:
    problem = problem_of(drive())
    fitted = fit(problem, iterations=0)
    drives = record_drives(problem, fitted.point)
    extent = drive_extent(problem, fitted.prediction)
    for name in READINGS:
        probe = candidates_of(effect_kinds()[name], extent, 0)[0].probes[0]
        assert acts_on_readings_only(probe)
        [column], [simulated] = (list(probe_columns(problem, fitted, [probe], known)) for known in (drives, None))
        assert np.abs(column).max() > 0.0
        np.testing.assert_array_equal(column, simulated)


@pytest.mark.parametrize("name", ["slope", "motor_lag", "payload", "command_delay", "wheel_radius_mismatch"])
def test_effects_on_the_robot_need_their_own(name: str) -> None:
    assert not acts_on_readings_only(effect_kinds()[name].neutral())


def test_encoders_in_the_speed_loop_move_the_robot() -> None:
    kind = effect_kinds()["encoder_scale"]
    assert acts_on_readings_only(kind.neutral())
    assert not acts_on_readings_only(kind.neutral(loop=1.0))
