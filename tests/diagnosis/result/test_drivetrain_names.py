"""When the drivetrain is asked for as a whole, and what the verdict is then."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from ddagr_gym.diagnosis.answer.drivetrain import PART_TITLES, DrivetrainAnswer, PartEvidence
from ddagr_gym.diagnosis.answer.verdict import Diagnosis, Estimate, Finding, GatesUsed
from ddagr_gym.diagnosis.gates.thresholds import Thresholds
from ddagr_gym.diagnosis.pipeline import effect_intervals
from ddagr_gym.diagnosis.result.drivetrain_names import (
    UNLIKE,
    CompletedNominal,
    drivetrain_is_missing,
    unlike_commands,
    with_drivetrain,
)
from ddagr_gym.diagnosis.result.files import as_mapping, validate
from ddagr_gym.diagnosis.wording import describe, title
from ddagr_gym.physics.effects.gyro_sign import GyroSign
from ddagr_gym.presets import get_robot, get_soil

GATES = Thresholds({}, {"encoder_right": 2.0, "encoder_left": 2.0, "yaw_rate": 1.0}, 20, "a test")
LEFT = Diagnosis(
    ("unknown",), False, (), "", {"nominal": {"yaw_rate": 1.0}, "corrected": {"yaw_rate": 1.0}, "limit": {}}, {}, {},
    ("a",), GatesUsed(nulls=20, bank="a test", level=0.05), 0.0, "0",
)  # fmt: skip


def model(names: tuple[str, ...], misfit: float) -> Any:
    return SimpleNamespace(names=names, misfit={"encoder_right": misfit, "encoder_left": 1.0, "yaw_rate": 99.0})


def completed(*findings: Finding) -> CompletedNominal:
    parts = tuple(PartEvidence(name, True, 0.2, 0.05) for name in ("command_delay", "load"))
    return CompletedNominal(
        get_robot("warthog"), get_soil("thesis_a1"), DrivetrainAnswer(parts, (), (), 0.93), findings
    )


@pytest.mark.parametrize(("misfit", "asked"), [(2.0 * UNLIKE + 0.1, True), (2.0 * UNLIKE - 0.1, False)])
def test_it_is_asked_for_where_names_leave_too_much_in_an_encoder(misfit, asked):
    assert bool(unlike_commands(model(("motor_lag",), misfit), GATES)) is asked


@pytest.mark.parametrize(
    ("names", "asked"), [(("motor_droop",), True), (("pose_latency", "command_gain"), False), ((), True)]
)
def test_it_is_asked_for_where_no_name_is_what_both_banks_have_in_common(names, asked):
    """A droop of the motors leaves little of encoders that read too little."""
    common = ("encoder_scale", "command_gain")
    assert bool(unlike_commands(model(names, 0.1), GATES, common)) is asked
    assert unlike_commands(model(names, 0.1), GATES) == {}


@pytest.mark.parametrize(
    ("names", "misfit", "missing"),
    [
        (("motor_lag",), 50.0, False),
        (("motor_lag", "pose_latency"), 50.0, True),
        (("motor_lag", "pose_latency"), 2.0, False),
    ],
)
def test_a_third_effect_is_not_looked_for_where_two_leave_the_wheels_unlike_their_commands(names, misfit, missing):
    assert drivetrain_is_missing(model(names, misfit), GATES) is missing


def test_parts_are_the_verdict_with_what_was_seen_and_it_is_never_complete_without_a_name():
    delay = Finding("command_delay", {"command_delay": Estimate(0.2, "s", (0.19, 0.21))}, 0.2, 0.1, 4.0, 0.2)
    load = Finding("load", {"load_compliance": Estimate(0.01, "1/(kg m^2)")}, 0.2, 0.1, 4.0, 0.2)
    seen = Finding("sensor_hold", {}, 9.0, 0.0, 3.0, 9.0)
    beside = replace(LEFT, verdict=("sensor_hold",), findings=(seen,))
    answer = with_drivetrain(beside, completed(delay, load), {"yaw_rate": 7.0})
    assert answer.verdict == ("sensor_hold", "command_delay", "load")
    assert not answer.complete
    assert "93 % of the squared error of the wheel speeds" in answer.sentence
    lacks = (
        "the simulator lacks the robot's drivetrain (dead time of the commands and the ground's torque on the wheels)"
    )
    assert lacks in answer.sentence[0].lower() + answer.sentence[1:]
    assert answer.misfit["nominal"] == {"yaw_rate": 7.0}
    assert with_drivetrain(replace(LEFT, complete=True), completed(), {}).verdict == ("unknown",)
    assert not with_drivetrain(replace(LEFT, complete=True), completed(), {}).complete


def test_what_a_name_may_be_is_not_named_beside_it():
    """A tilt that the rests show, and the bias by which the library explains the same."""
    bias = Finding("accelerometer_bias", {"x": Estimate(-0.5, "m/s^2")}, 30.0, 10.0, 7.0, 30.0)
    tilt = replace(
        Finding.seen("imu_tilt", {"pitch": Estimate(0.05, "rad")}),
        equivalence_set={"imu_tilt": 0.5, "accelerometer_bias": 0.5},
    )
    beside = replace(LEFT, verdict=("accelerometer_bias",), findings=(bias,))
    nominal = completed(tilt)
    assert nominal.meant == {"imu_tilt", "accelerometer_bias"}
    assert with_drivetrain(beside, nominal, {}).verdict == ("imu_tilt",)


def test_an_answer_with_parts_is_read_back_as_it_was_written():
    load = Finding("load", {"load_compliance": Estimate(0.01, "1/(kg m^2)")}, 0.2, 0.1, 4.0, 0.2)
    answer = with_drivetrain(LEFT, completed(load), {})
    assert validate(as_mapping(answer)).drivetrain == answer.drivetrain


def test_parts_have_words_and_effects_keep_theirs():
    assert title("load") == "The ground's torque on the wheels"
    assert title("command_delay") == "Command delay"
    assert all(describe(name, {}).startswith(words) for name, words in PART_TITLES.items() if name != "command_delay")


def test_parts_of_a_drivetrain_take_no_place_among_the_intervals_of_effects():
    load = Finding("load", {"load_compliance": Estimate(0.01, "1/(kg m^2)", (0.0, 0.02))}, 0.2, 0.1, 4.0, 0.2)
    seen = Finding("gyro_sign", {"flip": Estimate(1.0, "-")}, 9.0, 0.0, 3.0, 9.0)
    answer = with_drivetrain(replace(LEFT, findings=(seen,)), completed(load), {})
    assert effect_intervals(answer, (GyroSign(1.0),)) == [{}]
    assert effect_intervals(answer, ()) == []
