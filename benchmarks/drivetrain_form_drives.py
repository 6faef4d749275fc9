"""Simulated drives of the thesis's robot with one more part of a drivetrain, on a soil of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.fitted_values import with_values
from ddagr_gym.parameters import Drivetrain, Imu, PoseReceiver, Robot, Sensors, Soil, WheelEncoder
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import simulate

Array = NDArray[np.float64]

ROBOT, SOIL = "ddagr", "thesis_a1"
RATE = 50.0
"""Of the recordings [Hz], as of the null bank's drives."""
DRIVES, SECONDS = 1, 60.0
STRENGTH_SPREAD, STIFFNESS_SPREAD = 0.1, 0.25
"""Deviations of the logarithms by which true soils differ from the nominal one."""

LOADED = {"integral_rate": 10.0, "load_compliance": 1.0 / 60.0}
"""A loop that the ground resists: back at its command in 0.45 s, with 60 kg m^2 seen at the wheels."""


@dataclass(frozen=True)
class Part:
    """A part of the robot that the simulator under diagnosis lacks.

    Attributes:
        robot: fields of the true robot's drivetrain.
        nominal: fields of the nominal robot's.
        names: of the library that say it.
    """

    robot: Mapping[str, float]
    nominal: Mapping[str, float] = field(default_factory=dict)
    names: tuple[str, ...] = ("motor_saturation",)


PARTS: Mapping[str, Part] = {
    "limit of the turning": Part({"turning_limit": 0.3}),
    "ramp of the commands": Part({"command_ramp": 0.5}),
    "integral part under load": Part({"integral_rate": 3.0, "load_compliance": 0.009}, names=("motor_droop",)),
    "torque limit": Part({**LOADED, "acceleration_limit": 0.6}, LOADED),
    "power limit": Part({**LOADED, "power_limit": 0.25}, LOADED),
    "torque limit and load": Part({**LOADED, "acceleration_limit": 0.6}, names=("motor_droop", "motor_saturation")),
}


def robot_with(parts: Mapping[str, float]) -> Robot:
    """The thesis's robot with parts of a drivetrain."""
    return replace(get_robot(ROBOT), drivetrain=Drivetrain(**parts))


def true_soil(rng: np.random.Generator) -> Soil:
    """A soil beside the nominal one."""
    away = {"soil_strength": rng.normal(0.0, STRENGTH_SPREAD), "soil_stiffness": rng.normal(0.0, STIFFNESS_SPREAD)}
    return with_values(get_robot(ROBOT), get_soil(SOIL), away)[1]


def commands(rng: np.random.Generator) -> Array:
    """(T, 2) bank speed commands, each held for 2 to 5 s: straight on, arcs, on the spot and stops [rad/s]."""
    rows: list[Array] = [np.zeros(2)] * int(RATE)
    while len(rows) < SECONDS * RATE:
        mean, turning = rng.choice([-1.0, 1.0, 1.0]) * rng.uniform(0.2, 0.8), rng.choice([-1.0, 1.0])
        kinds = ((mean, 0.0), (mean, turning * rng.uniform(0.1, 0.5)), (0.0, turning * rng.uniform(0.2, 0.5)), (0, 0))
        middle, half = kinds[rng.choice(4, p=(0.3, 0.4, 0.2, 0.1))]
        rows += [np.array([middle + half, middle - half])] * int(rng.uniform(2.0, 5.0) * RATE)
    return np.array(rows[: int(SECONDS * RATE)])


def drives_of(part: Part, seed: int) -> list[Recording]:
    """Recordings of a robot with the part, all on one soil.

    Args:
        part: of the robot.
        seed: of soil, commands and noise.
    """
    rng = np.random.default_rng(seed)
    robot, soil = robot_with(part.robot), true_soil(rng)
    sensors = Sensors(Imu(sample_rate=RATE), WheelEncoder(), PoseReceiver(5.0))
    made = []
    for number in range(DRIVES):
        columns = simulate(robot, soil, commands(rng), sensors=sensors, seed=100 * seed + number)
        made.append(Recording.from_columns(columns, get_robot(ROBOT), source=f"drive_{number}"))
    return made
