"""Pose receiver: when it reports, what, and how well."""

import numpy as np
import pytest

from ddagr_gym.parameters import Imu, PoseReceiver, Sensors
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.simulator import simulate

POSE = ("pose_x", "pose_y", "pose_yaw")


def _drive(pose, samples=1250, sample_rate=125.0, seed=0):
    sensors = Sensors(imu=Imu(sample_rate=sample_rate), pose=pose)
    return simulate(
        get_robot("ddagr"), get_soil("thesis_a1"), np.tile([0.4, 0.9], (samples, 1)), sensors=sensors, seed=seed
    )


@pytest.mark.parametrize(("rate", "sample_rate"), [(10.0, 125.0), (7.0, 125.0), (20.0, 100.0), (1.0, 50.0)])
def test_fixes_come_at_the_receivers_rate(rate, sample_rate):
    samples = int(10 * sample_rate)
    drive = _drive(PoseReceiver(rate=rate), samples, sample_rate)
    fixes = np.flatnonzero(np.isfinite(drive["pose_x"]))
    assert len(fixes) == pytest.approx(10 * rate, abs=1)
    # each at the first sample at or after its due time: late by less than one sample, and never drifting
    lateness = drive["t"][fixes] - np.arange(len(fixes)) / rate
    assert (lateness >= -1e-9).all()
    assert (lateness < 1.0 / sample_rate + 1e-9).all()
    for name in POSE[1:]:
        np.testing.assert_array_equal(np.isfinite(drive[name]), np.isfinite(drive["pose_x"]))


def test_faster_receiver_than_samples_reports_at_every_sample():
    assert np.isfinite(_drive(PoseReceiver(rate=300.0), 50)["pose_x"]).all()


def test_no_receiver_no_fix():
    drive = _drive(PoseReceiver(rate=0.0), 50)
    assert all(np.isnan(drive[name]).all() for name in POSE)


def test_fixes_are_the_true_pose_with_the_stated_noise():
    pose = PoseReceiver(rate=125.0, position_noise=0.02, yaw_noise=0.01)
    drive = _drive(pose, 4000, seed=5)
    for name, noise in zip(POSE, (0.02, 0.02, 0.01), strict=True):
        error = drive[name] - drive["true_" + name.removeprefix("pose_")]
        assert error.std() == pytest.approx(noise, rel=0.05)
        assert abs(error.mean()) < 4 * noise / np.sqrt(4000)
    exact = _drive(PoseReceiver(rate=125.0, position_noise=0.0, yaw_noise=0.0), 100)
    for name in POSE:
        np.testing.assert_array_equal(exact[name], exact["true_" + name.removeprefix("pose_")])
