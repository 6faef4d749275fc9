"""How the IMU is mounted: what its accelerometer reads of the motion that the calibrated robot makes.

The joint fit leaves the accelerometer out, which rough ground shakes. With the specific force f of the body's origin,
the yaw rate r and its change a of the calibrated simulator, driven by the commands,

    R(yaw) [f_x - a y - r^2 x, f_y + a x - r^2 y] + b_d                                                             (1)

(theory: wheel model, eq. (35)) is fitted to the readings of the drives d, as means over a quarter of a second and with
a robust loss: the yaw of the sensor, its place (x, y), and what it reads too much in each drive, b_d. What the b_d of
several drives have in common is gravity along the axes of a tilted sensor; in one drive, bias and slope read the same.
As of any part, left-out drives decide whether yaw and place are kept; each must also be large enough to matter.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.calibration.accelerometer_results import ImuMounting, MountingSize
from ddagr_gym.calibration.calibration_data import CalibrationData
from ddagr_gym.calibration.ground_slopes import LIMIT
from ddagr_gym.calibration.joint_fit import FittedModel
from ddagr_gym.calibration.left_out import folds
from ddagr_gym.calibration.part_comparison import surely_above
from ddagr_gym.diagnosis.result.uncertainty import student_quantile
from ddagr_gym.identification.least_squares import huber_loss
from ddagr_gym.identification.residual_weights import MAD_TO_DEVIATION
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.parameters import STANDARD_GRAVITY
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects.imu_lever_arm import ImuLeverArm
from ddagr_gym.physics.effects.imu_misalignment import ImuMisalignment
from ddagr_gym.physics.effects.imu_tilt import ImuTilt

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

BLOCK = 0.25
"""Over which readings are averaged [s] (ours): vibration goes, launches of a second stay."""

FEWEST_READINGS = 40
"""Block means of a drive below which it says nothing (ours): ten seconds."""

FARTHEST = 3.0
"""Of the sensor from the body's origin [m] (ours)."""

YAW, PLACE = "imu_yaw", "imu_place"
SIZES = {"imu_yaw": (YAW, "rad"), "imu_x": (PLACE, "m"), "imu_y": (PLACE, "m")}
"""What is fitted beside biases: part that it belongs to, and unit."""

TILTS = {"imu_roll": (1, 1.0), "imu_pitch": (0, -1.0)}
"""Tilts by the axis along which the accelerometer reads gravity, and its sign."""

LEAST = {
    "imu_yaw": ImuMisalignment.parameter("yaw").metadata["least"],
    "imu_x": ImuLeverArm.parameter("x").metadata["least"],
    "imu_y": ImuLeverArm.parameter("y").metadata["least"],
    "imu_roll": ImuTilt.parameter("roll").metadata["least"],
    "imu_pitch": ImuTilt.parameter("pitch").metadata["least"],
}
"""Sizes below which nobody would care."""

HELPS = {
    YAW: "launches and hard stops on level ground, straight ahead and backwards",
    PLACE: "turns on the spot to both sides, begun and ended quickly",
    "imu_tilt": "several drives in different directions, or standing on level ground",
}
"""Drive that determines what was not kept, by part."""

_ENTRIES = (*(layout.MEAN_SPECIFIC_FORCE + k for k in range(2)), layout.MEAN_YAW_ACCELERATION, layout.YAW_RATE)


@dataclass(frozen=True, eq=False)
class Readings:
    """Block means of what the accelerometer read, with the motion that the calibrated simulator made.

    Attributes:
        measured: (N, 2) specific force [m/s^2].
        motion: (N, 4) specific force of the body's origin, yaw acceleration, yaw rate.
        group: (N,) drive, or quarter of the only one.
    """

    measured: Array
    motion: Array
    group: Integers

    def chosen(self, rows: NDArray[np.bool_]) -> Readings:
        """Some of them."""
        return Readings(self.measured[rows], self.motion[rows], self.group[rows])


def imu_mounting(data: CalibrationData, model: FittedModel) -> ImuMounting | None:
    """Mounting of the IMU; None where fewer than two drives, or quarters of one, read accelerations.

    Args:
        data: drives.
        model: joint fit.
    """
    readings = readings_of(data, model)
    groups = np.unique(readings.group)
    if groups.size < 2:
        return None
    return mounting_from(readings, data.count)


def readings_of(data: CalibrationData, model: FittedModel) -> Readings:
    """Readings of all drives that have some, over the windows of the joint fit."""
    windows, point = model.problem.blocked.windows, model.fitted.point
    _, record = model.problem.model.predict_recorded(point.values, point.states, _ENTRIES)
    columns = [CHANNELS.index(name) for name in ("specific_force_x", "specific_force_y")]
    length = max(1, round(BLOCK / windows.period))
    measured, motion = (_means(values, length) for values in (windows.measured[..., columns], record))
    count = measured.shape[1]
    group = np.repeat(folds(data, windows), count)
    measured, motion = measured.reshape(-1, 2), motion.reshape(-1, len(_ENTRIES))
    known = np.isfinite(measured).all(axis=1) & np.isfinite(motion).all(axis=1)
    many = [g for g in np.unique(group) if np.count_nonzero(known & (group == g)) >= FEWEST_READINGS]
    rows = known & np.isin(group, many)
    return Readings(measured[rows], motion[rows], group[rows])


def _means(values: Array, length: int) -> Array:
    """(W, T // length, K) means of samples (W, T, K); NaN where one of them is missing."""
    windows, samples, count = values.shape
    blocks = samples // length
    return np.asarray(values[:, : blocks * length].reshape(windows, blocks, length, count).mean(axis=2))


def mounting_from(readings: Readings, drives: int) -> ImuMounting:
    """Mounting from readings of two groups or more.

    Args:
        readings: of drives, or of the quarters of one.
        drives: how many there are; a single one does not tell a tilt.
    """
    groups = np.unique(readings.group)

    @cache
    def without(group: int | None, parts: frozenset[str]) -> _Fit:
        """Fit of some parts without one of the groups; of all of them for None."""
        return _Fit.of(readings if group is None else readings.chosen(readings.group != group), parts)

    kept: frozenset[str] = frozenset((YAW, PLACE))
    decided: dict[str, tuple[float, float]] = {}
    for part in (YAW, PLACE):
        decided[part] = _growth(readings, without, kept, part)
        mean, error = decided[part]
        values = without(None, kept).values
        large = any(abs(values[name]) >= LEAST[name] for name, (own, _) in SIZES.items() if own == part)
        if not (large and mean > surely_above(groups.size) * error):
            kept -= {part}
    whole = without(None, kept)
    left_out = [without(group, kept) for group in groups.tolist()]
    sizes = [_size(name, whole, left_out, kept, decided) for name in SIZES]
    tilts = [_tilt(name, whole, groups) if drives > 1 else _untold(name) for name in TILTS]
    before = without(None, frozenset())
    return ImuMounting((*sizes, *tilts), len(readings.group), before.left, whole.left)


@dataclass(frozen=True, eq=False)
class _Fit:
    """Mounting fitted to readings.

    Attributes:
        values: by name of :data:`SIZES`.
        deviations: of the free ones, if all readings were independent.
        biases: (2,) by group.
        scale: of the residuals.
        left: root mean square of the residuals [m/s^2].
    """

    values: dict[str, float]
    deviations: dict[str, float]
    biases: dict[int, Array]
    scale: float
    left: float

    @classmethod
    def of(cls, readings: Readings, parts: frozenset[str]) -> _Fit:
        """Fit of some parts; the others are at nothing."""
        from scipy.optimize import least_squares

        groups, index = np.unique(readings.group, return_inverse=True)
        free = [name for name, (part, _) in SIZES.items() if part in parts]

        def residual(vector: Array) -> Array:
            sizes = dict(zip(free, vector, strict=False))
            biases = vector[len(free) :].reshape(-1, 2)
            return np.asarray(readings.measured - _read(readings.motion, sizes) - biases[index])

        def scaled(scale: float) -> Callable[[Array], Array]:
            return lambda vector: residual(vector).ravel() / scale

        start = np.zeros(len(free) + 2 * len(groups))
        bound = np.full(start.size, np.inf)
        bound[: len(free)] = [np.pi if name == "imu_yaw" else FARTHEST for name in free]
        scale = _scale(residual(start))
        for _ in range(2):
            found = least_squares(scaled(scale), start, bounds=(-bound, bound), loss="huber", f_scale=LIMIT)
            start, scale = found.x, _scale(residual(found.x))
        values = {**dict.fromkeys(SIZES, 0.0), **dict(zip(free, start.tolist(), strict=False))}
        biases = dict(zip(groups.tolist(), start[len(free) :].reshape(-1, 2), strict=True))
        covariance = np.diag(np.linalg.pinv(found.jac.T @ found.jac))
        deviations = dict(zip(free, np.sqrt(covariance[: len(free)]).tolist(), strict=True))
        return cls(values, deviations, biases, scale, float(np.sqrt(np.mean(residual(start) ** 2))))


def _read(motion: Array, sizes: dict[str, float]) -> Array:
    """(N, 2) readings without biases, equation (1)."""
    x, y = sizes.get("imu_x", 0.0), sizes.get("imu_y", 0.0)
    change, rate = motion[:, 2], motion[:, 3]
    along = motion[:, 0] - change * y - rate**2 * x
    across = motion[:, 1] + change * x - rate**2 * y
    cosine, sine = np.cos(sizes.get("imu_yaw", 0.0)), np.sin(sizes.get("imu_yaw", 0.0))
    return np.stack([cosine * along + sine * across, cosine * across - sine * along], axis=1)


def _scale(residual: Array) -> float:
    """Robust deviation of residuals about the middle of each axis."""
    away = np.abs(residual - np.median(residual, axis=0))
    return max(float(MAD_TO_DEVIATION * np.median(away)), 1e-6)


def _growth(
    readings: Readings, without: Callable[[int, frozenset[str]], _Fit], parts: frozenset[str], part: str
) -> tuple[float, float]:
    """Mean growth over groups of the loss of left-out ones without a part, and its standard error."""
    growth = []
    for group in np.unique(readings.group).tolist():
        fits = [without(group, chosen) for chosen in (parts, parts - {part})]
        losses = [_left_out_loss(readings.chosen(readings.group == group), fit, fits[0].scale) for fit in fits]
        growth.append(losses[1] / losses[0] - 1.0)
    return float(np.mean(growth)), float(np.std(growth, ddof=1) / np.sqrt(len(growth)))


def _left_out_loss(readings: Readings, fit: _Fit, scale: float) -> float:
    """Mean loss of readings that a fit has not seen, but for what the sensor reads too much in them."""
    away = readings.measured - _read(readings.motion, fit.values)
    return float(huber_loss((away - np.median(away, axis=0)) / scale, LIMIT).mean())


def _size(
    name: str, whole: _Fit, left_out: Sequence[_Fit], kept: frozenset[str], decided: dict[str, tuple[float, float]]
) -> MountingSize:
    """A size with its interval, by the larger of two deviations: over the groups, and of independent readings.

    Over the groups it is the jackknife's (B. Efron, C. Stein, Ann. Stat. 9 (1981) 586).
    """
    part, unit = SIZES[name]
    growth, error = decided[part]
    if part not in kept:
        return MountingSize(name, unit, 0.0, None, False, growth, error, HELPS[part])
    jackknife = np.array([fit.values[name] for fit in left_out])
    count = len(jackknife)
    deviation = float(np.sqrt((count - 1) / count * ((jackknife - jackknife.mean()) ** 2).sum()))
    half = max(student_quantile(count - 1) * deviation, student_quantile(np.inf) * whole.deviations[name])
    value = whole.values[name]
    return MountingSize(name, unit, value, (value - half, value + half), True, growth, error, "")


def _tilt(name: str, whole: _Fit, groups: Integers) -> MountingSize:
    """The tilt that all drives have in common; what differs between them is their ground."""
    axis, sign = TILTS[name]
    found = sign * np.array([whole.biases[g][axis] for g in groups.tolist()]) / STANDARD_GRAVITY
    half = float(student_quantile(len(found) - 1) * found.std(ddof=1) / np.sqrt(len(found)))
    value = float(found.mean())
    kept = abs(value) >= LEAST[name] and abs(value) > half
    interval = (value - half, value + half)
    if kept:
        return MountingSize(name, "rad", value, interval, True, None, None, "")
    return _untold(name)


def _untold(name: str) -> MountingSize:
    """A tilt that the drives do not tell."""
    return MountingSize(name, "rad", 0.0, None, False, None, None, HELPS["imu_tilt"])
