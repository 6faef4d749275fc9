"""Wheels that dig themselves in while they slip or skid."""

import math
from dataclasses import dataclass

from ddagr_gym.physics.body_dynamics import set_kinematics
from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.layout import (
    OMEGA,
    POINT_SOIL,
    SAMPLE_PERIOD,
    SLIP_RATIO,
    SOIL,
    SOIL_EXPONENT,
    WHEEL,
    WHEEL_V_X,
)

_CORNER = 0.02  # of slip: |slip| made differentiable, ours
_DIGGING_LENGTH = 0.1  # [m] of rim or ground passed until the sinkage has followed the slip to 63 percent, ours
_STARTED = 4  # entry of the memory behind the four wheels'


def dig_in(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Raise each wheel's sinkage exponent by ``parameters[0]`` |slip|; ``memory[:4]`` is the slip that has dug."""
    set_kinematics(row)
    for i in range(4):
        slip = min(max(row[SLIP_RATIO + i], -1.0), 1.0)
        if memory[_STARTED] == 0.0:
            memory[i] = slip
        rim = (row[WHEEL + i] + row[WHEEL + 8 + i]) * row[OMEGA + i % 2]
        passed = max(abs(rim), abs(row[WHEEL_V_X + i])) * row[SAMPLE_PERIOD]
        memory[i] += (1.0 - math.exp(-passed / _DIGGING_LENGTH)) * (slip - memory[i])
        size_of_slip = math.sqrt(memory[i] * memory[i] + _CORNER * _CORNER) - _CORNER
        row[SOIL + 9 * i + SOIL_EXPONENT] += parameters[0] * size_of_slip
    memory[_STARTED] = 1.0


@dataclass(frozen=True)
class SlipSinkage(Effect):
    """Sinkage exponent that grows with slip and skid, behind them by a short way of digging.

    Slip beyond +-1 (counter-rotation) counts as 1.

    Attributes:
        growth: of the exponent from slip 0 to 1; least: 0.1, a tenth more sinkage at slip 0.3.
    """

    name = "slip_sinkage"
    title = "Slip and skid sinkage"
    group = "ground"
    equation = "n = n0 + growth |slip|, slip followed over 0.1 m of way"
    source = "Ding et al., J. Cent. South Univ. Technol. 17 (2010) 129: n = n0 + n1 s; for skid and the way: ours"
    signature = (
        "wheels with large slip or skid, as of a locked bank, sink and drag more; straight drives stay as they are"
    )
    confused_with = ("multipass", "soil_change", "towed_drag", "viscous_drag")
    actions = ((POINT_SOIL, dig_in),)

    growth: float = size("-", 0.0, 1.5, least=0.1, step=0.1)
