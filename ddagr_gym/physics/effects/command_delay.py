"""Dead time between the command and the motors.

It acts on what ramps and limits have made of the commands: a shift in time may come before or after them, but of a ramp
that a step of the command sets off between two samples only the sample is left, so that all dead times between two
samples would be one.
"""

from dataclasses import dataclass

from ddagr_gym.physics.drivetrain import delay_targets
from ddagr_gym.physics.effects.base import DriveExtent, Effect, Vector, shape, size
from ddagr_gym.physics.layout import POINT_SET_POINTS

_LONGEST = 0.49  # [s]
_NODES = 64  # every sample at 125 Hz and below


def delay_set_points(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Set points of ``parameters[0]`` seconds ago, ``parameters[1]`` of it more on the right and less on the left."""
    right, left = parameters[0] * (1.0 + parameters[1]), parameters[0] * (1.0 - parameters[1])
    delay_targets(row, memory, _NODES, _LONGEST, right, left)


@dataclass(frozen=True)
class CommandDelay(Effect):
    """The motors receive the command of some time ago, interpolated between samples.

    Attributes:
        delay: mean of the banks; least: half a period of a usual 25 Hz control loop.
        imbalance: share of the mean by which the right bank's is longer and the left one's shorter: 1 where only the
            right motor controller is late, -1 where only the left one is.
    """

    name = "command_delay"
    title = "Command delay"
    group = "commands and motors"
    equation = "command(t) -> command(t - delay (1 +- imbalance)), + on the right"
    source = "dead time, as of a transport lag (Astrom and Murray, Feedback Systems)"
    signature = "bank speeds follow commands late by a constant time, then at the usual rate"
    confused_with = ("motor_lag", "motor_saturation", "sensor_hold")
    actions = ((POINT_SET_POINTS, delay_set_points),)

    delay: float = size("s", 0.0, _LONGEST, least=0.02, step=0.008)
    imbalance: float = shape("-", -1.0, 1.0, default=0.0, step=0.05)

    @classmethod
    def probes(cls, extent: DriveExtent) -> tuple[Effect, ...]:
        """A short delay of both banks, of the right one and of the left one."""
        step = cls.parameter("delay").metadata["step"]
        return tuple(cls(step, imbalance) for imbalance in (0.0, 1.0, -1.0))
