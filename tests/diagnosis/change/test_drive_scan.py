"""What is compared of drives: sizes that mean the same in each of them."""

from dataclasses import replace

import numpy as np

from ddagr_gym.diagnosis.change.drive_fit import change_problem, change_windows, fit_nominal
from ddagr_gym.diagnosis.change.drive_scan import DriveScan, _compared, _of_any_drive, scan_drive
from ddagr_gym.diagnosis.change.ordinary import uncertain_parameters
from ddagr_gym.diagnosis.search.candidates import candidates_of
from ddagr_gym.identification.parameters import robot_parameters
from ddagr_gym.physics.effects import DriveExtent
from ddagr_gym.physics.effects.command_delay import CommandDelay
from ddagr_gym.physics.effects.registry import effect_kinds
from ddagr_gym.presets import get_robot, get_soil
from tests.diagnosis.change.conftest import WEIGHING, drive

USUAL = DriveExtent()
"""A drive like that by which probes are told to be of any: 60 s long, at the very same speeds."""


def compared(name: str) -> list:
    kind = effect_kinds()[name]
    found = [_compared(item, 0, _of_any_drive(kind)) for item in candidates_of(kind, USUAL, 0)]
    return [item for item in found if item is not None]


def test_a_threshold_at_a_share_of_a_drives_speed_is_not_held_against_others():
    (zone,) = compared("command_deadband")
    assert all((probe.loss, probe.turning) == (1.0, 0.0) for probe in zone.candidate.probes)


def test_a_change_at_a_time_of_a_drive_has_no_counterpart():
    (always,) = compared("soil_change")
    assert all(probe.onset < -1e3 for probe in always.candidate.probes)


def test_limits_and_sizes_of_any_drive_are_compared():
    assert len(compared("motor_saturation")) == len(candidates_of(effect_kinds()["motor_saturation"], USUAL, 0))
    for name in ("gyro_bias", "payload", "motor_lag", "multipass", "lateral_bulldozing", "slope"):
        assert len(compared(name)) == len(candidates_of(effect_kinds()[name], USUAL, 0)), name


SOIL = {"soil_strength": 0.05, "soil_stiffness": 0.1, "shear_modulus": 0.1, "exit_angle_ratio": 0.03}
"""Deviations of its parameters."""


def scan_of_late_robot(deviation: float) -> tuple[DriveScan, list[str]]:
    """Of a robot with a dead time of so much scatter between drives [s], and the parameters of its columns."""
    robot, soil = get_robot("ddagr"), get_soil("thesis_a1")
    drivetrain = replace(robot.drivetrain, command_delay=0.12)
    robot = replace(robot, drivetrain=drivetrain, standard_deviations={"command_delay": deviation})
    windows = change_windows([drive(1, "command_delay=0.11", seconds=40.0)], robot, WEIGHING)
    parameters = uncertain_parameters(soil, robot_parameters(robot), SOIL, WEIGHING, 1, ())
    problem = change_problem(robot, soil, windows, parameters, WEIGHING, 1)
    scan = scan_drive(problem, fit_nominal(problem))
    return scan, [parameters[k].name for k in scan.free]


def by_bank(scan: DriveScan, parameters: list[str]) -> np.ndarray:
    """(3, W, K) inner products of the columns of a later command of both banks, the right and the left one."""
    probes = [probe for item in scan.compared for probe in item.candidate.probes]
    late = {probe.imbalance: k for k, probe in enumerate(probes) if isinstance(probe, CommandDelay)}
    first = 1 + len(parameters)
    return np.stack([scan.products.normals[:, first + late[side]] for side in (0.0, 1.0, -1.0)])


def test_a_later_command_and_the_robots_dead_time_are_one_quantity():
    scan, parameters = scan_of_late_robot(0.06)
    both, right, left = by_bank(scan, parameters)
    own = scan.products.normals[:, 1 + parameters.index("command_delay")]
    np.testing.assert_allclose(both, CommandDelay.parameter("delay").metadata["step"] * own, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(right + left, 2.0 * both, rtol=1e-9, atol=1e-9)
    assert np.abs(right - left).max() > 0.1 * np.abs(both).max()


def test_a_later_command_has_columns_of_its_own_where_the_robots_dead_time_is_known():
    scan, parameters = scan_of_late_robot(0.0)
    assert "command_delay" not in parameters
    assert by_bank(scan, parameters)[0].any(axis=-1).all()
