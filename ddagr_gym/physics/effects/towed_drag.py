"""A constant drag behind the robot: a sledge, a chain, a furrow wheel."""

import math
from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, size
from ddagr_gym.physics.layout import BODY_FORCE, POINT_BODY_FORCES, V_X, V_Y, YAW_RATE

_SMOOTHING_SPEED = 0.01  # [m/s], ours: the sign of the velocity, made differentiable


def drag_behind(row, parameters, memory):  # type: ignore[no-untyped-def]
    v_y = row[V_Y] - row[YAW_RATE] * parameters[1]
    speed = math.sqrt(row[V_X] * row[V_X] + v_y * v_y + _SMOOTHING_SPEED * _SMOOTHING_SPEED)
    force_x = -parameters[0] * row[V_X] / speed
    force_y = -parameters[0] * v_y / speed
    row[BODY_FORCE] += force_x
    row[BODY_FORCE + 1] += force_y
    row[BODY_FORCE + 2] -= parameters[1] * force_y


@dataclass(frozen=True)
class TowedDrag(Effect):
    """Force of constant size against the velocity of a hitch ``hitch_distance`` behind the body origin."""

    name = "towed_drag"
    title = "Towed drag"
    equation = "F = -force v_h/|v_h| at the hitch, v_h = (v_x, v_y - hitch_distance yaw_rate)"
    source = "Coulomb friction of a towed sledge"
    signature = "slower at every speed and heading; steadies yaw through the hitch"
    confused_with = ("viscous_drag", "soil_change", "slope")
    actions = ((POINT_BODY_FORCES, drag_behind),)

    force: float = size("N", 0.0, 2000.0, least=10.0)
    hitch_distance: float = size("m", 0.0, 5.0, least=0.0, default=0.5)
