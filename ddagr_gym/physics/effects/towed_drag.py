"""A constant drag behind the robot: a sledge, a chain, a furrow wheel."""

import math
from dataclasses import dataclass

from ddagr_gym.physics.effects.base import DriveExtent, Effect, Vector, shape, size
from ddagr_gym.physics.layout import BODY_FORCE, POINT_BODY_FORCES, V_X, V_Y, YAW_RATE

_SMOOTHING_SPEED = 0.01  # [m/s], ours: the sign of the velocity, made differentiable


def drag_behind(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Force ``parameters[0]`` against the velocity of a hitch ``parameters[1]`` behind, ``[2]`` left of the origin."""
    v_x = row[V_X] - row[YAW_RATE] * parameters[2]
    v_y = row[V_Y] - row[YAW_RATE] * parameters[1]
    speed = math.sqrt(v_x * v_x + v_y * v_y + _SMOOTHING_SPEED * _SMOOTHING_SPEED)
    force_x = -parameters[0] * v_x / speed
    force_y = -parameters[0] * v_y / speed
    row[BODY_FORCE] += force_x
    row[BODY_FORCE + 1] += force_y
    row[BODY_FORCE + 2] -= parameters[1] * force_y + parameters[2] * force_x


@dataclass(frozen=True)
class TowedDrag(Effect):
    """Force of constant size against the velocity of a hitch behind the body origin.

    Attributes:
        force: least: 10 N, a tenth of the rolling resistance of a 170 kg robot on soil.
        hitch_distance: behind the body origin.
        hitch_side: to the left of it; a hitch that is not in the middle pulls the robot to its side.
    """

    name = "towed_drag"
    title = "Towed drag"
    group = "robot"
    equation = "F = -force v_h/|v_h| at the hitch, v_h = (v_x - hitch_side yaw_rate, v_y - hitch_distance yaw_rate)"
    source = "Coulomb friction of a towed sledge"
    signature = "slower at every speed and heading; steadies yaw through the hitch"
    confused_with = ("lateral_bulldozing", "slip_sinkage", "slope", "soil_change", "viscous_drag")
    actions = ((POINT_BODY_FORCES, drag_behind),)

    force: float = size("N", 0.0, 2000.0, least=10.0, step=5.0)
    hitch_distance: float = shape("m", 0.0, 5.0, default=0.5, step=0.1)
    hitch_side: float = shape("m", -2.0, 2.0, default=0.0, step=0.05)

    @classmethod
    def probes(cls, extent: DriveExtent) -> tuple[Effect, ...]:
        """Pulled at the centre, and at one metre behind it, where it steadies yaw as well."""
        step = cls.parameter("force").metadata["step"]
        return (cls(step, 0.0), cls(step, 1.0))
