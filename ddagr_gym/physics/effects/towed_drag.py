"""A constant drag behind the robot: a chain or a furrow wheel at a hitch, or a sledge on a rope."""

import math
from dataclasses import dataclass

from ddagr_gym.jit import kernel
from ddagr_gym.physics.effects.base import DriveExtent, Effect, Vector, shape, size
from ddagr_gym.physics.layout import (
    BODY_FORCE,
    POINT_BODY_FORCES,
    POINT_LOADS,
    TOWED,
    V_X,
    V_Y,
    YAW,
    YAW_RATE,
    X,
    Y,
)

_SMOOTHING_SPEED = 0.01  # [m/s], ours: the sign of the velocity, made differentiable
_GIVE = 0.01  # [m] of slack over which the pull of a rope goes, ours
_SHORT = 0.1  # [m], ours: a shorter rope is rather a hitch itself, so that length 0 is nothing apart
_SHORTEST = 1e-6  # [m], so that a rope has a direction
_USUAL_ROPE = 0.8  # [m], about one robot behind
_LAID = 2  # entry of the memory behind the load's place


@kernel(inline=True)
def hitch_place(row: Vector, parameters: Vector) -> tuple[float, float]:
    """World position of the hitch."""
    cosine, sine = math.cos(row[YAW]), math.sin(row[YAW])
    x = row[X] - parameters[1] * cosine - parameters[2] * sine
    y = row[Y] - parameters[1] * sine + parameters[2] * cosine
    return x, y


@kernel(inline=True)
def hitch_velocity(row: Vector, parameters: Vector) -> tuple[float, float]:
    """Velocity of the hitch, body axes."""
    return row[V_X] - row[YAW_RATE] * parameters[2], row[V_Y] - row[YAW_RATE] * parameters[1]


@kernel(inline=True)
def lay_behind(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Put the load at ``memory[:2]``, where it trails in a steady turn with the present motion, taken as forward."""
    v_x, v_y = hitch_velocity(row, parameters)
    along = math.sqrt(v_x * v_x + _SMOOTHING_SPEED * _SMOOTHING_SPEED)
    speed = math.sqrt(along * along + v_y * v_y)
    # arctangent in place of arcsine: a rope longer than the radius of the hitch's circle has no steady turn
    heading = row[YAW] + math.atan2(v_y, along) - math.atan(row[YAW_RATE] * parameters[3] / speed)
    x, y = hitch_place(row, parameters)
    memory[0] = x - parameters[3] * math.cos(heading)
    memory[1] = y - parameters[3] * math.sin(heading)
    memory[_LAID] = 1.0


def lead_load(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Draw a load at ``memory[:2]`` straight towards the hitch as far as a rope ``parameters[3]`` long demands."""
    rope = parameters[3]
    if rope > 0.0:
        if memory[_LAID] == 0.0:
            lay_behind(row, parameters, memory)
        x, y = hitch_place(row, parameters)
        share = max(1.0 - rope / max(math.hypot(x - memory[0], y - memory[1]), rope), 0.0)
        memory[0] += share * (x - memory[0])
        memory[1] += share * (y - memory[1])
        row[TOWED] = memory[0]
        row[TOWED + 1] = memory[1]


@kernel(inline=True)
def rope_pull(row: Vector, parameters: Vector, v_x: float, v_y: float) -> tuple[float, float]:
    """Force of a rope on a hitch with velocity (v_x, v_y), body axes: none while slack or slackening."""
    x, y = hitch_place(row, parameters)
    x, y = row[TOWED] - x, row[TOWED + 1] - y
    distance = math.sqrt(x * x + y * y) + _SHORTEST
    cosine, sine = math.cos(row[YAW]) / distance, math.sin(row[YAW]) / distance
    towards_x, towards_y = cosine * x + sine * y, cosine * y - sine * x
    leaving = max(-v_x * towards_x - v_y * towards_y, 0.0)
    slack = max(parameters[3] - distance, 0.0) / _GIVE
    pull = parameters[0] * leaving / math.sqrt(leaving * leaving + _SMOOTHING_SPEED * _SMOOTHING_SPEED)
    pull *= math.exp(-slack * slack)
    return pull * towards_x, pull * towards_y


def drag_behind(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Force ``parameters[0]`` at a hitch ``parameters[1]`` behind, ``[2]`` left of the origin.

    It acts against the velocity of the hitch, or along a rope ``parameters[3]`` long.
    """
    v_x, v_y = hitch_velocity(row, parameters)
    speed = math.sqrt(v_x * v_x + v_y * v_y + _SMOOTHING_SPEED * _SMOOTHING_SPEED)
    force_x = -parameters[0] * v_x / speed
    force_y = -parameters[0] * v_y / speed
    if parameters[3] > 0.0:
        share = -math.expm1(-parameters[3] * parameters[3] / (_SHORT * _SHORT))
        pull_x, pull_y = rope_pull(row, parameters, v_x, v_y)
        force_x += share * (pull_x - force_x)
        force_y += share * (pull_y - force_y)
    row[BODY_FORCE] += force_x
    row[BODY_FORCE + 1] += force_y
    row[BODY_FORCE + 2] -= parameters[1] * force_y + parameters[2] * force_x


@dataclass(frozen=True)
class TowedDrag(Effect):
    """Force of constant size at a hitch behind the body origin, against its velocity or along a rope to a load.

    A load on a rope follows the hitch's path on the inside and with a delay, as a trailer does, and the rope goes slack
    when the robot backs. A drive, and each window of one, begins with the load where a steady turn would have it.

    Attributes:
        force: least: 10 N, a tenth of the rolling resistance of a 170 kg robot on soil.
        hitch_distance: behind the body origin.
        hitch_side: to the left of it; a hitch that is not in the middle pulls the robot to its side.
        rope: length to the load; 0 for something dragged at the hitch itself, which holds back in both directions.
    """

    name = "towed_drag"
    title = "Towed drag"
    group = "robot"
    equation = (
        "F = -force v_h/|v_h| at the hitch, v_h = (v_x - hitch_side yaw_rate, v_y - hitch_distance yaw_rate); with a "
        "rope F = force u along it, u towards the load, du/dt = -(v_h - (v_h u) u)/rope in the world, 0 while slack"
    )
    source = "Coulomb friction of a towed sledge; the tractrix of a trailer (LaValle, Planning Algorithms, 13.1.2)"
    signature = "slower at every speed and heading; steadies yaw through the hitch, on a rope late and for longer"
    confused_with = ("lateral_bulldozing", "slip_sinkage", "slope", "soil_change", "viscous_drag")
    actions = ((POINT_BODY_FORCES, drag_behind), (POINT_LOADS, lead_load))

    force: float = size("N", 0.0, 2000.0, least=10.0, step=5.0)
    hitch_distance: float = shape("m", 0.0, 5.0, default=0.5, step=0.1)
    hitch_side: float = shape("m", -2.0, 2.0, default=0.0, step=0.05)
    rope: float = shape("m", 0.0, 5.0, default=0.0, step=0.1)

    @classmethod
    def probes(cls, extent: DriveExtent) -> tuple[Effect, ...]:
        """Dragged one metre behind the centre, where it steadies yaw as well, and on a rope."""
        step = cls.parameter("force").metadata["step"]
        return (cls(step, 1.0), cls(step, rope=_USUAL_ROPE))
