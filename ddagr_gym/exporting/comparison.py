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
        wheel_speed: (T,) mean of the wheels in the first drive, from the command on [rad/s]; empty where none ran.
        paths: (K, T, 2) positions from the command on, from the world's origin [m]; empty where none ran.
    """

    speed: Array
    yaw_rate: Array
    wheel_speed: Array
    paths: Array


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
        moves = abs(self.right + self.left) > 1e-9
        return self.other_speed / self.speed - 1.0 if moves and self.speed != 0.0 else None

    @property
    def yaw_error(self) -> float | None:
        """Of the other, over ours [-]; None straight ahead."""
        turns = abs(self.right - self.left) > 1e-9
        return self.other_yaw_rate / self.yaw_rate - 1.0 if turns and self.yaw_rate != 0.0 else None


@dataclass(frozen=True, eq=False)
class Comparison:
    """Another simulator beside ours.

    Attributes:
        drives: that were compared.
        own_paths: (K, T, 2) in ours [m].
        other_paths: (K, T, 2) in the other [m]; empty where it did not run.
        step_error: root mean square error of the mean wheel speed in a step straight ahead over its end [-]; None where
            it did not run.
    """

    drives: tuple[Compared, ...]
    own_paths: Array
    other_paths: Array
    step_error: float | None

    @property
    def stepped(self) -> bool:
        """Whether the written model ran; otherwise it is the kinematic model that is compared."""
        return self.step_error is not None


def compare(own: SteadyDrives, other: Motion) -> Comparison:
    """Every drive in both simulators."""
    columns = zip(CHECKS, own.commands, own.v_x, other.speed, own.yaw_rate, other.yaw_rate, strict=True)
    drives = tuple(
        Compared(name, float(right), float(left), float(v), float(v_2), float(rate), float(rate_2))
        for (name, _, _), (right, left), v, v_2, rate, rate_2 in columns
    )
    return Comparison(drives, own.paths, other.paths, _step_error(own, other) if other.wheel_speed.size else None)


def kinematic_motion(found: CarriedOver, commands: Array) -> Motion:
    """What a differential drive with the commanded track and the rolling radius does: no sliding, no forces.

    ``v = R (g_r omega_r + g_l omega_l) / 2``, ``yaw rate = R (g_r omega_r - g_l omega_l) / B``.
    """
    right, left = commands[:, 0] * found.command_gain_right, commands[:, 1] * found.command_gain_left
    radius, none = found.rolling_radius, np.empty(0)
    return Motion(radius * 0.5 * (right + left), radius * (right - left) / found.commanded_track, none, none)


def _step_error(own: SteadyDrives, other: Motion) -> float:
    speeds = own.speeds.mean(axis=1)
    return float(np.sqrt(np.mean((other.wheel_speed - speeds) ** 2)) / speeds[-1])
