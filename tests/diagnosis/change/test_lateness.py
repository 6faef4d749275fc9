"""Dead time and slow motors of a robot whose commands pass a ramp, which can take much of either over."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ddagr_gym
from ddagr_gym.diagnosis.change.ordinary import OrdinaryRobot
from ddagr_gym.diagnosis.change.reference import OrdinaryDrive, scan_ordinary
from ddagr_gym.diagnosis.change.run import what_changed
from ddagr_gym.identification.parameters import robot_parameters
from ddagr_gym.parameters import Robot
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording
from tests.diagnosis.change.conftest import RATE, WEIGHING, steps

RAMP = 2.0
"""Of the commands [rad/s^2]; between drives it differs by 5 %."""

SOIL = {"soil_strength": 0.05, "soil_stiffness": 0.1, "shear_modulus": 0.1, "exit_angle_ratio": 0.03}


def ramped(ramp: float) -> Robot:
    robot = get_robot("ddagr")
    return replace(robot, drivetrain=replace(robot.drivetrain, command_ramp=ramp))


def drive(seed: int, *effects: str) -> Recording:
    ramp = RAMP * float(np.exp(0.05 * np.random.default_rng(1000 + seed).normal()))
    soil = get_soil("thesis_a1")
    made = ddagr_gym.simulate(steps(seed, 50.0), ramped(ramp), soil, effects, rate=RATE, pose_rate=5.0, seed=seed)
    return made.recording.with_meta(source=f"drive_{seed}.csv")


@pytest.fixture(scope="module")
def ramped_robot() -> OrdinaryRobot:
    robot, soil = ramped(RAMP), get_soil("thesis_a1")
    robot = replace(robot, standard_deviations={"motor_rate": 0.1 * robot.motor_rate, "command_ramp": 0.3 * RAMP})
    known = robot_parameters(robot)
    references = tuple(
        scan_ordinary(
            OrdinaryDrive(f"drive_{seed}.csv", "field", False, drive(seed), robot, soil, known, SOIL), WEIGHING
        )
        for seed in (1, 2, 3)
    )
    return OrdinaryRobot(robot, {"field": soil}, known, {"field": SOIL}, WEIGHING, references, "calibration", "0")


@pytest.mark.slow
@pytest.mark.parametrize("seed", [41, 42])
@pytest.mark.parametrize(
    ("effect", "name", "field"),
    [("command_delay=0.3", "command_delay", "delay"), ("motor_lag=0.3", "motor_lag", "lag")],
)
def test_lateness_is_named_by_its_kind(ramped_robot, seed, effect, name, field):
    diagnosis = what_changed([drive(seed, effect)], ramped_robot, "field").diagnosis
    assert diagnosis.verdict == (name,)
    low, high = diagnosis.findings[0].parameters[field].interval
    assert low <= 0.3 <= high
