"""A calibrated robot without one of its ordinary drives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.change.ordinary import OrdinaryRobot, Reference, Scores, Weighing, field_deviations
from ddagr_gym.errors import InputError
from ddagr_gym.identification.parameters import robot_parameters
from ddagr_gym.presets import get_robot, get_soil

ROBOT, SOIL = get_robot("ddagr"), get_soil("thesis_a1")
SCORES = Scores(("a 0",), np.zeros(1), np.eye(1), np.eye(1), np.eye(1))
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
