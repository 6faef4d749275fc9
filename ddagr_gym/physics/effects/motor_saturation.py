"""Motors that cannot turn, or cannot speed up, as fast as they are told, and banks that may not differ as much."""

from dataclasses import dataclass
from typing import Any

from ddagr_gym.physics.drivetrain import carry_load, limit_turning
from ddagr_gym.physics.effects.base import DriveExtent, Effect, Vector, size
from ddagr_gym.physics.layout import (
    ACCELERATION_LIMIT,
    DRIVETRAIN,
    LOAD_COMPLIANCE,
    MOTOR_RATE,
    MOTOR_TARGET,
    OMEGA,
    POINT_MOTORS,
    POWER_LIMIT,
)

_NO_SPEED_LIMIT = 1e3  # [rad/s] the most that a robot may have as its maximum wheel speed
_NO_ACCELERATION_LIMIT = 1e6  # [rad/s^2] far beyond any wheel's
NO_TORQUE_LIMIT = 1e6  # [N m] likewise, and of power [W]
_HIGHEST_SPEED_LIMIT = 20.0  # [rad/s] that any of the preset robots would meet
_HIGHEST_ACCELERATION_LIMIT = 200.0  # [rad/s^2], the same
_HIGHEST_TORQUE_LIMIT = 2000.0  # [N m], the same; of power [W]
_LEAST_LIMIT = 0.01  # [rad/s], [rad/s^2], [N m], [W]
_BINDING = 0.95  # of what the drive reaches: limits above it cost less than 5 percent
_PROBED = (0.9, 0.6)  # shares of the fastest that limits are tried at, ours: just binding, and cutting deep
_PROBED_ACCELERATION = (0.9, 0.6, 0.3)  # the greatest is that of a lag's first instant
_PROBED_TORQUE = (0.3, 0.15, 0.08)  # shares of full traction, ours: a turn on the spot takes a fifth on soft soil
_PROBED_POWER = (0.2, 0.1, 0.05)  # shares of full traction at the fastest, ours


def limit_motors(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Clip how the banks' aims differ, the speed that each aims at, the rate of its approach, and what motors give."""
    if abs(row[MOTOR_TARGET] - row[MOTOR_TARGET + 1]) > 2.0 * parameters[2]:
        limit_turning(row, MOTOR_TARGET, parameters[2])
    if parameters[3] < NO_TORQUE_LIMIT or parameters[4] < NO_TORQUE_LIMIT:
        carry_load(row)
        compliance = row[DRIVETRAIN + LOAD_COMPLIANCE]
        row[DRIVETRAIN + ACCELERATION_LIMIT] = min(row[DRIVETRAIN + ACCELERATION_LIMIT], compliance * parameters[3])
        row[DRIVETRAIN + POWER_LIMIT] = min(row[DRIVETRAIN + POWER_LIMIT], compliance * parameters[4])
    for bank in range(2):
        target = min(max(row[MOTOR_TARGET + bank], -parameters[0]), parameters[0])
        reach = parameters[1] / row[MOTOR_RATE + bank]
        if abs(target - row[OMEGA + bank]) > reach:
            target = row[OMEGA + bank] + (reach if target > row[OMEGA + bank] else -reach)
        row[MOTOR_TARGET + bank] = target


def _limit(unit: str, none: float, highest: float, *, step: float, required: bool = False) -> Any:
    """Field of a limit.

    Args:
        unit: SI.
        none: limit that nothing reaches, which is neutral.
        highest: that any of the preset robots would meet.
        step: for finite differences.
        required: whether it must be given.
    """
    default = None if required else none
    return size(unit, _LEAST_LIMIT, none, least=none - highest, default=default, neutral=none, step=step)


@dataclass(frozen=True)
class MotorSaturation(Effect):
    """Limits of bank speed (supply voltage), of its rate of change, of torque and power, and of the commanded turning.

    A drive controller that limits the yaw rate keeps the mean of the banks and lets them differ less. Torque and power
    carry the ground's load as well. In a robot whose banks the ground does not resist they do so up to these limits,
    with the inertia of the robot's mass at the rim.
    A limit that a drive never reaches changes nothing, so there is no derivative at neutral.

    Attributes:
        speed_limit: largest bank speed; least: it cuts 5 percent off a drive's fastest (20 rad/s where none is known).
        acceleration_limit: largest change of bank speed per time; least: the same (200 rad/s^2).
        turning_limit: largest distance of a bank's speed from the mean of both; least: as the speed's.
        torque_limit: largest torque of a bank's motors at its wheels; least: that of full traction.
        power_limit: largest power of a bank's motors at its wheels; least: that of full traction at the fastest.
    """

    name = "motor_saturation"
    title = "Motor saturation"
    group = "commands and motors"
    equation = (
        "|omega_target| <= speed_limit; |d omega/dt| <= acceleration_limit; before these |omega_target - mean of both| "
        "<= turning_limit; torque of a bank's motors <= min(torque_limit, power_limit / omega)"
    )
    source = "actuator saturation and rate limit (Astrom and Murray, Feedback Systems)"
    signature = "encoders stay at a ceiling while commands rise; ramps of constant slope after large steps; wide turns"
    confused_with = ("command_delay", "motor_droop", "motor_lag")
    differentiable = False
    load_sizes = ("torque_limit", "power_limit")
    actions = ((POINT_MOTORS, limit_motors),)

    speed_limit: float = _limit("rad/s", _NO_SPEED_LIMIT, _HIGHEST_SPEED_LIMIT, step=-0.02, required=True)
    acceleration_limit: float = _limit("rad/s^2", _NO_ACCELERATION_LIMIT, _HIGHEST_ACCELERATION_LIMIT, step=-0.05)
    turning_limit: float = _limit("rad/s", _NO_SPEED_LIMIT, _HIGHEST_SPEED_LIMIT, step=-0.02)
    torque_limit: float = _limit("N m", NO_TORQUE_LIMIT, _HIGHEST_TORQUE_LIMIT, step=-0.3)
    power_limit: float = _limit("W", NO_TORQUE_LIMIT, _HIGHEST_TORQUE_LIMIT, step=-0.15)

    def is_meaningful(self, extent: DriveExtent) -> bool:
        """Whether a limit cuts at least 5 percent off what the drive would reach, or is less than full traction."""
        reached = (extent.wheel_speed, extent.wheel_acceleration, extent.turning)
        limits = (self.speed_limit, self.acceleration_limit, self.turning_limit)
        weak = self.torque_limit <= extent.traction or self.power_limit <= extent.traction * extent.wheel_speed
        return weak or any(limit <= _BINDING * most for limit, most in zip(limits, reached, strict=True))

    @classmethod
    def probes(cls, extent: DriveExtent) -> tuple[Effect, ...]:
        """Limits somewhat and well below what the drive reaches, one at a time."""
        slow = [cls(limit) for limit in _below(extent.wheel_speed, _PROBED)]
        late = [cls(_NO_SPEED_LIMIT, limit) for limit in _below(extent.wheel_acceleration, _PROBED_ACCELERATION)]
        wide = [cls(_NO_SPEED_LIMIT, turning_limit=limit) for limit in _below(extent.turning, _PROBED)]
        return (*slow, *late, *wide, *cls._weak(extent))

    @classmethod
    def _weak(cls, extent: DriveExtent) -> tuple[Effect, ...]:
        """Limits of torque and power."""
        torques = _below(extent.traction, _PROBED_TORQUE)
        powers = _below(extent.traction * extent.wheel_speed, _PROBED_POWER)
        return (
            *(cls(_NO_SPEED_LIMIT, torque_limit=limit) for limit in torques),
            *(cls(_NO_SPEED_LIMIT, power_limit=limit) for limit in powers),
        )


def _below(reached: float, shares: tuple[float, ...]) -> list[float]:
    """Limits at shares of what a drive reaches."""
    return [max(share * reached, _LEAST_LIMIT) for share in shares]
