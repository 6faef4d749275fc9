"""Motors that answer more slowly than the nominal first-order loop."""

from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.layout import MOTOR_RATE, POINT_MOTORS

_FASTEST = 0.05  # of the nominal time constant: a negative lag cannot make the loop faster than 20 times


def slow_motors(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Lengthen both time constants by ``parameters[0]``."""
    for bank in range(2):
        row[MOTOR_RATE + bank] /= max(1.0 + parameters[0] * row[MOTOR_RATE + bank], _FASTEST)


@dataclass(frozen=True)
class MotorLag(Effect):
    """Longer time constant of the bank speed loops.

    Attributes:
        lag: added to 1/motor_rate; least: a quarter of the 0.22 s of the thesis's simulated motors.
    """

    name = "motor_lag"
    title = "Motor lag"
    group = "commands and motors"
    equation = "d omega/dt = (command - omega)/(1/motor_rate + lag)"
    source = "thesis (4.11), whose k_omega is 4.5 1/s simulated and 1.4 1/s measured"
    signature = "bank speeds approach a new command late and round its corner; none at steady speed"
    confused_with = ("command_delay", "motor_saturation")
    actions = ((POINT_MOTORS, slow_motors),)

    lag: float = size("s", -0.05, 5.0, least=0.05)
