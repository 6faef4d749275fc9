"""What named effects mean for one who drives: a robot, a slope, maps of readings and commands that can be undone.

Nothing is written down a second time: the effects' own actions are called on a row of the simulator, and what they do
to a robot at rest, to a reading and to a command is read off. What has a memory (a deadband, a held reading) or depends
on the motion (a lever arm) is no such map and is left to the feed-forward that the corrected simulator teaches.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.parameters import STANDARD_GRAVITY, Robot
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.base import Action
from ddagr_gym.physics.effects.linear_action import acted_on, linear_part

Array = NDArray[np.float64]

_PERIOD = 0.008
_MOVING = 0.3  # of motion and memory that a map must not depend on (ours)
_TOLERANCE = 1e-9
_LEAST_DETERMINANT = 1e-3  # of a map that is undone


@dataclass(frozen=True, eq=False)
class LinearMap:
    """values -> matrix values + offset."""

    matrix: Array
    offset: Array

    @classmethod
    def identity(cls, size: int) -> LinearMap:
        """Changes nothing."""
        return cls(np.eye(size), np.zeros(size))

    def undo(self, values: Array) -> Array:
        """What was mapped to ``values`` (..., size)."""
        return np.asarray(np.linalg.solve(self.matrix, (values - self.offset).T).T)

    def after(self, other: LinearMap) -> LinearMap:
        """This map of what ``other`` gives."""
        return LinearMap(self.matrix @ other.matrix, self.matrix @ other.offset + self.offset)


@dataclass(frozen=True, eq=False)
class KnownPhysics:
    """A robot on its ground, as far as a controller and its filter can use it.

    Attributes:
        robot: with mass, inertia and motor rate as the effects leave them.
        radius_factors: outer radius of the wheels of a bank over the robot's mean, right and left [-].
        gradient: of the ground, world x and y [-].
        readings: from what the sensors would read to what they do read, specific force x and y, yaw rate, encoders.
        commands: from the command that is sent to what the motors get, right and left.
        delay: between a command and the motors, right and left [s].
        drags: effects that hold the robot back by its motion.
        used: names of effects of which something is here.
    """

    robot: Robot
    radius_factors: tuple[float, float]
    gradient: tuple[float, float]
    readings: LinearMap
    commands: LinearMap
    delay: tuple[float, float]
    drags: tuple[Effect, ...]
    used: tuple[str, ...]

    def gravity(self, yaw: float) -> tuple[float, float]:
        """Its pull along body x and y [m/s^2] at a heading in the world [rad]."""
        x, y = self.gradient
        level = math.sqrt(1.0 + x * x + y * y)
        along = math.cos(yaw) * x + math.sin(yaw) * y
        across = -math.sin(yaw) * x + math.cos(yaw) * y
        return -STANDARD_GRAVITY * along / level, -STANDARD_GRAVITY * across / level

    def drag(self, v_x: float, v_y: float, yaw_rate: float) -> tuple[float, float, float]:
        """What holds the robot back: force per mass along body x and y [m/s^2], moment over yaw inertia [rad/s^2]."""
        if not self.drags:
            return 0.0, 0.0, 0.0
        row = _row(self.robot)
        row[layout.V_X : layout.V_X + 3] = [v_x, v_y, yaw_rate]
        for action, effect in _actions(self.drags, layout.POINT_BODY_FORCES):
            action(row, effect.vector(), np.zeros(layout.EFFECT_MEMORY))
        force_x, force_y, moment = row[layout.BODY_FORCE : layout.BODY_FORCE + 3].tolist()
        return force_x / self.robot.mass, force_y / self.robot.mass, moment / self.robot.yaw_inertia


def known_physics(robot: Robot, effects: Sequence[Effect] = ()) -> KnownPhysics:
    """What ``effects`` mean for a robot that lacks them."""
    row = _row(robot)
    before = row.copy()
    for point in (layout.POINT_LOADS, layout.POINT_MOTORS):
        for action, effect in _actions(effects, point):
            action(row, effect.vector(), np.zeros(layout.EFFECT_MEMORY))
    radii = row[layout.WHEEL : layout.WHEEL + 4] + row[layout.WHEEL + 8 : layout.WHEEL + 12]
    readings, in_readings = _map(effects, layout.POINT_READINGS, layout.READING, 5)
    commands, in_commands = _map(effects, layout.POINT_COMMANDS, layout.COMMAND, 2)
    drags = tuple(item for item in effects if any(True for _ in _actions((item,), layout.POINT_BODY_FORCES)))
    delay, late = _delay(robot, effects)
    loads = [item.name for item in effects if _changes(item, robot)]
    used = {*in_readings, *in_commands, *late, *loads, *(item.name for item in drags)}
    rate = float(np.mean(row[layout.MOTOR_RATE : layout.MOTOR_RATE + 2]) / np.mean(before[layout.MOTOR_RATE]))
    return KnownPhysics(
        robot=replace(
            robot,
            mass=float(row[layout.MASS]),
            yaw_inertia=float(row[layout.YAW_INERTIA]),
            motor_rate=robot.motor_rate * rate,
        ),
        radius_factors=(
            float(np.mean(radii[[0, 2]]) / robot.outer_radius),
            float(np.mean(radii[[1, 3]]) / robot.outer_radius),
        ),
        gradient=(float(row[layout.SLOPE]), float(row[layout.SLOPE + 1])),
        readings=readings,
        commands=commands,
        delay=delay,
        drags=drags,
        used=tuple(item.name for item in effects if item.name in used),
    )


def _actions(effects: Sequence[Effect], point: int) -> list[tuple[Action, Effect]]:
    return [(action, effect) for effect in effects for at, action in effect.acting if at == point]


def _row(robot: Robot) -> Array:
    """A row of the simulator with the robot at rest on level ground."""
    row = np.zeros(layout.SIZE)
    row[layout.SAMPLE_PERIOD] = _PERIOD
    row[layout.GRAVITY + 2] = -STANDARD_GRAVITY
    row[layout.ACCELEROMETER_SCALE : layout.ACCELEROMETER_SCALE + 2] = 1.0
    row[layout.GYRO_SCALE] = 1.0
    row[layout.MOTOR_RATE : layout.MOTOR_RATE + 2] = robot.motor_rate
    row[layout.MOTOR_TARGET : layout.MOTOR_TARGET + 2] = 1.0
    row[layout.MASS], row[layout.YAW_INERTIA] = robot.mass, robot.yaw_inertia
    row[layout.CENTRE_OF_MASS : layout.CENTRE_OF_MASS + 3] = robot.centre_of_mass
    wheels = [(wheel.minor_radius, wheel.half_width, wheel.major_radius) for wheel in robot.wheels]
    row[layout.WHEEL : layout.WHEEL + 12] = np.array(wheels).T.ravel()
    row[layout.HALF_WHEELBASE], row[layout.HALF_TRACK] = robot.half_wheelbase, robot.half_track
    return row


def _changes(effect: Effect, robot: Robot) -> bool:
    """Whether loads or motors of a robot at rest are others with the effect."""
    row = _row(robot)
    before = row.copy()
    for point in (layout.POINT_LOADS, layout.POINT_MOTORS):
        for action, _ in _actions((effect,), point):
            action(row, effect.vector(), np.zeros(layout.EFFECT_MEMORY))
    kept = [layout.MASS, layout.YAW_INERTIA, layout.SLOPE, layout.SLOPE + 1, layout.MOTOR_RATE]
    kept += list(range(layout.WHEEL, layout.WHEEL + 12))
    return bool(np.abs(row[kept] - before[kept]).max() > _TOLERANCE)


def _map(effects: Sequence[Effect], point: int, place: int, size: int) -> tuple[LinearMap, list[str]]:
    """Map of the effects that are one at a point, in their order, and their names."""
    found, names = LinearMap.identity(size), []
    for action, effect in _actions(effects, point):
        own = _linear(action, effect, place, size)
        if own is not None:
            found = own.after(found)
            names.append(effect.name)
    return found, names


def _linear(action: Action, effect: Effect, place: int, size: int) -> LinearMap | None:
    """An action as a map of ``size`` entries from ``place`` on; None where it is none that can be undone."""
    found = linear_part(action, effect, place, size)
    matrix, offset = found.matrix, found.offset
    if found.remembers or abs(np.linalg.det(matrix)) < _LEAST_DETERMINANT:
        return None
    tried = np.linspace(-0.7, 1.1, size)
    moving, _ = acted_on(action, effect, place, tried, _MOVING)
    is_linear = np.abs(moving - (matrix @ tried + offset)).max() <= _TOLERANCE
    changes = np.abs(matrix - np.eye(size)).max() > _TOLERANCE or np.abs(offset).max() > _TOLERANCE
    return LinearMap(matrix, offset) if is_linear and changes else None


def _delay(robot: Robot, effects: Sequence[Effect]) -> tuple[tuple[float, float], list[str]]:
    """Dead time of both banks [s], and the names of the effects behind it."""
    from ddagr_gym.physics.effects.command_delay import CommandDelay

    found, names = np.full(2, robot.drivetrain.command_delay), []
    for effect in effects:
        if isinstance(effect, CommandDelay):
            found = found + effect.delay * np.array([1.0 + effect.imbalance, 1.0 - effect.imbalance])
            names.append(effect.name)
    return (float(found[0]), float(found[1])), names
