"""What a calibration says of sensors becomes names and sizes of a diagnosis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.calibration.accelerometer_results import ImuMounting, MountingSize
from ddagr_gym.calibration.part_comparison import surely_above
from ddagr_gym.calibration.result import PartDecision
from ddagr_gym.calibration.sensor_findings import named_sensors
from ddagr_gym.diagnosis.answer.verdict import Estimate
from ddagr_gym.diagnosis.preprocessing.data_checks import DoubtedBanks
from ddagr_gym.physics.effects.command_gain import CommandGain
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


def test_the_lateness_of_poses_has_an_interval_as_sure_as_other_answers():
    """The checks are surer: at 99 %."""
    made = calibration(0.4)
    drives = tuple(replace(drive, lateness_interval=(0.3, 0.6)) for drive in made.drives)
    ((finding, _),) = named_sensors(replace(made, drives=drives))
    low, high = finding.parameters["latency"].interval
    assert (0.4 - low) / 0.1 == pytest.approx((high - 0.4) / 0.2)
    assert (high - 0.4) / 0.2 == pytest.approx(1.645 / 2.576, rel=1e-3)


def with_encoders(right: float, left: float, kept: bool = True):
    scales = {"encoder_scale_right": right, "encoder_scale_left": left}
    return with_scales("encoder_scale", kept, **scales)


def test_encoders_are_named_with_both_scales_and_what_speaks_for_them():
    ((finding, effect),) = named_sensors(with_encoders(1.004, 1.2))
    assert isinstance(effect, EncoderScale)
    scales = {name: item.value for name, item in finding.parameters.items()}
    assert scales == pytest.approx({"right": 1.004, "left": 1.2})
    assert (effect.right, effect.left) == (scales["right"], scales["left"])
    assert finding.parameters["left"].interval == (0.1, 0.3)
    assert (finding.gain, finding.score) == (0.3, pytest.approx(15.0))
    assert finding.gain > finding.gate == surely_above(2) * 0.02
    assert finding.by_forecasts


def with_gains(right: float, left: float, kept: bool = True):
    return with_scales("command_gain", kept, command_gain_right=right, command_gain_left=left)


def test_commands_that_the_banks_obey_differently_are_named_with_both_gains():
    ((finding, effect),) = named_sensors(with_gains(1.15, 0.95))
    assert finding.name == effect.name == CommandGain.name
    assert (effect.right, effect.left) == pytest.approx((1.15, 0.95))
    assert {name: item.value for name, item in finding.parameters.items()} == pytest.approx(
        {"right": 1.15, "left": 0.95}
    )


def test_intervals_of_gains_reach_to_those_with_nothing_in_common():
    """What both banks have in common may be friction, load or the highest speed."""
    made = with_gains(1.3, 1.1)
    sure = {"command_gain_right": (1.28, 1.32), "command_gain_left": (1.08, 1.12)}
    items = [replace(p, interval=sure.get(p.name, p.interval)) for p in made.parameters]
    ((finding, _),) = named_sensors(replace(made, parameters=tuple(items)))
    right, left = (finding.parameters[name].interval for name in ("right", "left"))
    common = (1.3 * 1.1) ** 0.5
    assert right == pytest.approx((1.3 / common, 1.32))
    assert left == pytest.approx((1.1 / common, 1.12))


@pytest.mark.parametrize(
    ("given", "kind", "sizes"),
    [(with_encoders(0.93, 0.95), EncoderScale, (0.93, 0.95)), (with_gains(0.98, 0.9), CommandGain, (0.98, 0.9))],
)
def test_banks_that_agree_have_no_name_but_count(given, kind, sizes):
    """The rest was fitted beside what both have in common."""
    ((finding, effect),) = named_sensors(given)
    assert finding is None
    assert isinstance(effect, kind)
    assert (effect.right, effect.left) == pytest.approx(sizes)


@pytest.mark.parametrize(
    ("fitted", "sizes", "common", "set_of"),
    [
        (with_encoders, (1.12, 1.1), ("encoder_scale", "command_gain"), {"encoder_scale": 0.5, "command_gain": 0.5}),
        (with_encoders, (0.9, 0.92), ("encoder_scale",), {"encoder_scale": 1.0}),
        (with_gains, (1.12, 1.1), ("command_gain",), {"command_gain": 1.0}),
    ],
)
def test_what_both_banks_have_in_common_is_named_with_what_may_be_it(fitted, sizes, common, set_of):
    ((finding, _),) = named_sensors(fitted(*sizes), DoubtedBanks((), common))
    assert finding.equivalence_set == set_of
    assert [finding.parameters[name].value for name in ("right", "left")] == pytest.approx(sizes)
    assert finding.parameters["right"].interval == (0.1, 0.3)


def test_intervals_of_banks_that_are_faster_alike_hold_those_of_both():
    """Motors may differ by as little as the banks do."""
    made = with_encoders(1.12, 1.1)
    sure = {"encoder_scale_right": (1.11, 1.13), "encoder_scale_left": (1.09, 1.105)}
    items = [replace(p, interval=sure.get(p.name, p.interval)) for p in made.parameters]
    ((finding, _),) = named_sensors(replace(made, parameters=tuple(items)), DoubtedBanks((), ("encoder_scale",)))
    assert [finding.parameters[name].interval for name in ("right", "left")] == [(1.09, 1.13)] * 2


def test_intervals_reach_to_the_gain_at_held_commands():
    """A fit that lets motors fall short of their commands finds a larger scale."""
    made = with_encoders(1.12, 1.1)
    sure = {"encoder_scale_right": (1.11, 1.13), "encoder_scale_left": (1.09, 1.105)}
    items = [replace(p, interval=sure.get(p.name, p.interval)) for p in made.parameters]
    held = ((1.08, (1.05, np.inf)), (1.07, (-np.inf, np.inf)))
    doubted = DoubtedBanks((), ("encoder_scale",), held)
    ((finding, _),) = named_sensors(replace(made, parameters=tuple(items)), doubted)
    low, high = finding.parameters["right"].interval
    assert high == 1.13
    assert low == pytest.approx(1.08 - 0.03 * 1.645 / 2.576, rel=1e-4)


@pytest.mark.parametrize("given", [with_encoders(1.03, 1.04), with_encoders(0.97, 0.98)])
def test_little_that_both_banks_have_in_common_has_no_name(given):
    ((finding, _),) = named_sensors(given, DoubtedBanks((), ("encoder_scale", "command_gain")))
    assert finding is None


@pytest.mark.parametrize("given", [with_encoders(1.0, 1.2, kept=False), with_gains(1.0, 1.3, kept=False)])
def test_what_forecasts_do_not_ask_for_is_not_there(given):
    assert named_sensors(given) == ()


def test_an_encoder_that_is_not_identified_is_stated_as_it_should_be():
    made = with_encoders(1.0, 1.2)
    held = [replace(p, calibrated=p.name != "encoder_scale_right") for p in made.parameters]
    ((finding, _),) = named_sensors(replace(made, parameters=tuple(held)))
    assert finding.parameters["right"] == Estimate(1.0, "-", None)


def test_a_gyro_is_not_named_by_forecasts():
    """The poses say more of it, and its scale is undone before the fit."""
    assert named_sensors(with_scales("gyro_scale", gyro_scale=1.1)) == ()


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


def test_a_mounting_of_which_no_size_is_surely_something_is_not_named():
    made = with_imu("imu_x", "imu_y")
    wide = [replace(item, interval=(item.value - 1.0, item.value + 1.0)) for item in made.imu.sizes if item.kept]
    assert named_sensors(replace(made, imu=replace(made.imu, sizes=tuple(wide)))) == ()


def test_a_simulator_keeps_no_more_of_the_past_than_its_effect():
    ((finding, effect),) = named_sensors(calibration(1.2))
    assert (finding.parameters["latency"].value, effect.latency) == (1.2, 1.0)


def test_a_mounting_holds_the_sizes_of_its_fields():
    (moved, _), (turned, _) = named_sensors(with_imu("imu_yaw", "imu_x", "imu_y"))
    assert {name: item.value for name, item in turned.parameters.items()} == {"yaw": 0.3}
    assert {name: item.interval for name, item in moved.parameters.items()} == {
        "x": (0.4, 0.6),
        "y": (-0.30000000000000004, -0.1),
    }
    assert turned.gate == surely_above(2) * 0.01
