"""A robot on a ground is what the drives on it tell, as far as they are few and say little drawn to all of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.calibration.drive_scatter import DriveEstimates, DriveInformation
from ddagr_gym.calibration.robots_on_grounds import GroundModel, ground_model
from ddagr_gym.diagnosis.change.robot_on_ground import RobotOnGround
from ddagr_gym.identification.parameters import robot_parameters
from ddagr_gym.presets import get_robot

NAMES = ("command_delay", "integral_rate", "viscous_rate")
WITHIN, BETWEEN = np.array([0.01, 0.2, 0.05]), np.array([0.09, 0.6, 0.02])


def information(rng: np.random.Generator, deviations: np.ndarray) -> DriveInformation:
    """Of a drive with these deviations from the joint values, by correlated readings of them."""
    root = rng.normal(size=(3, 5)) * 20.0
    inner = root @ root.T
    return DriveInformation(inner, inner @ deviations)


def test_the_robot_on_a_ground_is_the_mean_of_the_normal_distribution_given_its_drives():
    rng = np.random.default_rng(0)
    drives = [information(rng, rng.normal(size=3)) for _ in range(2)]
    found = GroundModel(NAMES, WITHIN, BETWEEN, np.full(3, 1e-4), 0.1).on(drives)
    # unknown: the ground's deviation and the drives' own ones, with their priors
    one, whole = np.eye(3), np.zeros((9, 9))
    right = np.zeros(9)
    whole[:3, :3] = np.diag(1.0 / BETWEEN)
    for k, drive in enumerate(drives):
        rows = slice(3 + 3 * k, 6 + 3 * k)
        whole[rows, rows] = np.diag(1.0 / WITHIN)
        share = np.zeros((3, 9))
        share[:, :3], share[:, rows] = one, one
        whole += share.T @ drive.information @ share
        right += share.T @ drive.gradient
    covariance = np.linalg.inv(whole)
    np.testing.assert_allclose([found.changes[name] for name in NAMES], (covariance @ right)[:3], rtol=1e-8)
    variance = np.diag(covariance)[:3] + WITHIN + 1e-4
    np.testing.assert_allclose([found.deviations[name] for name in NAMES], np.sqrt(variance), rtol=1e-8)


def test_changes_count_from_the_values_that_are_given():
    rng = np.random.default_rng(1)
    away = np.array([0.05, -0.3, 0.1])
    drives = [information(rng, away + 0.01 * rng.normal(size=3)) for _ in range(3)]
    model = GroundModel(NAMES, 1e-8 * WITHIN, BETWEEN, np.zeros(3), 0.1)
    found = model.on(drives, dict(zip(NAMES, away, strict=True)))
    assert max(abs(value) for value in found.changes.values()) < 0.03
    np.testing.assert_allclose(list(model.on(drives).changes.values()), away, atol=0.03)


def test_without_a_drive_on_the_ground_nothing_changes_and_all_may():
    found = GroundModel(NAMES, WITHIN, BETWEEN, np.zeros(3), 0.1).on([])
    assert set(found.changes.values()) == {0.0}
    np.testing.assert_allclose(list(found.deviations.values()), np.sqrt(WITHIN + BETWEEN))


def estimates(share: float, grounds: list[str], seed: int = 0, parameters: int = 12) -> DriveEstimates:
    """Of drives whose parameters vary by 1, with this share of the variance on one ground."""
    rng = np.random.default_rng(seed)
    names = tuple(f"p{k}" for k in range(parameters))
    known = sorted(set(grounds))
    values = {}
    for name in names:
        of_ground = dict(zip(known, rng.normal(0.0, np.sqrt(1.0 - share), len(known)), strict=True))
        own = rng.normal(0.0, np.sqrt(share + 0.01), len(grounds))
        values[name] = np.array([of_ground[ground] for ground in grounds]) + own
    return DriveEstimates(values, {name: np.full(len(grounds), 0.01) for name in names}, names, ())


MANY = [ground for ground in "abcdefgh" for _ in range(3)]


@pytest.mark.parametrize("share", [0.1, 0.5, 1.0])
def test_the_share_that_is_left_on_one_ground_is_found(share):
    found = ground_model(estimates(share, MANY), MANY, dict.fromkeys([f"p{k}" for k in range(12)], 0.0))
    assert found.share == pytest.approx(share, abs=0.12)
    assert np.median(found.within) == pytest.approx(share, rel=0.35)


def test_on_a_single_ground_drives_differ_as_much_as_they_do_whatever_the_share():
    grounds = ["a"] * 8
    found = ground_model(estimates(1.0, grounds), grounds, dict.fromkeys([f"p{k}" for k in range(12)], 0.0))
    assert np.median(found.within) == pytest.approx(1.0, rel=0.35)


@pytest.mark.parametrize(("grounds", "of_whole"), [(["a", "b"], 0.51), (["a", "a"], 1.0)])
def test_two_drives_tell_a_scatter_and_no_share(grounds, of_whole):
    given = replace(estimates(1.0, ["a", "b"], parameters=1), of_robot=("p0",))
    found = ground_model(given, grounds, {"p0": 0.0})
    x = given.values["p0"]
    assert found.share == pytest.approx(0.51)
    assert found.within == pytest.approx([of_whole * (0.5 * (x[0] - x[1]) ** 2 - 0.01)], rel=0.05)


def test_a_parameter_that_one_drive_tells_has_no_scatter():
    given = estimates(0.5, ["a", "a", "b"], parameters=2)
    given.values["p1"][1:] = np.nan
    found = ground_model(given, ["a", "a", "b"], {"p0": 0.0, "p1": 0.3})
    assert (found.within[1], found.between[1]) == (0.0, 0.0)
    assert found.on([]).deviations["p1"] == pytest.approx(0.3)


def test_no_delay_is_less_than_nothing_and_no_ground_is_less_known_than_any():
    drivetrain = replace(get_robot("ddagr").drivetrain, command_delay=0.2)
    robot = replace(
        get_robot("ddagr"), drivetrain=drivetrain, standard_deviations={"command_delay": 0.1, "motor_rate": 1.0}
    )
    anywhere = tuple(replace(p, prior=0.1) for p in robot_parameters(robot))
    there = RobotOnGround({"command_delay": -0.3, "motor_rate": 0.1}, {"command_delay": 0.02, "motor_rate": 0.5})
    assert there.robot(robot).drivetrain.command_delay == 0.0
    assert there.robot(robot).motor_rate == pytest.approx(robot.motor_rate * np.exp(0.1))
    priors = {p.name: p.prior for p in there.parameters(robot, anywhere)}
    assert priors == {"command_delay": 0.02, "motor_rate": 0.1}
    assert RobotOnGround().robot(robot) is robot
    assert RobotOnGround().parameters(robot, anywhere) == anywhere
