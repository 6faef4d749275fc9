"""The rival arm: SINDy on what the nominal simulator leaves of accelerations (differentiate and regress).

The residual accelerations of body and banks, block means of the refitted nominal model's windows, are regressed on
plain functions of speeds, commands and heading by sequentially thresholded least squares (pysindy's STLSQ, S. L.
Brunton, J. L. Proctor, J. N. Kutz, PNAS 113 (2016) 3932). The threshold is the one that predicts left-out recordings
best, which may be to select nothing. An equation has no names: :data:`MEANING` says, generously, which effect of the
library each term would be read as. Nothing here can be read as an effect of gyro, encoders or receiver, as a change of
soil by place or time, or as payload.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.ablations.arms import First
from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.identification.problem import Problem
from ddagr_gym.identification.windows import CHANNELS

Array = NDArray[np.float64]

THRESHOLDS = (0.02, 0.05, 0.1, 0.2, 0.4)
"""Least coefficients, with terms and residuals scaled to a root mean square of 1."""

_SMALL_SPEED = 0.02  # [m/s] or [rad/s] over which a sign is smooth
_RIDGE = 1e-3

MEANING: dict[str, dict[str, str]] = {
    "specific_force_x": {
        "1": "accelerometer_bias", "cos(yaw)": "slope", "sin(yaw)": "slope", "v": "viscous_drag",
        "sgn(v)": "towed_drag", "v |v|": "viscous_drag", "w^2": "imu_lever_arm", "dw/dt": "imu_lever_arm",
        "v w": "imu_misalignment", "dv/dt": "accelerometer_sign",
    },
    "specific_force_y": {
        "1": "accelerometer_bias", "cos(yaw)": "slope", "sin(yaw)": "slope", "w^2": "imu_lever_arm",
        "dw/dt": "imu_lever_arm", "w": "lateral_bulldozing", "sgn(w)": "lateral_bulldozing",
        "dv/dt": "imu_misalignment", "v w": "accelerometer_sign",
    },
    "yaw_rate": {
        "v": "wheel_radius_mismatch", "sgn(v)": "centre_of_mass_offset", "w": "soil_change",
        "sgn(w)": "lateral_bulldozing", "v w": "towed_drag", "1": "soil_split",
    },
    "encoder_right": {
        "c": "motor_droop", "c - omega": "motor_lag", "dc/dt": "command_delay", "sgn(c)": "command_deadband",
        "c |c|": "motor_saturation",
    },
    "encoder_left": {
        "c": "motor_droop", "c - omega": "motor_lag", "dc/dt": "command_delay", "sgn(c)": "command_deadband",
        "c |c|": "motor_saturation",
    },
}  # fmt: skip
"""Effect that a term of the residual of a channel (of its derivative, for yaw rate and encoders) would be read as."""


@dataclass(frozen=True, eq=False)
class Equation:
    """Sparse equation of one residual.

    Attributes:
        evidence: of each selected term, the squares that are lost when it alone is taken away, over the mean square
            that remains [-].
        held_out: share by which the squares of left-out recordings fall; at most 0 where nothing is selected.
    """

    evidence: Mapping[str, float]
    held_out: float


def sparse_first(problem: Problem, fitted: Fitted, wheel_radius: float) -> First:
    """What SINDy on the residual of a fitted nominal model says.

    Args:
        problem: windows.
        fitted: refitted nominal model.
        wheel_radius: hub to tread [m].
    """
    total: dict[str, float] = {}
    best = 0.0
    for channel, terms in library(problem, fitted, wheel_radius).items():
        equation = _equation(problem, fitted, channel, terms)
        best = max(best, equation.held_out)
        for term, evidence in equation.evidence.items():
            name = MEANING[channel].get(term, "")
            total[name] = total.get(name, 0.0) + evidence
    first = max(total, key=lambda name: total[name], default="")
    return First(first, bool(total), best)


def library(problem: Problem, fitted: Fitted, wheel_radius: float) -> dict[str, dict[str, Array]]:
    """Terms (W, B) by channel, of readings and commands; the heading is the fitted model's."""
    windows = problem.blocked.windows
    _, count, length, _ = problem.blocked.weights.shape
    used = count * length

    def blocked(values: Array) -> Array:
        return np.asarray(values[:, :used].reshape(windows.count, count, length).mean(axis=2))

    step = length * windows.period
    read = {name: blocked(np.nan_to_num(windows.measured[..., k])) for k, name in enumerate(CHANNELS)}
    yaw = blocked(fitted.prediction[..., CHANNELS.index("pose_yaw")])
    driven = windows.commands[:, windows.history :]
    w, banks = read["yaw_rate"], (read["encoder_right"], read["encoder_left"])
    v = 0.5 * wheel_radius * (banks[0] + banks[1])
    body = {
        "1": np.ones_like(v), "v": v, "w": w, "sgn(v)": _sign(v), "sgn(w)": _sign(w), "v |v|": v * np.abs(v),
        "w |w|": w * np.abs(w), "v w": v * w, "w^2": w**2, "cos(yaw)": np.cos(yaw), "sin(yaw)": np.sin(yaw),
        "dv/dt": np.gradient(v, step, axis=1), "dw/dt": np.gradient(w, step, axis=1),
    }  # fmt: skip
    found = dict.fromkeys(("specific_force_x", "specific_force_y"), body)
    found["yaw_rate"] = {name: column for name, column in body.items() if name != "dw/dt"}
    for bank, name in enumerate(("encoder_right", "encoder_left")):
        c = blocked(driven[..., bank])
        found[name] = {
            "1": np.ones_like(c), "c": c, "c - omega": c - banks[bank], "dc/dt": np.gradient(c, step, axis=1),
            "sgn(c)": _sign(c), "c |c|": c * np.abs(c), "c w": c * w,
        }  # fmt: skip
    return found


def _sign(values: Array) -> Array:
    return np.asarray(np.tanh(values / _SMALL_SPEED))


def _equation(problem: Problem, fitted: Fitted, channel: str, terms: Mapping[str, Array]) -> Equation:
    """Sparse equation of a channel's residual acceleration."""
    blocked = problem.blocked
    k = CHANNELS.index(channel)
    residual = blocked.residual(fitted.prediction).reshape(blocked.sigma.shape)[..., k]
    known = np.isfinite(blocked.sigma[..., k])
    values = np.where(known, residual * np.where(known, blocked.sigma[..., k], 0.0), 0.0)
    if not channel.startswith("specific_force"):
        step = blocked.weights.shape[2] * blocked.windows.period
        values = np.gradient(values, step, axis=1)
        known &= np.roll(known, 1, axis=1) & np.roll(known, -1, axis=1)
    recording = np.broadcast_to(blocked.windows.recording[:, None], known.shape)[known]
    columns = np.stack([term[known] for term in terms.values()], axis=1)
    return sparse_equation(columns, values[known], recording, tuple(terms))


def sparse_equation(columns: Array, values: Array, recording: NDArray[np.int64], names: tuple[str, ...]) -> Equation:
    """Sparse equation whose threshold predicts left-out recordings best.

    Args:
        columns: (N, K) terms.
        values: (N,) residual.
        recording: (N,) that each sample is from.
        names: (K,) of the terms.
    """
    scale = np.maximum(np.sqrt((columns**2).mean(axis=0)), 1e-12)
    size = max(float(np.sqrt((values**2).mean())), 1e-12)
    x, y = columns / scale, values / size
    falls = [_held_out(x, y, recording, threshold) for threshold in THRESHOLDS]
    best = int(np.argmax(falls))
    if falls[best] <= 0.0:
        return Equation({}, falls[best])
    found = thresholded(x, y, THRESHOLDS[best])
    used = np.flatnonzero(found)
    left = float(((y - x @ found) ** 2).mean())
    inverse = np.linalg.pinv(x[:, used].T @ x[:, used])
    evidence = found[used] ** 2 / (np.diag(inverse) * left)
    return Equation({names[k]: float(e) for k, e in zip(used, evidence, strict=True)}, falls[best])


def _held_out(x: Array, y: Array, recording: NDArray[np.int64], threshold: float) -> float:
    """Share by which the squares of left-out recordings fall."""
    left = 0.0
    for number in np.unique(recording):
        out = recording == number
        left += float(((y[out] - x[out] @ thresholded(x[~out], y[~out], threshold)) ** 2).sum())
    return 1.0 - left / float((y**2).sum())


def thresholded(x: Array, y: Array, threshold: float) -> Array:
    """(K,) coefficients by sequentially thresholded least squares."""
    from pysindy import STLSQ

    with warnings.catch_warnings():
        # a threshold above every coefficient selects nothing, and says so
        warnings.simplefilter("ignore")
        return np.asarray(STLSQ(threshold=threshold, alpha=_RIDGE).fit(x, y[:, None]).coef_[0], dtype=np.float64)
