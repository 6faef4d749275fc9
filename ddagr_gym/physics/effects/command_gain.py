"""Speed loops that reach a share of the commanded speed."""

from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.layout import COMMAND, POINT_COMMANDS


def scale_commands(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Multiply the commanded bank speeds, right and left."""
    for bank in range(2):
        row[COMMAND + bank] *= parameters[bank]


@dataclass(frozen=True)
class CommandGain(Effect):
    """Factors on the commanded bank speeds, as of a motor controller whose speed calibration is off or worn.

    The speed by command of a real robot is seldom that of its data sheet, for many reasons. So drives from before have
    to say what is usual: a diagnosis against a data sheet does not look for this effect by itself. Beside a whole
    drivetrain it is fitted where one bank settles at another share of its commands than the other.

    Attributes:
        right: least: 3 percent, a tenth of a row's width in a turn.
        left: least: the same.
    """

    name = "command_gain"
    title = "Command gain"
    group = "commands and motors"
    equation = "(right command_right, left command_left)"
    source = "gain of a motor controller from set point to speed (Astrom and Murray, Feedback Systems)"
    signature = "bank speeds settle at the same share of every command, whatever the load"
    confused_with = ("command_deadband", "encoder_scale", "motor_droop")
    needs_earlier_drives = True
    actions = ((POINT_COMMANDS, scale_commands),)

    right: float = size("-", 0.2, 5.0, least=0.03, neutral=1.0)
    left: float = size("-", 0.2, 5.0, least=0.03, default=1.0, neutral=1.0)
