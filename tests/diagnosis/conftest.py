"""Short simulated drives and the problem that they make."""

from collections.abc import Callable

import numpy as np
import pytest

from ddagr_gym.diagnosis.problem import Problem
from ddagr_gym.diagnosis.setting import Setting, make_problem
from ddagr_gym.parameters import Imu, PoseReceiver, Sensors, WheelEncoder
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import simulate

RATE = 50.0


def commands(seconds: float) -> np.ndarray:
    """Starts, arcs to both sides, a stop and a spin, 4 s each."""
    steps = [(0.7, 0.7), (0.9, 0.4), (0.0, 0.0), (0.4, 0.9), (-0.5, 0.5), (1.0, 1.0)]
    pieces = [np.tile(step, (int(4.0 * RATE), 1)) for step in steps]
    return np.concatenate(pieces)[: int(seconds * RATE)]


@pytest.fixture(scope="session")
def drive() -> Callable[..., Recording]:
    """Function (effects, seconds, seed) -> recording of the thesis's robot and soil with all sensors and noise."""

    def make(effects: tuple[str, ...] = (), seconds: float = 24.0, seed: int = 1) -> Recording:
        robot = get_robot("ddagr")
        sensors = Sensors(Imu(sample_rate=RATE), WheelEncoder(), PoseReceiver(5.0))
        columns = simulate(robot, get_soil("thesis_a1"), commands(seconds), sensors=sensors, effects=effects, seed=seed)
        return Recording.from_columns(columns, robot)

    return make


@pytest.fixture(scope="session")
def problem_of() -> Callable[..., Problem]:
    """Function (recordings) -> problem with windows of 2 s."""

    def make(*recordings: Recording) -> Problem:
        return make_problem(get_robot("ddagr"), get_soil("thesis_a1"), recordings, Setting())

    return make
