"""How another simulator moves, beside ours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.exporting.carried_over import CarriedOver
from ddagr_gym.exporting.working_point import CHECKS, SteadyDrives

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Motion:
    """What another simulator does at the commands of :data:`~ddagr_gym.exporting.working_point.CHECKS`.

    Attributes:
        speed: (K,) forward, of the middle of the wheels [m/s].
        yaw_rate: (K,) [rad/s].
        wheel_speed: (T,) mean of the wheels in the first drive, from the command on [rad/s]; empty without one.
    """

    speed: Array
    yaw_rate: Array
    wheel_speed: Array


@dataclass(frozen=True)
class Compared:
    """One drive in both simulators.

    Attributes:
        drive: its name.
        right: command of the right bank [rad/s].
        left: of the left bank [rad/s].
        speed: of ours [m/s].
        other_speed: of the other [m/s].
        yaw_rate: of ours [rad/s].
        other_yaw_rate: of the other [rad/s].
    """

    drive: str
    right: float
    left: float
    speed: float
    other_speed: float
    yaw_rate: float
    other_yaw_rate: float

    @property
    def speed_error(self) -> float | None:
        """Of the other, over ours [-]; None for a turn on the spot."""
        return self.other_speed / self.speed - 1.0 if abs(self.speed) > 0.02 * self._rim else None

    @property
    def yaw_error(self) -> float | None:
        """Of the other, over ours [-]; None straight ahead."""
        turns = abs(self.right - self.left) > 1e-9
        return self.other_yaw_rate / self.yaw_rate - 1.0 if turns and self.yaw_rate != 0.0 else None

    @property
    def _rim(self) -> float:
        """Speed that counts as none, per radius of a wheel of a fifth of a metre [m/s]."""
        return 0.2 * max(abs(self.right), abs(self.left))


def compared(drives: SteadyDrives, other: Motion) -> tuple[Compared, ...]:
    """Every drive in both simulators."""
    columns = zip(CHECKS, drives.commands, drives.v_x, other.speed, drives.yaw_rate, other.yaw_rate, strict=True)
    return tuple(
        Compared(name, float(right), float(left), float(v), float(v_2), float(rate), float(rate_2))
        for (name, _, _), (right, left), v, v_2, rate, rate_2 in columns
    )


def kinematic_motion(found: CarriedOver, commands: Array) -> Motion:
    """What a differential drive with the commanded track and the rolling radius does: no sliding, no forces.

    ``v = R (g_r omega_r + g_l omega_l) / 2``, ``yaw rate = R (g_r omega_r - g_l omega_l) / B``.
    """
    right, left = commands[:, 0] * found.command_gain_right, commands[:, 1] * found.command_gain_left
    radius = found.rolling_radius
    return Motion(radius * 0.5 * (right + left), radius * (right - left) / found.commanded_track, np.empty(0))


def step_error(drives: SteadyDrives, other: Motion) -> float:
    """Root mean square error of the mean wheel speed in a step straight ahead, over its end [-]."""
    ours = drives.speeds.mean(axis=1)
    return float(np.sqrt(np.mean((other.wheel_speed - ours) ** 2)) / ours[-1])
