"""What a soil does under a wheel of the robot: the part of a finding that stands beside strength and stiffness."""

from __future__ import annotations

from dataclasses import dataclass

TRACTION, NET_PULL, SIDE_FORCE, SINKAGE = "traction", "net_pull", "side_force", "sinkage"
"""Names of quantities."""


@dataclass(frozen=True)
class WorkingPoint:
    """How a wheel stands and moves where its soil shows: medians over the half of the drives with most slip.

    Attributes:
        speed: of the hub along the wheel [m/s].
        slip: slip ratio of a driven wheel [-].
        slip_angle: between the wheel's plane and the motion of its hub [rad].
        load: normal load [N].
    """

    speed: float
    slip: float
    slip_angle: float
    load: float


@dataclass(frozen=True)
class SoilQuantity:
    """One thing that a wheel at the working point shows on two soils.

    Attributes:
        name: `traction` (torque of the axle over the outer radius), `net_pull` (traction less the resistance of the
            soil), `side_force` (against the sideways motion, as a size) or `sinkage`.
        unit: N or m.
        first: on the first soil.
        first_interval: 90 % of it.
        second: on the second soil.
        second_interval: 90 % of it.
        change: first over second less 1 [-]; null for `net_pull`, which may be about nothing.
        change_interval: 90 % of it; null with it.
    """

    name: str
    unit: str
    first: float
    first_interval: tuple[float, float]
    second: float
    second_interval: tuple[float, float]
    change: float | None
    change_interval: tuple[float, float] | None


@dataclass(frozen=True)
class SoilAtWork:
    """What drives know of a soil whose strength and stiffness do nearly the same.

    Attributes:
        first: where the first soil is, in words.
        second: where the soil is that it is held against; the nominal one where all of the drives were on the first.
        point: at which a wheel is taken on both.
        quantities: that follow.
        correlation: of the logarithms of strength and stiffness, over what resampling and priors leave open [-].
        told_apart: whether the drives tell strength from stiffness: not where the two depend on each other and the
            interval of either spans more than a factor of 1.5.
    """

    first: str
    second: str
    point: WorkingPoint
    quantities: tuple[SoilQuantity, ...]
    correlation: float
    told_apart: bool
