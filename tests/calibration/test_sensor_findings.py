"""What a calibration says of sensors becomes names and sizes of a diagnosis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.calibration.accelerometer_results import ImuMounting, MountingSize
from ddagr_gym.calibration.part_selection import surely_above
from ddagr_gym.calibration.result import PartDecision
from ddagr_gym.calibration.sensor_findings import named_sensors
from ddagr_gym.physics.effects.encoder_scale import EncoderScale
from ddagr_gym.physics.effects.imu_lever_arm import ImuLeverArm
from ddagr_gym.physics.effects.imu_misalignment import ImuMisalignment
from ddagr_gym.physics.effects.pose_latency import PoseLatency
from tests.calibration.test_drivetrain_answer import calibration, parameter


def with_scales(part: str, kept: bool = True, **scales: float):
    made = calibration()
    parts = (*made.parts, PartDecision(part, kept, 0.3, 0.02))
    sizes = [replace(parameter(name, part, value, kept), change=np.log(value)) for name, value in scales.items()]
    return replace(made, parts=parts, parameters=(*made.parameters, *sizes))


def with_gyro(value: float, kept: bool = True):
    return with_scales("gyro_scale", kept, gyro_scale=value)


def with_imu(*kept: str):
    values = {"imu_yaw": 0.3, "imu_x": 0.5, "imu_y": -0.2, "imu_pitch": 0.05}
    sizes = [
        MountingSize(name, "-", value, (value - 0.1, value + 0.1), True, 0.4, 0.01, "")
        if name in kept
        else MountingSize(name, "-", 0.0, None, False, 0.0, 0.01, "drive on")
        for name, value in values.items()
    ]
    return replace(calibration(), imu=ImuMounting(tuple(sizes), 500, 1.0, 0.8))


@pytest.mark.parametrize(("lateness", "effects"), [(0.01, []), (0.4, [PoseLatency(0.4)])])
def test_late_poses_are_named_from_the_least_latency_that_matters(lateness, effects):
    found = named_sensors(calibration(lateness))
    assert [effect for _, effect in found] == effects
    assert [finding.name for finding, _ in found] == [effect.name for effect in effects]


@pytest.mark.parametrize(
    ("given", "scales"),
    [
        (with_gyro(1.1), [1.1]),
        (with_gyro(1.004), []),
        (with_gyro(1.1, kept=False), []),
    ],
)
def test_a_gyro_is_named_where_forecasts_ask_for_another_scale_that_matters(given, scales):
    assert [effect.scale for _, effect in named_sensors(given)] == pytest.approx(scales)


def test_encoders_are_named_with_both_scales():
    ((finding, effect),) = named_sensors(
        with_scales("encoder_scale", encoder_scale_right=1.004, encoder_scale_left=1.2)
    )
    assert isinstance(effect, EncoderScale)
    scales = {name: item.value for name, item in finding.parameters.items()}
    assert scales == pytest.approx({"right": 1.004, "left": 1.2})
    assert (effect.right, effect.left) == (scales["right"], scales["left"])


def test_a_gyro_finding_holds_size_interval_and_what_speaks_for_it():
    ((finding, _),) = named_sensors(with_gyro(1.1))
    scale = finding.parameters["scale"]
    assert (scale.value, scale.interval) == (pytest.approx(1.1), (0.1, 0.3))
    assert (finding.gain, finding.score) == (0.3, pytest.approx(15.0))
    assert finding.gain > finding.gate == surely_above(2) * 0.02


@pytest.mark.parametrize(
    ("kept", "effects"),
    [
        (("imu_yaw",), [ImuMisalignment(0.3)]),
        (("imu_x", "imu_y"), [ImuLeverArm(0.5, -0.2)]),
        (("imu_yaw", "imu_x", "imu_y"), [ImuLeverArm(0.5, -0.2), ImuMisalignment(0.3)]),
        # of one drive a tilt is a bias too
        (("imu_pitch",), []),
        ((), []),
    ],
)
def test_the_mounting_of_the_imu_is_named_as_far_as_left_out_readings_ask_for_it(kept, effects):
    assert [effect for _, effect in named_sensors(with_imu(*kept))] == effects


def test_a_mounting_holds_the_sizes_of_its_fields():
    (moved, _), (turned, _) = named_sensors(with_imu("imu_yaw", "imu_x", "imu_y"))
    assert {name: item.value for name, item in turned.parameters.items()} == {"yaw": 0.3}
    assert {name: item.interval for name, item in moved.parameters.items()} == {
        "x": (0.4, 0.6),
        "y": (-0.30000000000000004, -0.1),
    }
    assert turned.gate == surely_above(2) * 0.01
