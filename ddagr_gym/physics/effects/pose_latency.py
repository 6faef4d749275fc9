"""A pose that arrives late but is stamped as if it were new."""

import math
from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.history import fill_node, push, recall, ring_is_empty, ring_stride
from ddagr_gym.physics.layout import POINT_READINGS, READING, SAMPLE_PERIOD, V_X, V_Y, YAW, YAW_RATE, X

_LONGEST = 1.0  # [s]
_NODES = 43  # every fourth sample at 125 Hz; linear between nodes leaves less than 0.1 mm at 1 m/s^2


def delay_pose(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Move a fix, where there is one, to the pose of ``parameters[0]`` seconds ago; its noise stays."""
    period = row[SAMPLE_PERIOD]
    stride = ring_stride(_LONGEST, period, _NODES)
    if ring_is_empty(memory, 3, _NODES):
        # before the first sample the robot is taken to have moved on the circle of its first motion
        for k in range(1, _NODES):
            ago = k * stride * period
            heading = row[YAW] - 0.5 * ago * row[YAW_RATE]
            along = row[V_X] * math.cos(heading) - row[V_Y] * math.sin(heading)
            across = row[V_X] * math.sin(heading) + row[V_Y] * math.cos(heading)
            fill_node(memory, 3, _NODES, k, stride, 0, row[X] - ago * along)
            fill_node(memory, 3, _NODES, k, stride, 1, row[X + 1] - ago * across)
            fill_node(memory, 3, _NODES, k, stride, 2, row[YAW] - ago * row[YAW_RATE])
    push(memory, 3, _NODES, stride, row[X : YAW + 1])
    if math.isnan(row[READING + 5]):
        return
    for channel in range(3):
        present = row[X + channel]
        past = recall(memory, 3, _NODES, stride, channel, parameters[0] / period, present)
        row[READING + 5 + channel] += past - present


@dataclass(frozen=True)
class PoseLatency(Effect):
    """Position and heading of some time ago, interpolated.

    Attributes:
        latency: least: 0.05 s, one centimetre at 0.2 m/s and what an RTK receiver takes to compute.
    """

    name = "pose_latency"
    title = "Late pose"
    group = "sensors"
    equation = "pose(t) -> pose(t - latency)"
    source = "latency of a GNSS solution, stamped on arrival instead of at its epoch; transport lag"
    signature = "pose behind the path by speed times latency, heading behind in turns; gone at rest"
    confused_with = ("sensor_hold",)
    actions = ((POINT_READINGS, delay_pose),)

    latency: float = size("s", 0.0, _LONGEST, least=0.05, step=0.02)
