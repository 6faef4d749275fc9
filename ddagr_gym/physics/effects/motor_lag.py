"""Motors that answer more slowly than the nominal first-order loop."""

import math
from dataclasses import dataclass

from ddagr_gym.jit import kernel
from ddagr_gym.physics.drivetrain import lagged_mean, mean_and_turning
from ddagr_gym.physics.effects.base import Action, DriveExtent, Effect, Vector, shape, size
from ddagr_gym.physics.layout import MOTOR_RATE, MOTOR_TARGET, OMEGA, POINT_MOTORS, SAMPLE_PERIOD

_FASTEST = 0.05  # of the nominal time constant: a negative lag cannot make the loop faster than 20 times
_STARTED = 2  # entry of the memory behind the two banks'
_TURNING_STARTED = 1  # the same behind the lagged turning
_STARTING = 0.1  # of the wanted change counts as the way in which a bank turns, so that it has one at rest, ours
_SLOW = 0.02  # [rad/s], ours: speeding up or slowing down, made differentiable
_PROBED = ((0.0, 1.0), (1.0, 1.0), (0.0, 0.0), (0.0, 1.0, 1.0))  # second pole, slowing, turning: corners that differ


@kernel(inline=True)
def speeding_up(speed: float, target: float) -> float:
    """1 where a bank is to start or to turn faster the way it turns, 0 where slower or the other way."""
    change = target - speed
    way = speed + _STARTING * change
    faster = change * way / math.sqrt(way * way + _SLOW * _SLOW)
    return 0.5 + 0.5 * faster / math.sqrt(faster * faster + _SLOW * _SLOW)


def slow_motors(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Split the lag ``parameters[0]`` between both loops' time constants and, by ``parameters[1]``, a filter before.

    While a bank slows down only ``parameters[2]`` of the lag holds.

    Over a sample the loop aims at the mean of the filter's answer to the held command, so that a filter shorter than
    a sample still counts in proportion to its length.
    """
    for bank in range(2):
        faster = speeding_up(row[OMEGA + bank], row[MOTOR_TARGET + bank])
        lag = parameters[0] * (parameters[2] + (1.0 - parameters[2]) * faster)
        second = parameters[1] * max(lag, 0.0)
        row[MOTOR_RATE + bank] /= max(1.0 + (lag - second) * row[MOTOR_RATE + bank], _FASTEST)
        if memory[_STARTED] == 0.0:
            # before the first sample the motors are taken to have settled
            memory[bank] = row[OMEGA + bank]
        if second > 0.0:
            command = row[MOTOR_TARGET + bank]
            mean, end = lagged_mean(memory[bank] - command, second, row[SAMPLE_PERIOD])
            row[MOTOR_TARGET + bank] = command + mean
            memory[bank] = command + end
        else:
            memory[bank] = row[MOTOR_TARGET + bank]
    memory[_STARTED] = 1.0


def slow_turning(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Filter half the difference of both banks' targets by ``parameters[0]``; their mean goes through as it is."""
    mean, turning = mean_and_turning(row, MOTOR_TARGET)
    if memory[_TURNING_STARTED] == 0.0:
        memory[0] = 0.5 * (row[OMEGA] - row[OMEGA + 1])
    if parameters[0] > 0.0:
        late, end = lagged_mean(memory[0] - turning, parameters[0], row[SAMPLE_PERIOD])
        row[MOTOR_TARGET] = mean + turning + late
        row[MOTOR_TARGET + 1] = mean - turning - late
        memory[0] = turning + end
    else:
        memory[0] = turning
    memory[_TURNING_STARTED] = 1.0


@dataclass(frozen=True)
class MotorLag(Effect):
    """Later answer of the bank speed loops: a longer time constant, a second pole, or some of both.

    Motors at the limit of their current may be late while they speed up only. A drive controller that takes a speed and
    a turn may shape the turn alone.

    Attributes:
        lag: added to the time by which the speed trails a ramp of commands, which is 1/motor_rate of the nominal loop;
            least: a quarter of the 0.22 s of the thesis's simulated motors.
        second_pole: share of the lag that a second pole takes (a current loop, a filter of the commands); 0 leaves one
            pole. A negative lag quickens the only one.
        slowing: share of the lag that holds while a bank slows down, where soil and friction help; 1 for both alike.
        turning: 1 where a filter of this lag shapes the difference of both banks' commands alone, 0 for the banks.
    """

    name = "motor_lag"
    title = "Motor lag"
    group = "commands and motors"
    equation = (
        "(1/motor_rate + (1 - second_pole) lag) d omega/dt = target - omega; second_pole lag d target/dt = command - "
        "target; slowing lag in place of lag while |omega| falls; with turning lag d delta/dt = (command_right - "
        "command_left)/2 - delta"
    )
    source = (
        "thesis (4.11), whose k_omega is 4.5 1/s simulated and 1.4 1/s measured; two lags in series as of armature and "
        "rotor (Astrom and Murray, Feedback Systems)"
    )
    signature = "bank speeds approach a new command late and round its corner, or a higher one; none at steady speed"
    confused_with = ("command_delay", "motor_saturation")
    actions = ((POINT_MOTORS, slow_motors), (POINT_MOTORS, slow_turning))

    lag: float = size("s", -0.05, 5.0, least=0.05)
    second_pole: float = shape("-", 0.0, 1.0, default=0.0, step=0.1)
    slowing: float = shape("-", 0.0, 1.0, default=1.0, step=-0.1)
    turning: float = shape("-", 0.0, 1.0, default=0.0, step=1.0)

    @property
    def acting(self) -> tuple[tuple[int, Action], ...]:
        """The filter of the turning, or the loops."""
        return self.actions[1:] if self.turning > 0.0 else self.actions[:1]

    @property
    def idle_shapes(self) -> frozenset[str]:
        """The loops' where the turning alone is late."""
        return frozenset({"second_pole", "slowing"}) if self.turning > 0.0 else frozenset()

    @classmethod
    def probes(cls, extent: DriveExtent) -> tuple[Effect, ...]:
        """A slower loop, a second pole, a loop that is slower while it speeds up only, and a late turning."""
        step = cls.parameter("lag").metadata["step"]
        return tuple(cls(step, *shapes) for shapes in _PROBED)
