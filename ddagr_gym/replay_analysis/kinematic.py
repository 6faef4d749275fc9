"""Kinematic baselines: what a replay must beat to have learnt anything about the ground.

A skid-steer robot without inertia or slip turns by the speed difference of its banks over its track; in reality by
less, as if its track were wider (A. Mandow et al., Experimental kinematics for wheeled skid-steer mobile robots, IROS
2007). The *effective track* over the geometric one is 1 for the no-slip model and fitted otherwise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.frames import wrap_angle
from ddagr_gym.identification.least_squares import huber_loss
from ddagr_gym.identification.windows import CHANNELS, WindowSet

Array = NDArray[np.float64]

_OMEGA = slice(6, 8)
_POSE = slice(0, 3)
_DELAY_STEP = 0.01  # [s] between delays that are tried (ours): half a sample at 50 Hz
_REWEIGHTINGS = 20  # of least squares for Huber's loss (ours): one unknown settles in a few


@dataclass(frozen=True)
class Motor:
    """First-order bank speed loop with a ceiling and a dead time.

    Attributes:
        rate: [1/s].
        maximum_speed: of a bank [rad/s].
        delay: of the commands [s].
    """

    rate: float
    maximum_speed: float
    delay: float = 0.0

    def speeds(self, windows: WindowSet) -> Array:
        """Bank speeds (W, T + 1, 2) at the starts and the samples of the windows, from their first guess [rad/s]."""
        targets = np.clip(windows.drive(self.delay), -self.maximum_speed, self.maximum_speed)
        decay = math.exp(-self.rate * windows.period)
        speeds = np.empty((windows.count, windows.samples + 1, 2))
        speeds[:, 0] = windows.initial[:, _OMEGA]
        for k in range(windows.samples):
            speeds[:, k + 1] = targets[:, k] + (speeds[:, k] - targets[:, k]) * decay
        return speeds


@dataclass(frozen=True)
class KinematicModel:
    """Bank speeds to motion.

    Attributes:
        wheel_radius: [m].
        half_track: geometric [m].
        track_ratio: effective over geometric track [-].
        motor: that follows the commands; None where the drive is recorded wheel speeds.
        delay: of recorded wheel speeds [s], negative where their clock is late.
    """

    wheel_radius: float
    half_track: float
    track_ratio: float = 1.0
    motor: Motor | None = None
    delay: float = 0.0

    def predict(self, windows: WindowSet) -> Array:
        """Channels (W, T, 8) in the order of CHANNELS, from the windows' first guess of the pose."""
        speeds = bank_speeds_at_samples(windows, self.delay) if self.motor is None else self.motor.speeds(windows)
        period = windows.period
        forward = 0.5 * self.wheel_radius * speeds.sum(axis=-1)
        turning = 0.5 * self.wheel_radius * (speeds[..., 0] - speeds[..., 1]) / (self.half_track * self.track_ratio)
        turned = 0.5 * period * (turning[:, 1:] + turning[:, :-1])
        travelled = 0.5 * period * (forward[:, 1:] + forward[:, :-1])
        x, y, yaw = windows.initial[:, _POSE].T[..., None]
        heading = yaw + np.cumsum(turned, axis=1)
        middle = heading - 0.5 * turned
        channels = {
            "specific_force_x": np.diff(forward, axis=1) / period,
            "specific_force_y": forward[:, 1:] * turning[:, 1:],
            "yaw_rate": turning[:, 1:],
            "encoder_right": 0.5 * (speeds[:, 1:, 0] + speeds[:, :-1, 0]),
            "encoder_left": 0.5 * (speeds[:, 1:, 1] + speeds[:, :-1, 1]),
            "pose_x": x + np.cumsum(travelled * np.cos(middle), axis=1),
            "pose_y": y + np.cumsum(travelled * np.sin(middle), axis=1),
            "pose_yaw": heading,
        }
        return np.stack([channels[name] for name in CHANNELS], axis=-1)


def bank_speeds_at_samples(windows: WindowSet, delay: float = 0.0) -> Array:
    """Recorded bank speeds (W, T + 1, 2) at the starts and the samples of windows driven by encoders [rad/s]."""
    start = windows.drive(delay + windows.period)[:, :1]
    return np.concatenate([start, windows.drive(delay)], axis=1)


def fit_track(
    windows: WindowSet,
    wheel_radius: float,
    half_track: float,
    motor: Motor | None = None,
    *,
    sigma: float = np.inf,
    robust: float = np.inf,
) -> KinematicModel | None:
    """Effective track, and without a motor the lateness of the encoders, from the gyro or else the poses' headings.

    Args:
        windows: training part; without ``motor`` driven by encoders, with as much drive kept before and after as
            encoders may be late.
        wheel_radius: [m].
        half_track: geometric [m].
        motor: that follows the commands, for windows driven by commands.
        sigma: of the gyro [rad/s], for the loss.
        robust: weighted residual from which the loss is linear.

    Returns:
        None where nothing measures a turn that goes with the wheel speeds.
    """
    before, after = windows.history * windows.period, windows.ahead * windows.period
    delays = np.arange(-after, before - windows.period, _DELAY_STEP) if motor is None else np.zeros(1)
    best: tuple[float, float, float] | None = None
    for delay in delays:
        speeds = bank_speeds_at_samples(windows, delay) if motor is None else motor.speeds(windows)
        turning = 0.5 * wheel_radius * (speeds[..., 0] - speeds[..., 1]) / half_track
        measured, model = _turns(windows, turning)
        share, loss = _robust_share(measured, model, sigma, robust)
        if share > 0.0 and (best is None or loss < best[0]):
            best = (loss, 1.0 / share, float(delay))
    return None if best is None else KinematicModel(wheel_radius, half_track, best[1], motor, best[2])


def _turns(windows: WindowSet, turning: Array) -> tuple[Array, Array]:
    """Measured and no-slip yaw rates (n,) at the gyro's samples; between poses where the gyro is absent or dead."""
    gyro = windows.measured[..., CHANNELS.index("yaw_rate")]
    known = np.isfinite(gyro)
    if known.any() and np.ptp(gyro[known]) > 0.0:
        return gyro[known], turning[:, 1:][known]
    headings = windows.measured[..., CHANNELS.index("pose_yaw")]
    turned = np.cumsum(0.5 * windows.period * (turning[:, 1:] + turning[:, :-1]), axis=1)
    measured, model = [np.empty(0)], [np.empty(0)]
    for heading, angle in zip(headings, turned, strict=True):
        rows = np.flatnonzero(np.isfinite(heading))
        time = np.diff(rows) * windows.period
        measured.append(wrap_angle(np.diff(heading[rows])) / time)
        model.append(np.diff(angle[rows]) / time)
    return np.concatenate(measured), np.concatenate(model)


def _robust_share(measured: Array, model: Array, sigma: float, robust: float) -> tuple[float, float]:
    """Factor on the model and Huber's loss, by reweighted least squares; 0 where there is no turn."""
    if not model.size or not model @ model > 0.0:
        return 0.0, np.inf
    limit = robust * sigma if np.isfinite(robust) and np.isfinite(sigma) else np.inf
    share = float(model @ measured) / float(model @ model)
    for _ in range(_REWEIGHTINGS if np.isfinite(limit) else 0):
        weight = limit / np.maximum(np.abs(measured - share * model), limit)
        share = float((weight * model) @ measured) / float((weight * model) @ model)
    return share, float(huber_loss(measured - share * model, limit).sum())


def fit_motor(windows: WindowSet, rate: float, maximum_speed: float, noise: float) -> Motor:
    """Motor whose speeds follow the encoders best, by robust least squares (soft L1).

    Args:
        windows: training part, driven by commands.
        rate: to start from [1/s].
        maximum_speed: to start from [rad/s].
        noise: of the encoders [rad/s].

    Returns:
        The motor to start from where there are no encoder samples.
    """
    from scipy.optimize import least_squares

    columns = [CHANNELS.index("encoder_right"), CHANNELS.index("encoder_left")]
    measured = windows.measured[..., columns]
    known = np.isfinite(measured)
    if not known.any():
        return Motor(rate, maximum_speed)

    def misfit(values: Array) -> Array:
        speeds = Motor(math.exp(values[0]), math.exp(values[1]), values[2]).speeds(windows)
        return np.asarray((0.5 * (speeds[:, 1:] + speeds[:, :-1]) - measured)[known] / noise)

    longest = max((windows.history - 1) * windows.period, windows.period)
    low = [math.log(0.1), math.log(0.05 * maximum_speed), 0.0]
    high = [math.log(200.0), math.log(20.0 * maximum_speed), longest]
    # no slope where commands are steps without delay, or all below the ceiling: start inside
    largest = float(np.nanmax(np.abs(windows.commands)))
    ceiling = float(np.clip(min(maximum_speed, 0.9 * largest), 0.06 * maximum_speed, None))
    start = [math.log(rate), math.log(ceiling), 0.5 * min(longest, 2.0 * windows.period)]
    found = least_squares(misfit, start, bounds=(low, high), loss="soft_l1", x_scale=(0.5, 0.1, 0.05), diff_step=1e-3)
    return Motor(math.exp(found.x[0]), math.exp(found.x[1]), float(found.x[2]))
