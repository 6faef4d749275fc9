"""Commands that get lost near zero."""

import math
from dataclasses import dataclass

from ddagr_gym.jit import kernel
from ddagr_gym.physics.drivetrain import mean_and_turning
from ddagr_gym.physics.effects.base import Action, DriveExtent, Effect, Vector, shape, size
from ddagr_gym.physics.layout import COMMAND, OMEGA, POINT_COMMANDS

_STARTED = 2  # entry of the memory behind the two banks'
_USUAL = 0.12  # share of the fastest command that a threshold for small ones is tried at, ours
_EDGE = 0.1  # share of the band over which a command that passes whole sets in, ours


@kernel(inline=True)
def what_passes(command: float, speed: float, parameters: Vector, memory: Vector, which: int) -> float:
    """What a dead zone lets through of a command; ``memory[which]`` says which way it moves, at first by ``speed``."""
    width = parameters[0]
    if memory[_STARTED] == 0.0:
        memory[which] = math.copysign(1.0, speed) if abs(speed) > 0.5 * parameters[2] * width else 0.0
    edge = width * (parameters[2] if memory[which] * command > 0.0 else 1.0)
    inside = min(max((abs(command) / edge - 1.0 + _EDGE) / _EDGE, 0.0), 1.0)
    passing = inside * inside * (3.0 - 2.0 * inside)
    memory[which] = math.copysign(1.0, command) if abs(command) > edge else 0.0
    return math.copysign(passing * max(abs(command) - parameters[1] * width, 0.0), command)


def lose_small_commands(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Dead zone of half width ``parameters[0]``; ``parameters[1]`` of it is lost beyond as well.

    A bank that moves stops below the share ``parameters[2]`` of the width; ``memory[:2]`` says which way each moves.
    """
    if parameters[0] <= 0.0:
        return
    for bank in range(2):
        row[COMMAND + bank] = what_passes(row[COMMAND + bank], row[OMEGA + bank], parameters, memory, bank)
    memory[_STARTED] = 1.0


def lose_small_turns(row: Vector, parameters: Vector, memory: Vector) -> None:
    """The same of half the difference of both banks' commands; their mean goes through as it is."""
    if parameters[0] <= 0.0:
        return
    mean, wanted = mean_and_turning(row, COMMAND)
    turned = 0.5 * (row[OMEGA] - row[OMEGA + 1])
    turning = what_passes(wanted, turned, parameters, memory, 0)
    row[COMMAND], row[COMMAND + 1] = mean + turning, mean - turning
    memory[_STARTED] = 1.0


@dataclass(frozen=True)
class CommandDeadband(Effect):
    """Small commands have no effect, and larger ones lose the same amount (a dead zone) or nothing (a threshold).

    A drive controller that takes a speed and a turn may overlook small turns alone.

    Attributes:
        width: half width of the dead zone; least: 3 percent of the 0.7 rad/s of a row turn.
        loss: share of the width that commands beyond it lose: 1 for friction, 0 for a driver's threshold.
        release: share of the width below which a bank that moves stops; less than 1 where breaking loose takes more.
            It shows with a loss below 1 only: else nothing is left of commands below the width.
        turning: 1 where half the difference of both banks' commands goes through the dead zone, 0 for each bank's.
    """

    name = "command_deadband"
    title = "Command deadband"
    group = "commands and motors"
    equation = "command -> 0 where |command| < width (moving: release width), else command - loss width sgn(command)"
    source = "dead zone (Tao and Kokotovic, IEEE Trans. Automatic Control 39 (1994) 59)"
    signature = "encoders miss a constant amount of every command, all of a small one"
    confused_with = ("command_gain", "motor_droop")
    actions = ((POINT_COMMANDS, lose_small_commands), (POINT_COMMANDS, lose_small_turns))

    width: float = size("rad/s", 0.0, 1.0, least=0.02)
    loss: float = shape("-", 0.0, 1.0, default=1.0, step=-0.05)
    release: float = shape("-", 0.1, 1.0, default=1.0, step=-0.1)
    turning: float = shape("-", 0.0, 1.0, default=0.0, step=1.0)

    @property
    def acting(self) -> tuple[tuple[int, Action], ...]:
        """On the turning, or on each bank."""
        return self.actions[1:] if self.turning > 0.0 else self.actions[:1]

    @classmethod
    def probes(cls, extent: DriveExtent) -> tuple[Effect, ...]:
        """A narrow dead zone, and thresholds that show where commands come near them: plain, sticking, of turns."""
        width = cls.parameter("width").metadata
        # of drives that never turn too, whose scans are held against others
        shares = (_USUAL * fastest for fastest in (extent.wheel_speed, extent.turning))
        wide, turn = (min(max(share, width["least"]), 0.5 * width["high"]) for share in shares)
        return (
            cls(cls.parameter("width").metadata["step"]),
            cls(wide, 0.0),
            cls(wide, 0.0, 0.5),
            cls(turn, 0.0, turning=1.0),
        )
