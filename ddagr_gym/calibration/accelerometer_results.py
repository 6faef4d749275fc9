"""What accelerometers tell of sensors and grounds, in the answer of a calibration."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class MountingSize:
    """How the IMU is mounted in one respect.

    Attributes:
        name: imu_yaw (turned counter-clockwise), imu_x and imu_y (place from the body's origin, forward and to the
            left), imu_roll and imu_pitch (tilted, left side up and nose down).
        unit: of the value.
        value: fitted; 0 where it is not kept.
        interval: 90 %, between drives; null where it is not kept.
        kept: whether the drives support it and it is large enough to matter.
        growth: relative growth of the loss of the accelerometers of left-out drives without it; null for a tilt, which
            is what drives have in common.
        error: standard error of that growth between drives; null likewise.
        helps: drive that would determine it; "" where it is kept.
    """

    name: str
    unit: str
    value: float
    interval: tuple[float, float] | None
    kept: bool
    growth: float | None
    error: float | None
    helps: str


@dataclass(frozen=True)
class ImuMounting:
    """How the IMU is mounted, by what its accelerometer reads of the calibrated simulator's motion.

    Attributes:
        sizes: turning, place and tilt.
        readings: means of a quarter of a second that it was fitted to.
        before: root mean square of what is left of them with each drive's own bias alone [m/s^2].
        after: the same with the mounting.
    """

    sizes: tuple[MountingSize, ...]
    readings: int
    before: float
    after: float


@dataclass(frozen=True)
class SlopeOfGround:
    """Slope of a ground, by what the accelerometers read beside the motion.

    Attributes:
        ground: its name.
        gradient: rise per metre along the axes x and y of the poses [-].
        deviations: of that of a further drive on it.
    """

    ground: str
    gradient: tuple[float, float]
    deviations: tuple[float, float]
