"""Encoders with the wrong number of counts or the wrong gear ratio."""

from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Action, Effect, Vector, shape, size
from ddagr_gym.physics.layout import COMMAND, POINT_COMMANDS, POINT_READINGS, READING


def slow_down(row: Vector, parameters: Vector, memory: Vector) -> None:
    """What a speed loop makes of a command that believes encoders scaled by ``parameters[:2]``."""
    for bank in range(2):
        row[COMMAND + bank] /= 1.0 + parameters[2] * (parameters[bank] - 1.0)


def scale_encoders(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Multiply the bank speeds that are read, right and left."""
    row[READING + 3] *= parameters[0]
    row[READING + 4] *= parameters[1]


@dataclass(frozen=True)
class EncoderScale(Effect):
    """Factors on the bank speeds that are read; a speed loop that reads the same encoders turns the wheels too slowly.

    Attributes:
        right: least: 1 percent, 10 cm in a 10 m row.
        left: least: the same.
        loop: 1 where the speed loop reads these encoders, so that they agree with the command and the wheels do not,
            0 where it has others.
    """

    name = "encoder_scale"
    title = "Encoder scale"
    group = "sensors"
    equation = "(right omega_right, left omega_left) readings; commands over the same factors where loop is 1"
    source = "systematic odometry errors (Borenstein and Feng, IEEE Trans. Robotics and Automation 12 (1996) 869)"
    signature = "bank speed wrong by the same share at every speed; the robot itself moves as it should, or (loop) not"
    confused_with = ("command_gain", "gyro_scale", "motor_droop", "soil_change", "wheel_radius_mismatch")
    actions = ((POINT_COMMANDS, slow_down), (POINT_READINGS, scale_encoders))

    right: float = size("-", 0.1, 10.0, least=0.01, neutral=1.0)
    left: float = size("-", 0.1, 10.0, least=0.01, default=1.0, neutral=1.0)
    loop: float = shape("-", 0.0, 1.0, default=0.0, step=1.0)

    @property
    def acting(self) -> tuple[tuple[int, Action], ...]:
        """Readings alone where the loop has encoders of its own: the robot then moves as without the effect."""
        return self.actions if self.loop > 0.0 else self.actions[1:]
