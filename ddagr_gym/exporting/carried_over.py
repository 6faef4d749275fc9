"""What other simulators can take over of a corrected one: numbers with units, each with how it came about."""

from __future__ import annotations

import math
from dataclasses import Field, dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ddagr_gym.exporting.corrected import Simulated
from ddagr_gym.exporting.friction import friction_of_turn
from ddagr_gym.exporting.sensor_faults import sensor_faults
from ddagr_gym.exporting.working_point import (
    LEFT_TURN,
    RATE,
    RIGHT_TURN,
    STRAIGHT,
    SteadyDrives,
    check_commands,
    steady_drives,
)
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.motor_saturation import NO_TORQUE_LIMIT, MotorSaturation

Array = NDArray[np.float64]

NO_LIMIT = 1e6
"""Numbers from here on stand for no limit (:class:`ddagr_gym.parameters.Drivetrain`)."""

_NO_LOSS = 1e-7
"""Below which a loss of speed is rounding [rad/(s N m)]."""

GROUPS = ("robot", "drivetrain", "slip at the working point", "ground", "sensors")


def _quantity(unit: str, group: int, meaning: str, how: str) -> Any:
    return field(metadata={"unit": unit, "group": GROUPS[group], "meaning": meaning, "how": how})


_MEASURED = "steady drives of our simulator"
_STEP = "step of the commands in our simulator"
_FOUND = "robot as corrected"
_FAULT = "effects that were found"


@dataclass(frozen=True)
class CarriedOver:
    """What carries over; the metadata of the fields say unit, group, meaning and origin."""

    mass: float = _quantity("kg", 0, "whole robot, payload included", _FOUND)
    yaw_inertia: float = _quantity("kg m^2", 0, "about the vertical through the centre of mass", _FOUND)
    centre_of_mass_x: float = _quantity("m", 0, "forward of the middle of the wheels", _FOUND)
    centre_of_mass_y: float = _quantity("m", 0, "to the left of it", _FOUND)
    centre_of_mass_height: float = _quantity("m", 0, "above the ground", _FOUND)
    wheelbase: float = _quantity("m", 0, "front to rear axle", _FOUND)
    track: float = _quantity("m", 0, "right to left wheel", _FOUND)
    wheel_radius: float = _quantity("m", 0, "hub to tread, mean of the wheels", _FOUND)
    wheel_width: float = _quantity("m", 0, "of the tyre, mean of the wheels", _FOUND)
    command_delay: float = _quantity("s", 1, "from a command to the first movement", _STEP)
    time_constant: float = _quantity("s", 1, "of the bank speed after the delay, as a first-order lag", _STEP)
    command_gain_right: float = _quantity("-", 1, "steady bank speed over command, straight ahead", _MEASURED)
    command_gain_left: float = _quantity("-", 1, "the same of the left bank", _MEASURED)
    speed_loss: float = _quantity(
        "rad/(s N m)", 1, "bank speed that a bank loses per axle torque, beyond that of straight travel", _MEASURED
    )
    speed_limit: float = _quantity("rad/s", 1, "largest bank speed command that is followed", _FOUND)
    acceleration_limit: float = _quantity("rad/s^2", 1, "of an unloaded bank; none where it is infinite", _FOUND)
    torque_limit: float = _quantity("N m", 1, "of a bank at its wheels; none where it is infinite", _FOUND)
    bank_inertia: float = _quantity("kg m^2", 1, "of a bank, seen at its wheels; 0 where it is not known", _FOUND)
    rolling_radius: float = _quantity("m", 2, "speed over mean bank speed, straight ahead", _MEASURED)
    effective_track: float = _quantity(
        "m", 2, "rolling radius times difference of bank speeds over yaw rate", _MEASURED
    )
    commanded_track: float = _quantity(
        "m", 2, "the same by the commands: with the speed that banks lose in the turn", _MEASURED
    )
    force_along: float = _quantity("-", 2, "sum of |F_x| over the load, in the turn", _MEASURED)
    force_across: float = _quantity("-", 2, "sum of |F_y| over the load, in the turn", _MEASURED)
    friction_along: float = _quantity(
        "-", 2, "sliding friction along rigid wheels that turn as fast", "balance of forces"
    )
    friction_across: float = _quantity("-", 2, "the same across the wheels", "balance of forces")
    slope_angle: float = _quantity("rad", 3, "inclination of the ground", _FAULT)
    slope_direction: float = _quantity("rad", 3, "of steepest ascent, from the world's x axis", _FAULT)
    gyro_scale: float = _quantity("-", 4, "yaw rate reading over truth", _FAULT)
    gyro_bias: float = _quantity("rad/s", 4, "added to the yaw rate", _FAULT)
    accelerometer_bias_x: float = _quantity("m/s^2", 4, "added to the specific force, forward", _FAULT)
    accelerometer_bias_y: float = _quantity("m/s^2", 4, "to the left", _FAULT)
    imu_roll: float = _quantity("rad", 4, "of the sensor in the robot, left side up positive", _FAULT)
    imu_pitch: float = _quantity("rad", 4, "nose down positive", _FAULT)
    imu_yaw: float = _quantity("rad", 4, "counter-clockwise positive", _FAULT)
    imu_x: float = _quantity("m", 4, "position of the sensor, forward", _FAULT)
    imu_y: float = _quantity("m", 4, "to the left", _FAULT)
    encoder_scale_right: float = _quantity("-", 4, "reading over truth", _FAULT)
    encoder_scale_left: float = _quantity("-", 4, "reading over truth", _FAULT)
    pose_latency: float = _quantity("s", 4, "by which positions come late", _FAULT)
    gyro_noise: float = _quantity("rad/s", 4, "standard deviation of a sample at 125 Hz", "sensor's data sheet")
    accelerometer_noise: float = _quantity("m/s^2", 4, "the same of the accelerometer", "sensor's data sheet")

    @property
    def slides_alike(self) -> bool:
        """Whether a friction was found with which rigid wheels turn as fast."""
        return math.isfinite(self.friction_along) and math.isfinite(self.friction_across)


def quantities() -> tuple[Field[Any], ...]:
    """Fields of :class:`CarriedOver`; ``metadata`` holds unit, group, meaning and how."""
    return fields(CarriedOver)


def carried_over(simulated: Simulated, speed: float) -> tuple[CarriedOver, SteadyDrives]:
    """Numbers that carry over, and the drives that they and comparisons come from.

    Args:
        simulated: corrected simulator.
        speed: mean bank speed of the working point [rad/s].
    """
    drives = steady_drives(simulated, check_commands(speed))
    return measured(simulated, drives), drives


def measured(simulated: Simulated, drives: SteadyDrives) -> CarriedOver:
    """Numbers from steady drives, of which the first three are those of the working point."""
    robot = simulated.robot
    mass, inertia, x, y, height = drives.body[STRAIGHT]
    delay, constant = first_order(drives.speeds.mean(axis=1), RATE)
    gain = drives.omega[STRAIGHT] / drives.commands[STRAIGHT]
    radius = float(drives.v_x[STRAIGHT] / drives.omega[STRAIGHT].mean())
    turns = [LEFT_TURN, RIGHT_TURN]
    load = drives.load[turns].sum()
    along, across = (float(np.abs(force[turns]).sum() / load) for force in (drives.force_x, drives.force_y))
    friction = _friction(simulated, drives, radius, along)
    return CarriedOver(
        mass=float(mass), yaw_inertia=float(inertia),
        centre_of_mass_x=float(x), centre_of_mass_y=float(y), centre_of_mass_height=float(height),
        wheelbase=2.0 * robot.half_wheelbase, track=2.0 * robot.half_track, wheel_radius=robot.outer_radius,
        wheel_width=2.0 * math.fsum(wheel.half_width for wheel in robot.wheels) / len(robot.wheels),
        command_delay=delay, time_constant=constant,
        command_gain_right=float(gain[0]), command_gain_left=float(gain[1]),
        speed_loss=speed_loss(drives),
        **_limits(simulated),
        rolling_radius=radius, effective_track=turn_track(drives, drives.omega, radius),
        commanded_track=turn_track(drives, gain * drives.commands, radius),
        force_along=along, force_across=across, friction_along=friction[0], friction_across=friction[1],
        **_slope(simulated.effects), **vars(sensor_faults(simulated.effects)),
    )  # fmt: skip


def turn_track(drives: SteadyDrives, speeds: Array, radius: float) -> float:
    """Track of a robot without slip that turns as fast [m], mean of the working point's two turns.

    ``B = R (omega_right - omega_left) / yaw rate``.

    Args:
        drives: steady ones.
        speeds: (K, 2) bank speeds, or commands times their gain [rad/s].
        radius: rolling radius R [m].
    """
    turns = [LEFT_TURN, RIGHT_TURN]
    difference = speeds[turns, 0] - speeds[turns, 1]
    return float(np.mean(radius * difference / drives.yaw_rate[turns]))


def speed_loss(drives: SteadyDrives) -> float:
    """Bank speed lost per axle torque [rad/(s N m)], by least squares over both banks of the working point's turns."""
    gain = drives.omega[STRAIGHT] / drives.commands[STRAIGHT]
    turns = [LEFT_TURN, RIGHT_TURN]
    lost = drives.omega[turns] - gain * drives.commands[turns]
    torque = drives.torque[:, :2] + drives.torque[:, 2:]
    beyond = torque[turns] - torque[STRAIGHT]
    found = float((beyond * lost).sum() / (beyond**2).sum())
    return found if found > _NO_LOSS else 0.0


def first_order(speeds: Array, rate: float) -> tuple[float, float]:
    """Dead time and time constant [s] of a step response, by least squares.

    Args:
        speeds: (T,) from rest, which settle [rad/s].
        rate: samples per second [Hz].
    """
    time = np.arange(1.0, len(speeds) + 1.0) / rate
    relative = speeds / speeds[-1]
    half = float(time[np.argmax(relative >= 0.5)])
    first = float(time[np.argmax(relative >= 0.05)])

    def residuals(unknown: Array) -> Array:
        after = np.maximum(time - unknown[0], 0.0)
        return np.asarray(1.0 - np.exp(-after / unknown[1]) - relative)

    start = [max(first - 1.0 / rate, 0.0), max(half - first, 1.0 / rate)]
    solved = least_squares(residuals, start, bounds=([0.0, 0.1 / rate], [time[-1], time[-1]]), diff_step=1e-4)
    return float(solved.x[0]), float(solved.x[1])


def _friction(simulated: Simulated, drives: SteadyDrives, radius: float, along: float) -> tuple[float, float]:
    """Mean of the frictions for both turns of the working point; NaN where one of them has none."""
    robot = simulated.robot
    x, y = np.array(robot.wheel_x) - drives.body[STRAIGHT, 2], np.array(robot.wheel_y) - drives.body[STRAIGHT, 3]
    pairs = [
        friction_of_turn(x, y, drives.load[k], radius * drives.omega[k, [0, 1, 0, 1]], drives.yaw_rate[k], along)
        for k in (LEFT_TURN, RIGHT_TURN)
    ]
    first, second = np.mean(pairs, axis=0)
    return float(first), float(second)


def _limits(simulated: Simulated) -> dict[str, float]:
    """Limits of speed, acceleration and torque, and inertia of a bank."""
    drivetrain = simulated.robot.drivetrain
    speed, acceleration = simulated.robot.maximum_wheel_speed, drivetrain.acceleration_limit
    compliance, torque = drivetrain.load_compliance, math.inf
    for effect in simulated.effects:
        if isinstance(effect, MotorSaturation):
            speed, acceleration = min(speed, effect.speed_limit), min(acceleration, effect.acceleration_limit)
            torque = effect.torque_limit if effect.torque_limit < NO_TORQUE_LIMIT else torque
    if compliance > 0.0:
        torque = min(torque, acceleration / compliance) if acceleration < NO_LIMIT else torque
        acceleration = min(acceleration, compliance * torque)
    return {
        "speed_limit": speed,
        "acceleration_limit": acceleration if acceleration < NO_LIMIT else math.inf,
        "torque_limit": torque,
        "bank_inertia": 1.0 / compliance if compliance > 0.0 else 0.0,
    }


def _slope(effects: tuple[Effect, ...]) -> dict[str, float]:
    found = next((vars(effect) for effect in effects if effect.name == "slope"), {"angle": 0.0, "direction": 0.0})
    return {"slope_angle": found["angle"], "slope_direction": found["direction"]}
