"""How late each command of a real drive acts, and what forecasts would be if that were known beforehand.

A model that is driven by commands has one dead time. Here every window is simulated with each of many, and keeps the
one by which its own wheel speeds are predicted best: an oracle, which says what the lateness of single commands costs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.calibration.forecast_errors import Forecasts
from ddagr_gym.calibration.left_out import ENCODERS
from ddagr_gym.identification.fit_numerics import field_numerics
from ddagr_gym.identification.window_model import WindowModel
from ddagr_gym.identification.windows import STATE, WindowSet

Array = NDArray[np.float64]

DEAD_TIMES = np.arange(0.0, 0.601, 0.02)
"""That are tried [s] (ours): commands of these drives act after 0 to 0.5 s."""

LEAST_CHANGE = 1.0
"""Of a window's wheel speeds, below which they do not tell its lateness [rad/s] (ours): a few times their noise."""


@dataclass(frozen=True, eq=False)
class Lateness:
    """How late the commands of each window act.

    Attributes:
        dead_times: (W,) [s]; NaN where the wheel speeds hardly change.
        prediction: (W, T, 8) with them, and with the calibrated dead time where they are not known.
        calibrated: dead time of the robot [s].
        turning: (W,) by how much the commands change the difference of the banks [rad/s].
    """

    dead_times: Array
    prediction: Array
    calibrated: float
    turning: Array

    @property
    def figures(self) -> dict[str, Any]:
        """Quartiles, and what the dead times go with, as JSON has them."""
        known = self.dead_times[np.isfinite(self.dead_times)]
        return {
            "windows": len(known),
            "calibrated": self.calibrated,
            "quartiles": np.percentile(known, [25.0, 50.0, 75.0]).tolist(),
            "deviation": float(np.std(known)),
            "correlation_with_next": _correlation(self.dead_times[:-1], self.dead_times[1:]),
            "correlation_with_turning": _correlation(self.dead_times, self.turning),
        }


def _correlation(one: Array, other: Array) -> float | None:
    """Of what is known of both; None where either does not vary."""
    pairs = np.stack([one, other])
    both = pairs[:, np.isfinite(pairs).all(axis=0)]
    varies = both.shape[1] > 1 and bool((np.ptp(both, axis=1) > 0.0).all())
    return float(np.corrcoef(both)[0, 1]) if varies else None


def _change_of_turning(windows: WindowSet) -> Array:
    """(W,) difference of the banks' commands in the first half of a window, less that of their speeds at its start."""
    first = windows.commands[:, windows.history : windows.history + windows.samples // 2]
    asked = np.nanmedian(first, axis=1)
    right, left = windows.initial[:, STATE.index("omega_right")], windows.initial[:, STATE.index("omega_left")]
    return np.abs(asked[:, 0] - asked[:, 1] - (right - left))


def lateness_of(item: Forecasts, threads: int = 2) -> Lateness:
    """How late the commands of each window act, by a robot and a soil that have not seen the drive.

    Args:
        item: forecasts of a left-out drive.
        threads: of the simulator.
    """
    windows, robot = item.windows, item.robot
    encoders = windows.measured[..., ENCODERS]

    def predicted(dead_time: float) -> Array:
        late = replace(robot, drivetrain=replace(robot.drivetrain, command_delay=dead_time))
        model = WindowModel(late, item.soil, windows, numerics=field_numerics(), threads=threads)
        return model.predict(np.zeros(0), windows.initial, item.sensors)

    best = predicted(robot.drivetrain.command_delay)
    least, chosen = np.full(windows.count, np.inf), np.full(windows.count, np.nan)
    told = np.ptp(np.nan_to_num(encoders), axis=1).max(axis=1) >= LEAST_CHANGE
    for dead_time in DEAD_TIMES:
        tried = predicted(float(dead_time))
        losses = np.nansum((tried[..., ENCODERS] - encoders) ** 2, axis=(1, 2))
        better = told & (losses < least)
        best[better], chosen[better], least[better] = tried[better], dead_time, losses[better]
    return Lateness(chosen, best, robot.drivetrain.command_delay, _change_of_turning(windows))
