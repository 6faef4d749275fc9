"""Dead time between the command and the motors."""

from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.effects.history import fill_node, push, recall, ring_is_empty, ring_stride
from ddagr_gym.physics.layout import COMMAND, OMEGA, POINT_COMMANDS, SAMPLE_PERIOD

_LONGEST = 0.49  # [s]
_NODES = 64  # every sample at 125 Hz and below


def delay_command(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Commands of ``parameters[0]`` seconds ago."""
    period = row[SAMPLE_PERIOD]
    stride = ring_stride(_LONGEST, period, _NODES)
    if ring_is_empty(memory, 2, _NODES):
        # before the first sample the commands are taken to have equalled the bank speeds
        for k in range(1, _NODES):
            for bank in range(2):
                fill_node(memory, 2, _NODES, k, stride, bank, row[OMEGA + bank])
    push(memory, 2, _NODES, stride, row[COMMAND : COMMAND + 2])
    for bank in range(2):
        row[COMMAND + bank] = recall(memory, 2, _NODES, stride, bank, parameters[0] / period, row[COMMAND + bank])


@dataclass(frozen=True)
class CommandDelay(Effect):
    """The motors receive the command of some time ago, interpolated between samples.

    Attributes:
        delay: least: half a period of a usual 25 Hz control loop.
    """

    name = "command_delay"
    title = "Command delay"
    group = "commands and motors"
    equation = "command(t) -> command(t - delay)"
    source = "dead time, as of a transport lag (Astrom and Murray, Feedback Systems)"
    signature = "bank speeds follow commands late by a constant time, then at the usual rate"
    confused_with = ("motor_lag", "sensor_hold")
    actions = ((POINT_COMMANDS, delay_command),)

    delay: float = size("s", 0.0, _LONGEST, least=0.02, step=0.008)
