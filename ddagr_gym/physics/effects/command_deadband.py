"""Commands that get lost near zero."""

import math
from dataclasses import dataclass

from ddagr_gym.physics.effects.base import DriveExtent, Effect, Vector, shape, size
from ddagr_gym.physics.layout import COMMAND, OMEGA, POINT_COMMANDS

_STARTED = 2  # entry of the memory behind the two banks'
_USUAL = 0.12  # share of the fastest command that a threshold for small ones is tried at, ours
_EDGE = 0.1  # share of the band over which a command that passes whole sets in, ours


def lose_small_commands(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Dead zone of half width ``parameters[0]``; ``parameters[1]`` of it is lost beyond as well.

    A bank that moves stops below the share ``parameters[2]`` of the width; ``memory[:2]`` says which way each moves.
    """
    width = parameters[0]
    if width <= 0.0:
        return
    for bank in range(2):
        command = row[COMMAND + bank]
        if memory[_STARTED] == 0.0:
            speed = row[OMEGA + bank]
            memory[bank] = math.copysign(1.0, speed) if abs(speed) > 0.5 * parameters[2] * width else 0.0
        edge = width * (parameters[2] if memory[bank] * command > 0.0 else 1.0)
        inside = min(max((abs(command) / edge - 1.0 + _EDGE) / _EDGE, 0.0), 1.0)
        passing = inside * inside * (3.0 - 2.0 * inside)
        memory[bank] = math.copysign(1.0, command) if abs(command) > edge else 0.0
        row[COMMAND + bank] = math.copysign(passing * max(abs(command) - parameters[1] * width, 0.0), command)
    memory[_STARTED] = 1.0


@dataclass(frozen=True)
class CommandDeadband(Effect):
    """Small commands have no effect, and larger ones lose the same amount (a dead zone) or nothing (a threshold).

    Attributes:
        width: half width of the dead zone; least: 3 percent of the 0.7 rad/s of a row turn.
        loss: share of the width that commands beyond it lose: 1 for friction, 0 for a driver's threshold.
        release: share of the width below which a bank that moves stops; less than 1 where breaking loose takes more.
            It shows with a loss below 1 only: else nothing is left of commands below the width.
    """

    name = "command_deadband"
    title = "Command deadband"
    group = "commands and motors"
    equation = "command -> 0 where |command| < width (moving: release width), else command - loss width sgn(command)"
    source = "dead zone (Tao and Kokotovic, IEEE Trans. Automatic Control 39 (1994) 59)"
    signature = "encoders miss a constant amount of every command, all of a small one"
    confused_with = ("command_gain", "motor_droop")
    actions = ((POINT_COMMANDS, lose_small_commands),)

    width: float = size("rad/s", 0.0, 1.0, least=0.02)
    loss: float = shape("-", 0.0, 1.0, default=1.0, step=-0.05)
    release: float = shape("-", 0.1, 1.0, default=1.0, step=-0.1)

    @classmethod
    def probes(cls, extent: DriveExtent) -> tuple[Effect, ...]:
        """A narrow dead zone, and thresholds that show where commands come near them, without and with sticking."""
        wide = min(_USUAL * extent.wheel_speed, 0.5 * cls.parameter("width").metadata["high"])
        return (cls(cls.parameter("width").metadata["step"]), cls(wide, 0.0), cls(wide, 0.0, 0.5))
