"""Parts of a robot: a complete one has them all, and what is left out is as the data sheet says."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ddagr_gym.calibration.parts import (
    OF_BANKS,
    PARTS,
    RobotModel,
    complete_robot,
    factors_of_banks,
    first_values,
    idle_parts,
    part_of,
    shared_parameters,
)
from ddagr_gym.identification.parameters import LIMITS
from ddagr_gym.parameters import Drivetrain
from ddagr_gym.presets import get_robot

ROBOTS = ("ddagr", "warthog", "husky")


@pytest.mark.parametrize("name", ROBOTS)
def test_a_complete_robot_has_every_limit_and_keeps_what_is_stated(name):
    sheet = get_robot(name)
    complete = complete_robot(sheet)
    for limit in LIMITS:
        assert getattr(complete.drivetrain, limit) < getattr(Drivetrain(), limit)
    assert complete.drivetrain.command_delay == sheet.drivetrain.command_delay
    for field, deviation in sheet.standard_deviations.items():
        assert complete.standard_deviations[field] == deviation


def test_a_limit_of_the_data_sheet_is_the_start():
    sheet = replace(get_robot("warthog"), drivetrain=Drivetrain(command_ramp=26.0))
    assert complete_robot(sheet).drivetrain.command_ramp == 26.0


@pytest.mark.parametrize("name", ROBOTS)
def test_every_parameter_belongs_to_one_part(name):
    names = [p.name for p in shared_parameters(complete_robot(get_robot(name)))]
    assert len(names) == len(set(names))
    for parameter in names:
        assert parameter in part_of(parameter).parameters
    listed = [parameter for part in PARTS for parameter in part.parameters]
    assert len(listed) == len(set(listed))


@pytest.mark.parametrize("part", OF_BANKS)
def test_what_differs_between_banks_is_there_only_when_asked_for(part: str):
    robot = complete_robot(get_robot("warthog"))
    usual, asked = (shared_parameters(robot, doubted) for doubted in ((), (part,)))
    assert asked[: len(usual)] == usual
    assert [p.name for p in asked[len(usual) :]] == list(factors_of_banks(part))


def test_what_may_be_nothing_starts_above_it():
    parameters = shared_parameters(complete_robot(get_robot("warthog")))
    start = first_values(parameters)
    assert {
        "command_delay",
        "command_filter",
        "integral_rate",
        "load_compliance",
        "viscous_rate",
        "coulomb_friction",
    } == set(start)
    assert all(value > 0.0 for value in start.values())


def test_a_part_that_is_left_out_is_gone_from_the_robot_and_from_the_fit():
    sheet = get_robot("warthog")
    complete = complete_robot(sheet)
    model = RobotModel(complete, shared_parameters(complete))
    without = model.without(frozenset({"power_limit", "load"}), sheet)
    assert without.robot.drivetrain.power_limit == sheet.drivetrain.power_limit
    assert without.robot.drivetrain.acceleration_limit == complete.drivetrain.acceleration_limit
    assert model.free - without.free == {"power_limit", "load_compliance"}
    # the parameters stay in their places, so that values and covariances keep their meaning
    assert [p.name for p in without.parameters] == [p.name for p in model.parameters]


def test_every_parameter_of_a_part_is_one_of_the_robot():
    """A field that is renamed must not leave its part empty."""
    known = {p.name for p in shared_parameters(complete_robot(get_robot("warthog")), tuple(OF_BANKS))}
    assert {parameter for part in PARTS for parameter in part.parameters} == known


def test_what_acts_through_parts_that_have_all_gone_is_idle():
    robot = get_robot("warthog")
    limits = frozenset({"torque_limit", "no_load_speed", "power_limit"})
    assert idle_parts(limits, robot) == {"limit_imbalance"}
    assert idle_parts(limits - {"power_limit"}, robot) == frozenset()
    assert idle_parts(frozenset({"integral"}), robot) == {"integral_limit"}
    assert idle_parts(frozenset({"integral", "integral_limit"}), robot) == frozenset()
    stated = replace(robot, drivetrain=replace(robot.drivetrain, power_limit=100.0, integral_rate=1.0))
    assert idle_parts(limits | {"integral"}, stated) == frozenset()
