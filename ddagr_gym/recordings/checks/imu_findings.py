"""What is said of the IMU's mounting: one finding, in words."""

from __future__ import annotations

import numpy as np

from ddagr_gym.recordings.checks.findings import CheckFinding, Question, Status, not_testable
from ddagr_gym.recordings.checks.imu_axes import CLEAR, WORST_FIT, Mounting, MountingFit
from ddagr_gym.recordings.checks.map_lines import Takes, map_lines
from ddagr_gym.recordings.schema import FloatArray

CHECK = "imu_mounting"
_CHANNEL = "specific_force and yaw_rate"
_AXES = ("forward", "left", "up")
_BACK = ("backward", "right", "down")
_MOTION = ("dv/dt", "v times yaw rate", "gravity")
_NAMES = ("specific_force_x", "specific_force_y", "specific_force_z")


def mounting_finding(fit: MountingFit | None) -> CheckFinding:
    """Finding on the mounting; suspicious where one other than the map's is the only one that fits.

    Args:
        fit: None where the drive cannot tell.
    """
    if fit is None:
        why = "There is too little accelerating that other sources vouch for to tell how the IMU is mounted."
        return not_testable(CHECK, _CHANNEL, why, "Drive arcs at speed, with starts and stops.")
    best = fit.best
    if fit.chi_square > WORST_FIT:
        why = f"No mounting by right angles explains it (chi-square {fit.chi_square:.0f} of 10 values)."
        return not_testable(CHECK, _CHANNEL, why, "See the mounting angle below, and look for a dead or scaled axis.")
    value, expected = fit.against_sound, (0.0, CLEAR)
    if not best.faults:
        meaning = f"It is mounted as the map says: {_evidence(fit)}."
        return Question(CHECK, expected, "-", "").answer(_CHANNEL, value, meaning=meaning)
    if fit.lead < CLEAR:
        why = f"{_words(best)} fits best, but not clearly (chi-square {fit.lead:.0f} ahead): {_evidence(fit)}."
        return not_testable(CHECK, _CHANNEL, why, "Drive arcs at speed, with starts and stops.")
    meaning = (
        f"{_words(best)}: {_evidence(fit)}; "
        f"chi-square is {value:.0f} less than as the map says, and the next mounting is {fit.lead:.0f} behind."
    )
    return CheckFinding(
        CHECK,
        _CHANNEL,
        Status.SUSPICIOUS,
        meaning,
        _remedy(best),
        value,
        (value, value),
        expected,
        "-",
        _suspects(best),
    )


def _words(mounting: Mounting) -> str:
    """What is wrong, in words."""
    parts = []
    if not np.array_equal(mounting.rotation, np.eye(3)):
        parts.append(f"the IMU is {turned_in_words(mounting.rotation)}")
    wrong = [name for name, flip in zip(_NAMES, mounting.flips, strict=True) if flip < 0]
    if mounting.gyro < 0:
        wrong.append("yaw_rate")
    if wrong:
        parts.append(f"{' and '.join(wrong)} {'has' if len(wrong) == 1 else 'have'} the wrong sign")
    sentence = ", and ".join(parts)
    return f"The{sentence[3:]}" if sentence.startswith("the ") else sentence


def turned_in_words(rotation: FloatArray) -> str:
    """A rotation by right angles in words."""
    angle = round(float(np.degrees(np.arccos(np.clip(0.5 * (np.trace(rotation) - 1), -1, 1)))))
    if rotation[2, 2] > 0:
        side = "" if angle == 180 else " to the left" if rotation[0, 1] > 0 else " to the right"
        return f"turned by {angle} degrees about the vertical{side}"
    if rotation[2, 2] < 0:
        axis = {1.0: "rolled over", -1.0: "pitched over"}.get(float(rotation[0, 0]), "and turned by 90 degrees")
        return f"upside down ({axis})"
    return f"on its side (its z axis points {_direction(rotation[2])})"


def _direction(axis: FloatArray) -> str:
    """Where a sensor's axis points in the robot."""
    k = int(np.argmax(np.abs(axis)))
    return (_AXES if axis[k] > 0 else _BACK)[k]


def _evidence(fit: MountingFit) -> str:
    """The responses that decide, with their standard errors."""
    said = []
    for k, motion in enumerate(_MOTION):
        known = np.isfinite(fit.errors[:, k])
        if known.any():
            axis = int(np.argmax(np.where(known, np.abs(np.nan_to_num(fit.responses[:, k])), -1.0)))
            value, error = fit.responses[axis, k], fit.errors[axis, k]
            said.append(f"{_NAMES[axis]} shows {value:.2f} of {motion} (standard error {error:.2g})")
    if np.isfinite(fit.gyro[1]):
        said.append(f"yaw_rate {fit.gyro[0]:.2f} of the turn rate ({fit.gyro[1]:.2g})")
    return ", ".join(said)


def mounting_takes(mounting: Mounting) -> Takes:
    """Which readings belong to each of the robot's axes.

    Args:
        mounting: of the IMU; of one on its side no recorded gyro axis points up, and the yaw rate stays as it is.
    """
    takes = {}
    for k, name in enumerate(_NAMES):
        sensor = int(np.argmax(np.abs(mounting.axes[:, k])))
        sign = float(np.sign(mounting.axes[sensor, k]))
        if sensor != k or sign < 0:
            takes[name] = (_NAMES[sensor], sign)
    if mounting.gyro * mounting.rotation[2, 2] < 0:
        takes["yaw_rate"] = ("yaw_rate", -1.0)
    return takes


def _remedy(mounting: Mounting) -> str:
    """Which readings the map has to take for each of the robot's axes."""
    beside = " For yaw_rate take the gyro's axis that points up." if mounting.rotation[2, 2] == 0 else ""
    return f"{map_lines(mounting_takes(mounting))}{beside}"


def _suspects(mounting: Mounting) -> tuple[str, ...]:
    suspects = ["imu_misalignment"] if not np.array_equal(mounting.rotation, np.eye(3)) else []
    suspects += ["accelerometer_sign"] if np.any(mounting.axes.diagonal() < 0) else []
    suspects += ["gyro_sign"] if mounting.gyro * mounting.rotation[2, 2] < 0 else []
    return tuple(suspects)
