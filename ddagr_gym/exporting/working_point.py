"""Steady drives of our simulator: what it does at given bank commands, on level ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError, at_least
from ddagr_gym.exporting.corrected import Simulated
from ddagr_gym.parameters import Sensors
from ddagr_gym.physics import layout
from ddagr_gym.simulator import Simulator

Array = NDArray[np.float64]

RATE = 125.0
"""Samples per second [Hz]."""

SETTLING = 6.0
"""Time from rest until a drive counts as steady [s]."""

AVERAGED = 2.0
"""Time over which a steady drive is averaged [s]."""

SHARE_OF_SPEED = 0.3
"""Of the largest bank speed that the robot follows: mean bank speed of the working point, where none is asked for."""

LEFT_OUT = {
    "slope": "written as the direction of gravity or a number of its own; the working point is on level ground",
    "soil_patch": "is at a place; the working point is on the ground beside it",
}
"""Effects without which the steady drives run, and why."""

CHECKS = (
    ("straight", 1.0, 1.0),
    ("left turn (working point)", 0.5, 1.5),
    ("right turn (working point)", 1.5, 0.5),
    ("wide left arc", 0.8, 1.2),
    ("tight left arc", 0.1, 1.9),
    ("turn on the spot", -0.5, 0.5),
    ("slow left turn", 0.25, 0.75),
    ("fast wide left arc", 1.6, 2.0),
)
"""Name, and left and right bank commands over the working point's mean bank speed, of the drives that are compared."""

STRAIGHT, LEFT_TURN, RIGHT_TURN = 0, 1, 2
"""Places of the working point's drives in :data:`CHECKS`."""

_RECORDED = {
    "v_x": (layout.V_X, 1),
    "v_y": (layout.V_Y, 1),
    "yaw_rate": (layout.YAW_RATE, 1),
    "omega": (layout.OMEGA, 2),
    "load": (layout.LOAD, 4),
    "force_x": (layout.FORCE_X, 4),
    "force_y": (layout.FORCE_Y, 4),
    "torque": (layout.AXLE_TORQUE, 4),
    "body": (layout.MASS, 5),
    "position": (layout.X, 2),
}


@dataclass(frozen=True, eq=False)
class SteadyDrives:
    """Means over the last stretch of K drives; banks are (right, left), wheels in the order of the package.

    Attributes:
        commands: (K, 2) bank speed commands [rad/s].
        v_x: (K,) of the body origin [m/s].
        v_y: (K,) [m/s].
        yaw_rate: (K,) [rad/s].
        omega: (K, 2) bank speeds [rad/s].
        load: (K, 4) [N].
        force_x: (K, 4) of the soil on the wheels [N].
        force_y: (K, 4) [N].
        torque: (K, 4) of the soil about the hubs, negative where it brakes a driven wheel [N m].
        body: (K, 5) mass, yaw inertia, centre of mass x, y, height, with what effects do to them.
        speeds: (T, 2) bank speeds of the first drive from rest [rad/s].
        paths: (K, T, 2) positions of the body origin, from rest at the world's origin [m].
    """

    commands: Array
    v_x: Array
    v_y: Array
    yaw_rate: Array
    omega: Array
    load: Array
    force_x: Array
    force_y: Array
    torque: Array
    body: Array
    speeds: Array
    paths: Array


def working_speed(simulated: Simulated, speed: float | None) -> float:
    """Mean bank speed of the working point [rad/s].

    Args:
        simulated: for its wheels and limits.
        speed: rim speed that is asked for [m/s]; a share of the largest one where it is None.

    Raises:
        InputError: a speed that is not positive or beyond what the motors follow in the drives that are compared.
    """
    robot = simulated.robot
    if speed is None:
        return SHARE_OF_SPEED * robot.maximum_wheel_speed
    at_least(speed=(speed, 1e-3))
    fastest = robot.maximum_wheel_speed * robot.outer_radius / max(right for _, _, right in CHECKS)
    if speed > fastest:
        raise InputError(f"speed is {speed:g} m/s: give at most {fastest:.2g} m/s, half of what {robot.name} can do.")
    return speed / robot.outer_radius


def check_commands(speed: float) -> Array:
    """(K, 2) right and left bank commands of :data:`CHECKS` [rad/s] at a mean bank speed [rad/s]."""
    return speed * np.array([(right, left) for _, left, right in CHECKS])


def steady_drives(simulated: Simulated, commands: Array) -> SteadyDrives:
    """Drive from rest at constant commands, side by side.

    Args:
        simulated: robot, soil and effects; those of :data:`LEFT_OUT` are left out.
        commands: (K, 2) right and left [rad/s].
    """
    effects = tuple(effect for effect in simulated.effects if effect.name not in LEFT_OUT)
    simulator = Simulator(len(commands), effects=effects)
    for k in range(len(commands)):
        simulator.configure(k, simulated.robot, simulated.soil, Sensors())
    simulator.reset()
    entries = [first + k for first, count in _RECORDED.values() for k in range(count)]
    _, record = simulator.step(commands, recorded=entries, samples=round(RATE * (SETTLING + AVERAGED)))
    traces, start = {}, 0
    for name, (_, count) in _RECORDED.items():
        traces[name] = record[:, :, start] if count == 1 else record[:, :, start : start + count]
        start += count
    paths = traces.pop("position")
    means = {name: trace[:, -round(RATE * AVERAGED) :].mean(axis=1) for name, trace in traces.items()}
    return SteadyDrives(commands, **means, speeds=traces["omega"][0], paths=paths)
