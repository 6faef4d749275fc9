"""Dead time between the command and the motors."""

from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, size
from ddagr_gym.physics.layout import COMMAND, OMEGA, POINT_COMMANDS, SAMPLE_PERIOD

_DEPTH = 64  # samples kept: 0.5 s at 125 Hz
_CURSOR = 2 * _DEPTH
_FILLED = _CURSOR + 1


def delay_command(row, parameters, memory):  # type: ignore[no-untyped-def]
    if memory[_FILLED] == 0.0:
        # before the first sample the commands are taken to have equalled the bank speeds
        for k in range(_DEPTH):
            memory[2 * k] = row[OMEGA]
            memory[2 * k + 1] = row[OMEGA + 1]
        memory[_FILLED] = 1.0
    cursor = int(memory[_CURSOR])
    memory[2 * cursor] = row[COMMAND]
    memory[2 * cursor + 1] = row[COMMAND + 1]
    samples = min(parameters[0] / row[SAMPLE_PERIOD], _DEPTH - 2.0)
    whole = int(samples)
    part = samples - whole
    newer = (cursor - whole) % _DEPTH
    older = (cursor - whole - 1) % _DEPTH
    for bank in range(2):
        row[COMMAND + bank] = (1.0 - part) * memory[2 * newer + bank] + part * memory[2 * older + bank]
    memory[_CURSOR] = (cursor + 1) % _DEPTH


@dataclass(frozen=True)
class CommandDelay(Effect):
    """The motors receive the command of ``delay`` seconds ago, interpolated between samples."""

    name = "command_delay"
    title = "Command delay"
    equation = "command(t) -> command(t - delay)"
    source = "diagnosis vocabulary"
    signature = "bank speeds follow commands late by a constant time, then at the usual rate"
    confused_with = ("motor_lag",)
    actions = ((POINT_COMMANDS, delay_command),)

    delay: float = size("s", 0.0, 0.49, least=0.02)
