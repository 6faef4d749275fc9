"""A calibrated robot without one of its ordinary drives."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.change.expected_scatter import EXPECTED_DRIVES
from ddagr_gym.diagnosis.change.ordinary import OrdinaryRobot, Reference, Scores, field_deviations
from ddagr_gym.diagnosis.change.requirements import check_comparable
from ddagr_gym.diagnosis.change.robot_on_ground import RobotOnGround
from ddagr_gym.diagnosis.change.weighing import SLOPE_ON_A_GROUND, SensorBias, Weighing
from ddagr_gym.errors import InputError
from ddagr_gym.identification.parameters import robot_parameters
from ddagr_gym.physics.effects.registry import effect_kinds
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording, RecordingMeta

ROBOT, SOIL = get_robot("ddagr"), get_soil("thesis_a1")
SCORES = Scores(("a 0",), np.zeros(1), np.eye(1), np.eye(1), np.eye(1))
HELD, LONGER = {"pose": 0.1, "encoders": 0.2}, {"pose": 0.15}
DEVIATIONS = dict.fromkeys(field_deviations(), 0.01)


def reference(drive: str, ground: str) -> Reference:
    robot = replace(ROBOT, motor_rate=ROBOT.motor_rate * (1.0 + 0.1 * len(drive)))
    return Reference(drive, ground, False, SCORES, SCORES, robot=robot, soil=replace(SOIL, cohesion=len(drive)))


@pytest.fixture
def robot() -> OrdinaryRobot:
    drives = (reference("a", "sand"), reference("bb", "sand"), reference("ccc", "yard"))
    parameters = tuple(replace(p, prior=0.02) for p in robot_parameters(ROBOT)[:2])
    weighing = Weighing(4.0, 0.6, 0.0, 1.0, np.ones(8), np.ones(8), 1e-3, 0.05)
    return OrdinaryRobot(
        ROBOT, {"sand": SOIL, "yard": SOIL}, parameters, {"sand": DEVIATIONS, "yard": DEVIATIONS}, weighing, drives, "c"
    )


def test_robot_and_soil_are_those_without_the_drive(robot):
    found = robot.without("bb")
    own = robot.references[1]
    assert found.robot == own.robot
    assert found.soils == {"sand": own.soil, "yard": SOIL}
    assert [item.drive for item in found.references] == ["a", "ccc"]
    assert [(p.name, p.prior) for p in found.parameters] == [(p.name, 0.02) for p in robot.parameters]


def test_a_ground_with_one_drive_left_differs_as_a_field_does(robot):
    found = robot.without("bb")
    assert found.soil_deviations == {"sand": field_deviations(), "yard": DEVIATIONS}


def test_a_ground_without_a_drive_is_not_known(robot):
    assert set(robot.without("ccc").soils) == {"sand"}


def test_what_cannot_be_left_out_is_refused(robot):
    with pytest.raises(InputError, match="d is not among the ordinary drives: a, bb, ccc"):
        robot.without("d")
    old = replace(robot, references=tuple(replace(item, robot=None) for item in robot.references))
    with pytest.raises(InputError, match="c cannot do without a: calibrate again"):
        old.without("a")
    with pytest.raises(InputError, match="with two drives or more"):
        replace(robot, references=robot.references[:1]).without("a")


def test_on_a_known_ground_the_robot_is_that_of_the_drives_on_it(robot):
    there = RobotOnGround({"yaw_inertia": 0.3}, {"yaw_inertia": 0.01})
    known = replace(robot, on_grounds={"sand": there})
    assert known.robot_on("sand").yaw_inertia == pytest.approx(ROBOT.yaw_inertia * np.exp(0.3))
    assert known.robot_on("yard") == known.robot_on("") == ROBOT
    asked = [recording("steps")]
    priors = [{p.name: p.prior for p in known.uncertain(ground, asked)}["yaw_inertia"] for ground in ("sand", "yard")]
    assert priors == [0.01, 0.02]


def test_without_a_drive_its_ground_is_as_the_others_on_it_tell(robot):
    there = RobotOnGround({"yaw_inertia": -0.1}, {"yaw_inertia": 0.015})
    references = (robot.references[0], replace(robot.references[1], on_ground=there), robot.references[2])
    known = replace(robot, references=references, on_grounds=dict.fromkeys(("sand", "yard"), RobotOnGround()))
    assert known.without("bb").on_grounds == {"sand": there}
    assert known.without("ccc").on_grounds == {}


BIASES = (
    SensorBias("a", "sand", np.array([0.001, 0.40, -0.30])),
    SensorBias("bb", "sand", np.array([0.003, 0.34, -0.22])),
    SensorBias("ccc", "yard", np.array([0.002, 0.05, -0.10])),
)


def test_accelerometers_lean_on_a_ground_as_in_the_other_drives_on_it(robot):
    weighing = replace(robot.weighing, offsets=np.array([0.002, 0.2, -0.2]), accelerometer_bias=0.16, biases=BIASES)
    known = weighing.on("sand")
    np.testing.assert_allclose(known.offsets, [0.002, 0.37, -0.26])
    # two drives, two axes: squares of half the differences, beside what is expected
    square = 2.0 * 0.03**2 + 2.0 * 0.04**2
    scatter = np.sqrt((EXPECTED_DRIVES * SLOPE_ON_A_GROUND**2 + square) / (EXPECTED_DRIVES + 2.0))
    assert known.accelerometer_bias == pytest.approx(scatter * np.sqrt(1.5))
    np.testing.assert_allclose(weighing.on("sand", "bb").offsets, [0.002, 0.40, -0.30])
    for unknown in (weighing.on(""), weighing.on("moss"), weighing.on("yard", "ccc")):
        assert unknown is weighing


def test_what_a_left_out_drive_says_of_biases_is_left_out_too(robot):
    weighing = replace(robot.weighing, biases=BIASES)
    found = replace(robot, weighing=weighing).without("bb").weighing
    assert [item.drive for item in found.biases] == ["a", "ccc"]


def recording(column_map: str) -> Recording:
    time = np.arange(100) / 20.0
    return Recording(time, {}, np.ones(100, dtype=bool), RecordingMeta(column_map=column_map, segments=((0, 100),)))


def test_commands_of_another_logger_may_be_a_sample_apart(robot):
    late = replace(
        ROBOT, drivetrain=replace(ROBOT.drivetrain, command_delay=0.2), standard_deviations={"command_delay": 0.01}
    )
    delay = next(p for p in robot_parameters(late) if p.name == "command_delay")
    references = tuple(replace(item, column_map="steps") for item in robot.references)
    robot = replace(robot, parameters=(replace(delay, prior=0.01),), references=references)
    for column_map, prior in (("steps", 0.01), ("bag", np.hypot(0.01, 0.05))):
        free = robot.uncertain("sand", [recording("steps"), recording(column_map)])
        assert {p.name: p.prior for p in free}["command_delay"] == pytest.approx(prior)


def test_sensors_may_repeat_readings_for_as_long_as_in_any_ordinary_drive(robot):
    assert robot.usual_holds is None
    drives = (replace(item, holds=held) for item, held in zip(robot.references, ({}, HELD, LONGER), strict=True))
    assert replace(robot, references=tuple(drives)).usual_holds == {"pose": 0.15, "encoders": 0.2}


def test_effects_that_came_after_a_calibration_are_not_compared(robot):
    keys = ("gyro_bias 0", "slope 0", "slope 1")
    scores = Scores(keys, np.zeros(3), np.eye(3), np.eye(3), np.eye(3))
    references = tuple(replace(item, known_ground=scores, other_ground=scores) for item in robot.references)
    unnamed = replace(robot, references=references).comparison("sand").unnamed
    assert set(effect_kinds()) - set(unnamed) == {"gyro_bias", "slope"}
    assert "calibrate again" in unnamed["command_gain"]
    assert "poses are in one frame" in unnamed["soil_patch"]


def test_a_drive_of_another_rate_than_the_ordinary_ones_is_refused(robot):
    """Recordings here have 20 Hz; calibrations of before do not say theirs."""
    with pytest.raises(
        InputError, match=r"b\.csv has 20 Hz and a of the calibration 40 Hz: compare drives of one rate"
    ):
        check_comparable([asked("b.csv")], of_rate(robot, 40.0), "sand")
    for rate in (20.0, math.inf):
        with pytest.raises(InputError, match="has no command_right"):
            check_comparable([asked("b.csv")], of_rate(robot, rate), "sand")


def asked(source: str) -> Recording:
    return recording("").with_meta(source=source)


def of_rate(robot: OrdinaryRobot, rate: float) -> OrdinaryRobot:
    return replace(robot, references=tuple(replace(item, period=1.0 / rate) for item in robot.references))
