"""Soil pushed aside by the flanks of wheels that move sideways, as all four do in a skid-steer turn."""

import math
from dataclasses import dataclass

from ddagr_gym.jit import kernel
from ddagr_gym.parameters import STANDARD_GRAVITY
from ddagr_gym.physics.effects.base import Effect, Vector, shape, size
from ddagr_gym.physics.layout import (
    EXTRA_FORCE_Y,
    EXTRA_YAW_MOMENT,
    POINT_WHEEL_FORCES,
    SINKAGE,
    SOIL,
    SOIL_COHESION,
    SOIL_EXIT_RATIO,
    SOIL_FRICTION_TANGENT,
    WHEEL,
    WHEEL_OMEGA,
    WHEEL_V_X,
    WHEEL_V_Y,
    YAW_RATE,
)

_MOBILISING_ANGLE = 0.05  # [rad] slip angle at which 70 percent of the pressure acts, ours
_REST_SPEED = 1e-3  # [m/s], ours: the same at rest


@kernel(inline=True)
def passive_resistance(cohesion: float, tangent: float, unit_weight: float) -> tuple[float, float]:
    """Coefficients A, B of Hegedus' resistance per length, A h + B h^2, of a vertical wall of depth h.

    Printed as A = D1 c, B = D1 D2 rho g / 2 with D1 = cot X + tan(X + phi), D2 = cot X + cot(X)^2 tan(phi) and
    X = 45 deg - phi/2, thus with Rankine's coefficient K = cot(X)^2: A = 2 c sqrt(K), B = rho g K (1 + sqrt(K) tan
    phi). Rankine's own wedge is half of rho g K; the rest is the heap that rides on it.
    """
    root = tangent + math.sqrt(1.0 + tangent * tangent)
    return 2.0 * cohesion * root, unit_weight * root * root * (1.0 + root * tangent)


def push_soil_aside(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Lateral force on each wheel at the middle of its submerged flank, against the lateral velocity there.

    The flank's depth is taken as a parabola over the contact length sqrt(2 R0 z) in front and its exit_angle_ratio
    behind, whose mean is 2/3 and mean square 8/15 of the depth's.
    """
    for i in range(4):
        soil = SOIL + 9 * i
        depth = row[SINKAGE + i]
        if depth <= 0.0:
            continue
        radius = row[WHEEL + i] + row[WHEEL + 8 + i]
        front = math.sqrt(2.0 * radius * depth)
        length = front * (1.0 + row[soil + SOIL_EXIT_RATIO])
        unit_weight = parameters[1] * STANDARD_GRAVITY
        linear, square = passive_resistance(row[soil + SOIL_COHESION], row[soil + SOIL_FRICTION_TANGENT], unit_weight)
        full = parameters[0] * length * depth * (linear * 2.0 / 3.0 + square * depth * 8.0 / 15.0)
        rim = radius * row[WHEEL_OMEGA + i]
        travel = rim + row[WHEEL_V_X + i]
        forward = travel / math.sqrt(travel * travel + _REST_SPEED * _REST_SPEED)
        arm = 0.375 * front * (1.0 - row[soil + SOIL_EXIT_RATIO]) * forward
        v_y = row[WHEEL_V_Y + i] + arm * row[YAW_RATE]
        rolling = _MOBILISING_ANGLE * max(abs(rim), abs(row[WHEEL_V_X + i]))
        force = -full * v_y / math.sqrt(v_y * v_y + rolling * rolling + _REST_SPEED * _REST_SPEED)
        row[EXTRA_FORCE_Y + i] += force
        row[EXTRA_YAW_MOMENT + i] += arm * force


@dataclass(frozen=True)
class LateralBulldozing(Effect):
    """Passive earth pressure of cohesive-frictional soil on the submerged flank of each wheel.

    It takes cohesion and friction from the soil under the wheel. Full pressure needs some sideways motion: it is
    mobilised over the slip angle, so that the force keeps its independence of speed and stays smooth.

    Attributes:
        scale: times the theoretical pressure, 1 for all of it; least: 0.25, some percent of a wheel's lateral force.
        density: of the soil in bulk.
    """

    name = "lateral_bulldozing"
    title = "Lateral bulldozing"
    group = "ground"
    equation = "F_y = -scale integral (D1 c h + D1 D2 density g h^2/2) dx v_y/|v_y|, h the flank's depth along x"
    source = "Hegedus (1960), as in Ishigami et al., J. Field Robotics 24 (2007) 233"
    signature = "turns slower and wider, the more the deeper it sinks; nothing in straight drives"
    confused_with = ("gyro_scale", "soil_change", "towed_drag")
    actions = ((POINT_WHEEL_FORCES, push_soil_aside),)

    scale: float = size("-", 0.0, 10.0, least=0.25, step=0.25)
    density: float = shape("kg/m^3", 200.0, 2500.0, default=1500.0, step=100.0)
