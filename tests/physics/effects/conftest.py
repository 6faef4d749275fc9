"""What the tests of the effect library share: an ideal robot, gentle and rough drives, single calls of actions."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.parameters import Imu, PoseReceiver, Sensors, WheelEncoder
from ddagr_gym.physics import layout
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.simulator import Simulator, simulate

IDEAL = Sensors(
    imu=Imu(accelerometer_noise=0.0, gyro_noise=0.0, accelerometer_resolution=0.0, gyro_resolution=0.0),
    encoder=WheelEncoder(counts_per_revolution=0.0),
    pose=PoseReceiver(rate=10.0, position_noise=0.0, yaw_noise=0.0),
)


@pytest.fixture(scope="session")
def robot():
    return get_robot("ddagr")


@pytest.fixture(scope="session")
def soil():
    return get_soil("thesis_a1")


@pytest.fixture(scope="session")
def ideal_sensors():
    """Sensors without noise and quantisation, with a 10 Hz pose."""
    return IDEAL


@pytest.fixture(scope="session")
def drive(robot, soil):
    """drive(effects, commands, **options) of the DDAGR in Table A.1 soil with ideal sensors."""

    def run(effects, commands, **options):
        options = {"sensors": IDEAL} | options
        soils = options.pop("soil", soil)
        return simulate(robot, soils, commands, effects=effects, **options)

    return run


@pytest.fixture(scope="session")
def turning_row(robot, soil):
    """Row of the DDAGR in a turn, forces evaluated."""
    simulator = Simulator(1)
    simulator.configure(0, robot, soil, IDEAL)
    simulator.reset(state={"v_x": 0.15, "yaw_rate": 0.1, "omega_right": 0.8, "omega_left": 0.4})
    simulator.step(np.array([[0.8, 0.4]]), samples=60)
    return simulator.rows[0].copy()


@pytest.fixture
def act():
    """act(effect, row, memory=None): the row after the effect's actions; the given row is not changed."""

    def run(effect, row, memory=None):
        changed = row.copy()
        for _, action in sorted(effect.acting, key=lambda item: item[0]):
            action(changed, effect.vector(), np.zeros(layout.EFFECT_MEMORY) if memory is None else memory)
        return changed

    return run


@pytest.fixture(scope="session")
def straight(robot):
    """straight(speed, samples): commands (samples, 2), and the motion of a robot that drives so already."""

    def build(speed, samples=300):
        state = {"v_x": 0.99 * robot.wheels[0].outer_radius * speed, "omega_right": speed, "omega_left": speed}
        return np.full((samples, 2), speed), state

    return build
