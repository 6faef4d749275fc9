"""Motors that lose speed under load."""

import math
from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.layout import AXLE_TORQUE, MOTOR_TARGET, POINT_MOTORS, SAMPLE_PERIOD

_FOLLOWING = 0.1  # [s] of rotor and gear, ours: without it the torque of a wheel at rest, where only friction is left
# to set it, and the speed drive each other to and fro from sample to sample
_STARTED = 2


def droop_speed(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Shift each bank's speed by its axle torque, smoothed in ``memory[:2]``; negative torque brakes a driven wheel."""
    share = 1.0 - math.exp(-row[SAMPLE_PERIOD] / _FOLLOWING)
    for bank in range(2):
        torque = row[AXLE_TORQUE + bank] + row[AXLE_TORQUE + 2 + bank]
        if memory[_STARTED] == 0.0:
            memory[bank] = torque
        memory[bank] += share * (torque - memory[bank])
        row[MOTOR_TARGET + bank] += parameters[0] * memory[bank]
    memory[_STARTED] = 1.0


@dataclass(frozen=True)
class MotorDroop(Effect):
    """Bank speed that falls in proportion to the bank's axle torque, as with a speed loop without integral action.

    A bank that the soil drives (downhill, or braked in a turn) runs faster than its command.

    Attributes:
        droop: speed lost per torque; least: 2 percent of 0.7 rad/s under 25 N m.
    """

    name = "motor_droop"
    title = "Motor droop"
    group = "commands and motors"
    equation = "omega_target = command + droop (T_front + T_rear), the soil's torques (braking < 0) over 0.1 s"
    source = (
        "speed-torque line of a direct-current motor (Krause et al., Analysis of Electric Machinery); 0.1 s is ours"
    )
    signature = "encoders settle below the command, more in turns and soft places; a locked bank creeps"
    confused_with = ("command_deadband", "encoder_scale", "motor_saturation")
    actions = ((POINT_MOTORS, droop_speed),)

    droop: float = size("rad/(s N m)", 0.0, 0.02, least=5e-4)
