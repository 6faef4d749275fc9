"""Ordinary drives of a simulated robot, and a robot that is known from them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ddagr_gym
from benchmarks import simulated_robots
from benchmarks.simulated_robots import RATE, stronger
from ddagr_gym.diagnosis.change.ordinary import OrdinaryRobot
from ddagr_gym.diagnosis.change.reference import OrdinaryDrive, scan_ordinary
from ddagr_gym.diagnosis.change.weighing import Weighing
from ddagr_gym.identification.parameters import robot_parameters
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording

PICTURES = (
    "Shift of every effect over its limit", "Size of every effect before and after", "Losses of forecasts",
    "Size of each named effect against time", "Parameters of robot and ground",
)  # fmt: skip
"""Beginnings of what the pictures of a page with a name show."""

STRENGTH = 0.05
"""Deviation of the logarithm of the soil's strength between drives."""

MOTOR_RATE = 0.03
"""The same of the motor rate."""

WEIGHING = Weighing(
    window=4.0,
    history=0.6,
    lateness=0.0,
    gyro_scale=1.0,
    # noise of the simulated sensors
    sigma=np.array([0.03, 0.03, 0.002, 0.012, 0.012, 0.012, 0.012, 0.008]),
    robust=np.full(8, 2.0),
    gyro_bias=3e-4,
    accelerometer_bias=0.02,
)


def steps(seed: int, seconds: float) -> np.ndarray:
    """(T, 2) bank speed commands, each held for 2 to 4 s [rad/s]."""
    return simulated_robots.steps(seed, seconds, 4.0)


def drive(seed: int, *effects: str, seconds: float = 50.0) -> Recording:
    """A drive of the robot on another day: soil and motors differ a little, and what effects say."""
    rng = np.random.default_rng(1000 + seed)
    robot = get_robot("ddagr")
    robot = replace(robot, motor_rate=robot.motor_rate * float(np.exp(MOTOR_RATE * rng.normal())))
    soil = stronger(get_soil("thesis_a1"), float(np.exp(STRENGTH * rng.normal())))
    made = ddagr_gym.simulate(steps(seed, seconds), robot, soil, effects, rate=RATE, pose_rate=5.0, seed=seed)
    return made.recording.with_meta(source=f"drive_{seed}.csv")


@pytest.fixture(scope="session")
def ordinary_robot() -> OrdinaryRobot:
    """The robot as three ordinary drives show it."""
    robot, soil = get_robot("ddagr"), get_soil("thesis_a1")
    robot = replace(robot, standard_deviations={"motor_rate": MOTOR_RATE * robot.motor_rate})
    deviations = {
        "soil_strength": STRENGTH, "soil_stiffness": 0.1, "shear_modulus": 0.1, "exit_angle_ratio": 0.03,
    }  # fmt: skip
    parameters = robot_parameters(robot)
    references = tuple(
        scan_ordinary(
            OrdinaryDrive(f"drive_{seed}.csv", "field", False, drive(seed), robot, soil, parameters, deviations),
            WEIGHING,
        )
        for seed in (1, 2, 3)
    )
    return OrdinaryRobot(
        robot, {"field": soil}, parameters, {"field": deviations}, WEIGHING, references, "calibration", "0"
    )
