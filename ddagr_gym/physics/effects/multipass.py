"""Rear wheels that run in the ruts of the front ones."""

import math
from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.effects.soil_factors import scale_soil
from ddagr_gym.physics.layout import HALF_WHEELBASE, POINT_SOIL, V_X, V_Y, WHEEL, YAW_RATE

_REST_SPEED = 5e-3  # [m/s], ours: which axle leads, made differentiable


def stiffen_ruts(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Stiffen the soil of the following axle by ``parameters[0]`` times its overlap with the rut."""
    square = row[V_X] * row[V_X] + _REST_SPEED * _REST_SPEED
    forward = 0.5 * (1.0 + row[V_X] / math.sqrt(square))
    sweep = row[YAW_RATE] * row[HALF_WHEELBASE]
    time = 2.0 * row[HALF_WHEELBASE] / math.sqrt(square)
    aside = time * time * (row[V_Y] * row[V_Y] + sweep * sweep)
    for i in range(4):
        width = 2.0 * row[WHEEL + 4 + i]
        overlap = math.exp(-aside / (width * width))
        following = forward if i >= 2 else 1.0 - forward
        scale_soil(row, i, 1.0, 1.0 + parameters[0] * overlap * following)


@dataclass(frozen=True)
class Multipass(Effect):
    """Stiffer soil for the axle that follows, by how much its wheels run in the rut of the leading ones.

    The rut is missed by v_y t, t the time for one wheelbase, and widened and loosened by the sideways sweep of the
    wheels +-yaw_rate L t; both reduce the overlap as a Gaussian of the tyre width (its form is ours). Driving backwards
    the front axle follows. The first wheelbase of a drive is treated as if there were a rut already.

    Attributes:
        stiffening: relative gain of k_c and k_phi in a rut; least: 20 percent, about what plate tests repeat to;
            negative for soil that a pass loosens (crusted snow, sensitive clay).
    """

    name = "multipass"
    title = "Rear wheels in ruts"
    group = "ground"
    equation = "k_rear = k (1 + stiffening exp(-(v_y^2 + (yaw_rate L)^2) t^2/(2 half_width)^2)), t = 2 L/|v_x|"
    source = "multi-pass effect (Holm, J. Terramechanics 6 (1969) 47; Senatore and Sandu, ibid. 48 (2011) 265)"
    signature = (
        "rear wheels less deep when straight, as if the ground changed with curvature; wide turns slide sideways"
    )
    confused_with = ("centre_of_mass_offset", "slip_sinkage", "soil_change")
    actions = ((POINT_SOIL, stiffen_ruts),)

    stiffening: float = size("-", -0.5, 5.0, least=0.2, step=0.2)
