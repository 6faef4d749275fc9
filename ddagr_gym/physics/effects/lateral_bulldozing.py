"""Soil pushed aside by the flanks of wheels that move sideways, as all four do in a skid-steer turn."""

import math
from dataclasses import dataclass

from ddagr_gym.jit import kernel
from ddagr_gym.parameters import STANDARD_GRAVITY
from ddagr_gym.physics.body_dynamics import set_kinematics
from ddagr_gym.physics.effects.base import Action, DriveExtent, Effect, Vector, shape, size
from ddagr_gym.physics.layout import (
    EXTRA_FORCE_Y,
    EXTRA_YAW_MOMENT,
    HEAPED,
    OMEGA,
    POINT_SOIL,
    POINT_WHEEL_FORCES,
    SAMPLE_PERIOD,
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

_AT_ONCE = 0.05  # tangent of the slip angle at which 70 percent of the pressure acts, of soil against the flank, ours
_HEAPED_UP = (0.2, 0.8)  # the same of soil that has to be heaped up first, ours
_WAY = 0.3  # [m] over which a wheel leaves behind what it has heaped up, about its contact length, ours
_SHORTEST_WAY = 1e-3  # [m], ours
_STARTED = 4  # entry of the memory behind the four wheels'
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


def heap_soil_up(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Way to the side per way ahead, followed over the way ``parameters[3]``, into HEAPED and ``memory[:4]``."""
    set_kinematics(row)
    for i in range(4):
        rim = abs((row[WHEEL + i] + row[WHEEL + 8 + i]) * row[OMEGA + i % 2])
        travel = max(rim, abs(row[WHEEL_V_X + i]))
        aside = abs(row[WHEEL_V_Y + i]) / (travel + _REST_SPEED)
        if memory[_STARTED] == 0.0:
            memory[i] = aside
        passed = travel * row[SAMPLE_PERIOD]
        memory[i] += (1.0 - math.exp(-passed / max(parameters[3], _SHORTEST_WAY))) * (aside - memory[i])
        row[HEAPED + i] = memory[i]
    memory[_STARTED] = 1.0


@kernel(inline=True)
def mobilised(aside: float, angle: float) -> float:
    """Share of the pressure that acts at a way to the side per way ahead."""
    return aside / math.sqrt(aside * aside + angle * angle)


def push_soil_aside(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Lateral force on each wheel at the middle of its submerged flank, against the lateral velocity there.

    The flank's depth is taken as a parabola over the contact length sqrt(2 R0 z) in front and its exit_angle_ratio
    behind, whose mean is 2/3 and mean square 8/15 of the depth's. Where there is a way of heaping up, the pressure is
    that of the soil in HEAPED.
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
        if parameters[3] > 0.0:
            full *= mobilised(row[HEAPED + i], parameters[2])
        rolling = (_AT_ONCE if parameters[3] > 0.0 else parameters[2]) * max(abs(rim), abs(row[WHEEL_V_X + i]))
        force = -full * v_y / math.sqrt(v_y * v_y + rolling * rolling + _REST_SPEED * _REST_SPEED)
        row[EXTRA_FORCE_Y + i] += force
        row[EXTRA_YAW_MOMENT + i] += arm * force


@dataclass(frozen=True)
class LateralBulldozing(Effect):
    """Passive earth pressure of cohesive-frictional soil on the submerged flank of each wheel.

    It takes cohesion and friction from the soil under the wheel. Full pressure needs some sideways motion: it is
    mobilised over the slip angle, so that the force keeps its independence of speed and stays smooth. Soil that
    stands against the flank resists at once. Loose soil is heaped up first and left behind as the wheel rolls on, so
    that the berm, and with it the force, grows with the way to the side per way ahead: a large angle.

    Attributes:
        scale: times the theoretical pressure, 1 for all of it; least: 0.25, some percent of a wheel's lateral force.
        density: of the soil in bulk.
        angle: tangent of the slip angle at which 70 percent of the pressure acts.
        way: over which a wheel leaves behind what it has heaped up; 0 for pressure by the slip angle of the moment.
    """

    name = "lateral_bulldozing"
    title = "Lateral bulldozing"
    group = "ground"
    equation = (
        "F_y = -scale integral (D1 c h + D1 D2 density g h^2/2) dx v_y/sqrt(v_y^2 + angle^2 v_x^2), h the flank's "
        "depth along x; with a way times b/sqrt(b^2 + angle^2), way db/ds = |v_y/v_x| - b, s the way ahead"
    )
    source = "Hegedus (1960), as in Ishigami et al., J. Field Robotics 24 (2007) 233"
    signature = "turns slower and wider, the more the deeper it sinks; nothing in straight drives"
    confused_with = ("gyro_scale", "soil_change", "towed_drag")
    actions = ((POINT_WHEEL_FORCES, push_soil_aside), (POINT_SOIL, heap_soil_up))

    scale: float = size("-", 0.0, 10.0, least=0.25, step=0.25)
    density: float = shape("kg/m^3", 200.0, 2500.0, default=1500.0, step=100.0)
    angle: float = shape("-", 0.005, 2.0, default=_AT_ONCE, step=0.05)
    way: float = shape("m", 0.0, 5.0, default=0.0, step=0.1)

    @property
    def acting(self) -> tuple[tuple[int, Action], ...]:
        """Without a way of heaping up the force alone."""
        return self.actions if self.way > 0.0 else self.actions[:1]

    @classmethod
    def probes(cls, extent: DriveExtent) -> tuple[Effect, ...]:
        """Soil that stands against the flank, and soil that has to be heaped up."""
        step = cls.parameter("scale").metadata["step"]
        return (cls(step), *(cls(step, angle=angle, way=_WAY) for angle in _HEAPED_UP))
