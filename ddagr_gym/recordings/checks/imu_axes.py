"""How the IMU is mounted, among the right angles: by gravity, forward acceleration and v times yaw rate.

The specific force answers to dv/dt along the robot's x axis, to v w along y and to gravity along z; the gyro shows the
turn rate on the axis that points up. Each of the 24 rotations by right angles, alone or with a wrong sign of one axis
or of the gyro, predicts which of the sensor's axes answers to which motion. The one that fits is named where every
other one fits clearly worse.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from ddagr_gym.parameters import STANDARD_GRAVITY
from ddagr_gym.recordings.checks.blocks import FEWEST_BLOCKS, resample
from ddagr_gym.recordings.checks.motion_windows import GYRO, STEP, MotionWindows
from ddagr_gym.recordings.checks.regression import normal_equations, solve
from ddagr_gym.recordings.checks.turning import LEAST_TURN, enough_turns
from ddagr_gym.recordings.schema import FloatArray

RESPONSE = 0.9
"""Response of a sound axis to dv/dt and v w of the wheels [-]: 0.8 to 1.2 on the open recordings."""
RESPONSE_SPREAD = 0.3
"""Standard deviation of it between drives [-] (ours): slip lowers it, and a mounting askew by 17 degrees mixes 0.3."""
GRAVITY_SPREAD = 0.15
"""Of gravity's direction in the sensor [-] (ours): 9 degrees of slope and mounting together."""
GYRO_SPREAD = 0.2
"""Of the gyro's scale [-] (ours)."""
STILL_TRAVEL = 0.02
"""Speed below which a robot counts as at rest in a window [m/s] (ours)."""
COST_OF_A_FAULT = 15.0
"""Chi-square that another fault has to earn (ours): among 384 mountings 6 in 10^3 do so by chance."""
CLEAR = 10.0
"""Chi-square by which the best mounting has to lead (ours): the cost of a fault, less what noise may give a mounting
with one fault more."""
WORST_FIT = 60.0
"""Chi-square of ten numbers beyond which no right angle fits (ours): an IMU at 45 degrees, a dead axis."""


@dataclass(frozen=True)
class Mounting:
    """One way in which the readings come about.

    Attributes:
        rotation: sensor axes (rows) in the robot's axes (columns), a rotation by right angles (3, 3).
        flips: sign of each axis of the accelerometer beyond the rotation (3,).
        gyro: sign of the gyro beyond the rotation.
    """

    rotation: FloatArray
    flips: FloatArray
    gyro: float

    @property
    def faults(self) -> int:
        """Number of things that are wrong with it."""
        turned = not np.array_equal(self.rotation, np.eye(3))
        return int(turned) + int(np.count_nonzero(self.flips < 0)) + int(self.gyro < 0)

    @property
    def axes(self) -> FloatArray:
        """Direction of each axis of the accelerometer in the robot, as the readings show it (3, 3)."""
        return self.flips[:, None] * self.rotation

    @property
    def upside_down(self) -> bool:
        """Whether the sensor's z axis points down because of the rotation."""
        return bool(self.rotation[2, 2] < 0)


@dataclass(frozen=True)
class MountingFit:
    """Which mounting fits.

    Attributes:
        best: it.
        lead: chi-square, with the cost of faults, by which it beats the next one of another meaning.
        against_sound: chi-square by which it beats the mounting that the map assumes, without costs.
        chi_square: what it leaves.
        responses: of sensor axes x, y, z (rows) to dv/dt, v w and gravity (columns), NaN where unknown.
        errors: their standard errors.
        gyro: gyro over the turn rate, and its standard error.
    """

    best: Mounting
    lead: float
    against_sound: float
    chi_square: float
    responses: FloatArray
    errors: FloatArray
    gyro: tuple[float, float]

    @property
    def decided(self) -> bool:
        """Whether the best mounting is the only one that fits."""
        return self.lead >= CLEAR and self.chi_square <= WORST_FIT


def fit_mounting(
    windows: MotionWindows, speed: FloatArray, acceleration: FloatArray, turn: tuple[FloatArray, FloatArray],
    rng: np.random.Generator,
) -> MountingFit | None:  # fmt: skip
    """The mounting that explains the IMU's answers to motion and gravity.

    Args:
        windows: of the drive.
        speed: along the robot's x axis (n,) [m/s].
        acceleration: dv/dt (n,) [m/s^2].
        turn: yaw rate and its change, from anything but the IMU's sign (n,) [rad/s], [rad/s^2].
        rng: of the resampling.

    Returns:
        None with fewer than five blocks of motion.
    """
    rate, change = turn
    moving = (np.abs(speed) > STILL_TRAVEL) | (np.abs(rate) > LEAST_TURN)
    turns = enough_turns(rate, moving, 0.5 * STEP)
    motion = [acceleration, speed * rate, rate, rate**2, change] if turns else [acceleration]
    design = np.stack([np.ones_like(speed), *motion], axis=1)
    known = np.all(np.isfinite(design), axis=1) & np.all(np.isfinite(windows.force[:, :2]), axis=1)
    targets = [*windows.force.T, windows.turn[GYRO] / STEP]
    measured = [bool(np.any(np.isfinite(y[known]))) for y in targets]
    rows = [np.flatnonzero(known & (windows.block == k)) for k in np.unique(windows.block[known])]
    sums = [[normal_equations(design[r], np.nan_to_num(y[r])) for y in targets] for r in rows if r.size > 5]
    if len(sums) < FEWEST_BLOCKS:
        return None
    values, resampled = resample(np.array(sums), _answers, rng)
    if not np.all(np.isfinite(values)) or np.isfinite(resampled).mean() < 0.9:
        return None
    errors = np.nanstd(resampled, axis=0)
    errors[~np.repeat([*measured[:3], turns and measured[3]], [3, 3, 3, 1])] = np.inf
    if not turns:
        errors[[1, 4, 7]] = np.inf
    return _best(values, errors)


def _answers(totals: FloatArray) -> FloatArray:
    """Responses of x, y, z to dv/dt, v w and gravity, and the gyro's scale (m, 10) from (m, 4, k, k + 1) sums.

    Coefficients of turning are 0 where the sums hold none.
    """
    m, targets, size = totals.shape[:3]
    found = np.zeros((m, targets, 4))
    found[..., : min(size, 4)] = solve(totals.reshape(m * targets, size, size + 1)).reshape(m, targets, size)[..., :4]
    gravity = found[:, :3, 0] / STANDARD_GRAVITY
    forces = np.stack([found[:, :3, 1], found[:, :3, 2], gravity], axis=-1)
    return np.concatenate([forces.reshape(m, 9), found[:, 3, 3:]], axis=1)


def rotations() -> list[FloatArray]:
    """The 24 rotations by right angles (3, 3), the identity first."""
    found = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            if np.linalg.det(matrix) > 0:
                found.append(matrix)
    return found


def mountings() -> list[Mounting]:
    """Every rotation with every combination of wrong signs, (24 x 8 x 2)."""
    flips = [np.array(signs) for signs in itertools.product((1.0, -1.0), repeat=3)]
    return [Mounting(r, f, g) for r in rotations() for f in flips for g in (1.0, -1.0)]


def _best(values: FloatArray, errors: FloatArray) -> MountingFit:
    """The mounting of least chi-square and cost."""
    spread = np.array([RESPONSE_SPREAD, RESPONSE_SPREAD, GRAVITY_SPREAD] * 3 + [GYRO_SPREAD])
    weight = 1.0 / (errors**2 + spread**2)
    every = mountings()
    predicted = np.array([_predicted(mounting) for mounting in every])
    chi_square = np.sum(weight * (values - predicted) ** 2, axis=1)
    cost = chi_square + COST_OF_A_FAULT * np.array([mounting.faults for mounting in every])
    first = int(np.argmin(cost))
    # Mountings of one cause or none are one meaning only where they predict the same readings.
    other = np.any(predicted[:, np.isfinite(errors)] != predicted[first, np.isfinite(errors)], axis=1)
    sound = next(i for i, mounting in enumerate(every) if not mounting.faults)
    known = np.where(np.isfinite(errors), values, np.nan)
    return MountingFit(
        best=every[first],
        lead=float(np.min(cost[other]) - cost[first]),
        against_sound=float(chi_square[sound] - chi_square[first]),
        chi_square=float(chi_square[first]),
        responses=known[:9].reshape(3, 3),
        errors=errors[:9].reshape(3, 3),
        gyro=(float(known[9]), float(errors[9])),
    )


def _predicted(mounting: Mounting) -> FloatArray:
    """Responses and gyro scale (10,) of a mounting."""
    forces = mounting.axes * np.array([RESPONSE, RESPONSE, 1.0])
    return np.append(forces.ravel(), mounting.gyro * mounting.rotation[2, 2])
