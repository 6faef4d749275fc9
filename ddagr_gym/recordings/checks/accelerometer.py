"""Signs, scale and mounting angle of the accelerometer, from driving.

On level ground the specific force is f_x = dv/dt and f_y = v w, besides lever-arm terms in w^2 and dw/dt. Least squares
of the smoothed forces on (dv/dt, v w, w^2, dw/dt, 1) with v from the encoders gives a 2 x 2 block that is the identity
for a sound sensor, a rotation for one that is mounted askew, and has a negative entry for a flipped axis.
"""

from __future__ import annotations

import numpy as np

from ddagr_gym.recordings.checks.clock_offsets import encoder_lag, encoder_offset
from ddagr_gym.recordings.checks.findings import CheckFinding, Interval, Question, judge, not_testable
from ddagr_gym.recordings.checks.regression import (
    MOST_INFLATION,
    Estimate,
    blocks_in_spans,
    estimate,
    inflation,
    sampled,
    solve,
)
from ddagr_gym.recordings.checks.signals import filled, slope, smoothed
from ddagr_gym.recordings.checks.silences import heard_spans
from ddagr_gym.recordings.schema import FloatArray, Recording

CHECK = "accelerometer"

FORWARD_RANGE = (0.2, 1.6)
"""Coefficient of dv/dt in f_x [-]; slip while accelerating lowers it (1.0 to 1.2 on the open recordings)."""
SIDEWAYS_RANGE = (0.2, 1.6)
"""Coefficient of v w in f_y [-]; slip lowers it (0.8 to 1.0 on the open recordings)."""
MOUNTING = Question(
    "mounting",
    (-0.1, 0.1),
    "rad",
    "Rotate the accelerometer's axes by this angle, or fit imu_misalignment.",
    ("imu_misalignment", "accelerometer_sign"),
)
"""Mounting angle about z [rad] (6 degrees)."""
OFFSET = Question(
    "offset",
    (-0.9, 0.9),
    "m/s^2",
    "A slope, a tilted sensor or a bias: compare rests at several headings.",
    ("imu_tilt", "accelerometer_bias", "slope"),
)
"""Mean of a horizontal axis while driving that no motion explains [m/s^2]: 5 degrees; up to 0.5 on the open sand."""
WIDEST = 1.0
"""Half width of an interval [-] beyond which a coefficient counts as not testable."""
WIDEST_ANGLE = 0.15
"""The same for the mounting angle [rad]."""
WINDOW = 0.75
"""Smoothing of forces and speeds [s], three times the slowest encoder's period."""


def accelerometer(recording: Recording, rng: np.random.Generator) -> list[CheckFinding]:
    """Findings on the accelerometer's axes.

    Args:
        recording: any; not testable without the robot's wheel radius.
        rng: for the resampling.
    """
    if recording.meta.geometry is None:
        return [not_testable(CHECK, "specific_force", "The wheel radius is not known.", "Name the robot with --robot.")]
    found = force_coefficients(recording, rng)
    if found is None:
        why = "There is too little accelerating and turning with encoders and accelerometer."
        return [not_testable(CHECK, "specific_force", why, "Drive arcs at speed, with starts and stops.")]
    forward, sideways, angle, offset_x, offset_y = (float(v) for v in found.values)
    return [
        _coefficient("specific_force_x", "dv/dt of the encoders", forward, found.intervals[0], FORWARD_RANGE),
        _coefficient("specific_force_y", "speed times yaw rate", sideways, found.intervals[1], SIDEWAYS_RANGE),
        _mounting(angle, found.intervals[2]),
        _offset("specific_force_x", offset_x, found.intervals[3]),
        _offset("specific_force_y", offset_y, found.intervals[4]),
    ]


def force_coefficients(recording: Recording, rng: np.random.Generator) -> Estimate | None:
    """Coefficient of dv/dt in f_x, of v w in f_y, mounting angle about z [rad], offsets of f_x and f_y [m/s^2], (5,).

    None too where the robot only accelerates as it begins to turn, so that a lever arm explains the same. The angle is
    that of the rotation nearest to the 2 x 2 block, positive when the sensor is turned to the left.
    """
    geometry = recording.meta.geometry
    needed = ("encoder_right", "encoder_left", "yaw_rate", "specific_force_x", "specific_force_y")
    if geometry is None or not recording.has(*needed):
        return None
    columns = _regressors_and_forces(recording, geometry.wheel_radius, rng)
    usable = np.all(np.isfinite(columns), axis=1)
    sums = []
    for _, block in blocks_in_spans(recording):
        rows = columns[block][usable[block]]
        if len(rows) > 10:
            sums.append(rows[:, :5].T @ rows)
    if sums and inflation(sums, constant=4)[0] > MOST_INFLATION:
        return None
    return estimate(sums, _values, rng)


def _regressors_and_forces(recording: Recording, wheel_radius: float, rng: np.random.Generator) -> FloatArray:
    """Columns dv/dt, v w, w^2, dw/dt, 1, f_x, f_y (n, 7), each a running mean over :data:`WINDOW`."""
    offset = encoder_offset(recording, rng)
    lag = encoder_lag(offset)
    v = _advanced(
        recording, 0.5 * wheel_radius * (filled(recording, "encoder_right") + filled(recording, "encoder_left")), lag
    )
    w = recording["yaw_rate"]
    mean = [smoothed(recording, values, WINDOW) for values in (v, v * w, w**2, w)]
    forces = [smoothed(recording, recording[f"specific_force_{axis}"], WINDOW) for axis in "xy"]
    dv, dw = slope(recording, mean[0]), slope(recording, mean[3])
    return np.stack([dv, mean[1], mean[2], dw, np.ones(len(recording)), *forces], axis=1)


def _advanced(recording: Recording, values: FloatArray, lag: float) -> FloatArray:
    """Values read ``lag`` later, so that a late channel is at its true time; the last value is repeated."""
    out = np.full(len(recording), np.nan)
    for span in heard_spans(recording):
        out[span] = sampled(recording, span, values, recording.t[span] + lag)
    return out


def _values(totals: FloatArray) -> FloatArray:
    """Coefficients, angle and offsets (m, 5) from stacked (5, 7) sums."""
    on_x = solve(totals[:, :, :6])
    on_y = solve(np.concatenate([totals[:, :, :5], totals[:, :, 6:]], axis=2))
    angle = np.arctan2(on_x[:, 1] - on_y[:, 0], on_x[:, 0] + on_y[:, 1])
    return np.stack([on_x[:, 0], on_y[:, 1], angle, on_x[:, 4], on_y[:, 4]], axis=1)


def _coefficient(channel: str, motion: str, value: float, interval: Interval, expected: Interval) -> CheckFinding:
    if not interval[1] - interval[0] <= 2 * WIDEST:
        why = f"Its response to {motion} is uncertain by {interval[1] - interval[0]:.2g}."
        return not_testable(CHECK, channel, why, "Drive arcs at speed, with starts and stops.")
    return judge(
        CHECK,
        channel,
        value,
        interval,
        expected,
        "-",
        meaning=f"It shows {value:.3f} times {motion}.",
        remedy="Correct the axis's sign or unit in the map; REP 103: x forward, y left, gravity as +9.8 in z.",
        suspects=("accelerometer_sign", "imu_misalignment") if value < 0 else ("imu_misalignment",),
    )


def _mounting(angle: float, interval: Interval) -> CheckFinding:
    if not interval[1] - interval[0] <= 2 * WIDEST_ANGLE:
        why = f"The mounting angle is uncertain by {interval[1] - interval[0]:.2g} rad."
        return not_testable("mounting", "specific_force", why, "Drive arcs at speed, with starts and stops.")
    return MOUNTING.answer(
        "specific_force", angle, interval, meaning=f"The accelerometer looks {angle:.3f} rad to the left of forward."
    )


def _offset(channel: str, offset: float, interval: Interval) -> CheckFinding:
    return OFFSET.answer(
        channel,
        offset,
        interval,
        meaning=f"While driving it is off by {offset:.3f} m/s^2 beyond what the motion explains.",
    )
