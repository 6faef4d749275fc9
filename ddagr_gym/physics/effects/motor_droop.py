"""Motors that lose speed under load."""

import math
from dataclasses import dataclass

from ddagr_gym.jit import kernel
from ddagr_gym.physics.effects.base import DriveExtent, Effect, Vector, shape, size
from ddagr_gym.physics.layout import AXLE_TORQUE, MOTOR_RATE, MOTOR_TARGET, OMEGA, POINT_MOTORS, SAMPLE_PERIOD

_FOLLOWING = 0.1  # [s] of rotor and gear, ours: without it the torque of a wheel at rest, where only friction is left
# to set it, and the speed drive each other to and fro from sample to sample
_SLOW = 0.02  # [rad/s] bank speeds about which "alike" changes its sign
_USUAL = 0.7  # [rad/s] of the thesis's row turns, at which power counts as torque
_BEFORE = 5.0  # [s], ours: for so long a bank is taken to have borne its load where a drive or a window begins
_STARTED = 2  # entry of the memory behind the two banks'
_SPEED, _TAKEN_BACK = 3, 5  # entries: speed of either bank's own loop [rad/s], and what its integral part adds


@kernel(inline=True)
def _take_back(row: Vector, bank: int, lost: float, recovery: float, memory: Vector) -> float:
    """Speed that an integral part adds to a bank's target, which has ``lost`` some under load [rad/s].

    It follows the speed that the loop gives by itself, so that commands from before a window count as well.
    """
    target = row[MOTOR_TARGET + bank]
    if memory[_STARTED] == 0.0:
        memory[_SPEED + bank] = row[OMEGA + bank]
        memory[_TAKEN_BACK + bank] = -lost * (1.0 - math.exp(-_BEFORE * recovery))
    aim = target + lost + memory[_TAKEN_BACK + bank]
    after = aim + (memory[_SPEED + bank] - aim) * math.exp(-row[MOTOR_RATE + bank] * row[SAMPLE_PERIOD])
    mean = 0.5 * (memory[_SPEED + bank] + after)
    added = memory[_TAKEN_BACK + bank]
    memory[_TAKEN_BACK + bank] += recovery * row[SAMPLE_PERIOD] * (target - mean)
    memory[_SPEED + bank] = after
    return added


@kernel(inline=True)
def _follow_torques(row: Vector, memory: Vector) -> None:
    """Smooth the banks' axle torques into ``memory[:2]``."""
    share = 1.0 - math.exp(-row[SAMPLE_PERIOD] / _FOLLOWING)
    for bank in range(2):
        torque = row[AXLE_TORQUE + bank] + row[AXLE_TORQUE + 2 + bank]
        if memory[_STARTED] == 0.0:
            memory[bank] = torque
        memory[bank] += share * (torque - memory[bank])


def droop_speed(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Shift each bank's speed by its axle torque, smoothed in ``memory[:2]``; negative torque brakes a driven wheel.

    The share ``parameters[1]`` follows the torque of the other bank, with its sign where the banks turn alike, and the
    share ``parameters[2]`` takes the power of both in place of torque, and a part of the speed in place of an amount.
    At the rate ``parameters[3]`` an integral part takes the shift back.
    """
    _follow_torques(row, memory)
    both = row[OMEGA] * row[OMEGA + 1]
    alike = both / (abs(both) + _SLOW * _SLOW)
    drawn = (memory[0] * row[OMEGA] + memory[1] * row[OMEGA + 1]) / (_USUAL * _USUAL)
    for bank in range(2):
        load = (1.0 - parameters[1]) * memory[bank] + parameters[1] * alike * memory[1 - bank]
        load += parameters[2] * (drawn * row[MOTOR_TARGET + bank] - load)
        lost = parameters[0] * load
        if parameters[3] > 0.0:
            lost += _take_back(row, bank, lost, parameters[3], memory)
        row[MOTOR_TARGET + bank] += lost
    memory[_STARTED] = 1.0


@dataclass(frozen=True)
class MotorDroop(Effect):
    """Bank speed that falls in proportion to the bank's axle torque, as with a speed loop without integral action.

    A bank that the soil drives (downhill, or braked in a turn) runs faster than its command. Where both motors hang on
    one weak battery, the load of either slows both; its voltage falls with the power that they draw, and every speed
    with the voltage in proportion. An integral part takes the loss back in time; it overshoots new commands as well.

    Attributes:
        droop: speed lost per torque; least: 2 percent of 0.7 rad/s under 25 N m.
        shared: share of the torque that is the other bank's: 0 for a weak speed loop, 0.5 for a weak battery.
        power: 0 where torque takes an amount of speed, 1 where the power of both banks takes a share of it, as from a
            weak battery; the droop is then that by the torque of both together at 0.7 rad/s.
        recovery: rate at which an integral part takes the loss back, its gain over that of the speed error; 0 for a
            loss that stays; least: gone after 5 s.
    """

    name = "motor_droop"
    title = "Motor droop"
    group = "commands and motors"
    equation = (
        "omega_target = command + droop ((1 - shared) T + shared T_other), T = T_front + T_rear by the soil "
        "(braking < 0) over 0.1 s, T_other turned to the bank's sense; with power 1 command (1 + droop (T_right "
        "omega_right + T_left omega_left)/(0.7 rad/s)^2); with recovery + z, dz/dt = recovery (command - omega)"
    )
    source = (
        "speed by torque and voltage of a direct-current motor (Krause et al., Analysis of Electric Machinery); "
        "integral action (Astrom and Murray, Feedback Systems); 0.1 s is ours"
    )
    signature = "encoders settle below the command, more in turns and soft places; a locked bank creeps"
    confused_with = ("command_deadband", "command_gain", "encoder_scale", "motor_saturation")
    actions = ((POINT_MOTORS, droop_speed),)

    droop: float = size("rad/(s N m)", 0.0, 0.02, least=5e-4)
    shared: float = shape("-", 0.0, 0.5, default=0.0, step=0.1)
    power: float = shape("-", 0.0, 1.0, default=0.0, step=0.1)
    recovery: float = size("1/s", 0.0, 10.0, least=0.2, default=0.0)

    @classmethod
    def probes(cls, extent: DriveExtent) -> tuple[Effect, ...]:
        """A droop by the bank's own torque, an integral part beside it, and a droop by the power of both banks."""
        step, recovery = (cls.parameter(name).metadata["step"] for name in ("droop", "recovery"))
        return (cls(step), cls(0.0, recovery=recovery), cls(step, 0.5, 1.0))
