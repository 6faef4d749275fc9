"""Where gravity points in the accelerometer while the robot stands, and how that goes with heading.

Level ground gives f = (0, 0, 9.8). A slope turns with the heading, a bias or a tilted sensor does not: over rests at
several headings, ``f_x = s_x cos yaw + s_y sin yaw + b_x`` and ``f_y = -s_x sin yaw + s_y cos yaw + b_y``, separate the
slope's pull s (world) from the sensor's offset b (body). Absolute roll and pitch, where recorded, give the slope; exact
zeros throughout are those of a planar pose, which measures neither.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from ddagr_gym.parameters import STANDARD_GRAVITY
from ddagr_gym.recordings.checks.blocks import CONFIDENCE, mean_interval
from ddagr_gym.recordings.checks.findings import CheckFinding, Interval, Question, not_testable
from ddagr_gym.recordings.checks.signals import filled, standstills
from ddagr_gym.recordings.schema import FloatArray, Recording

CHECK = "gravity"

NORM = Question(CHECK, (9.5, 10.1), "m/s^2", "Check the accelerometer's unit and scale.", ("accelerometer_bias",))
"""Size of the specific force at rest [m/s^2]: 9.76 to 9.83 on Earth, 2 % for the sensor's scale."""
OFFSET = Question(
    CHECK,
    (-0.25, 0.25),
    "m/s^2",
    "Subtract the offset, or fit accelerometer_bias or imu_tilt.",
    ("accelerometer_bias", "imu_tilt"),
)
"""Offset of a horizontal axis that does not turn with heading [m/s^2]: 1.5 degrees of mounting; 0.1 on the
open recordings."""
TILT = Question(
    CHECK,
    (0.0, 1.2),
    "m/s^2",
    "Let the robot stand at four headings on one spot.",
    ("imu_tilt", "accelerometer_bias", "slope"),
)
"""Horizontal specific force at a single heading [m/s^2]: 7 degrees of slope and mounting together."""
HEADING_SPREAD = 0.8
"""Length of the mean heading vector [-] above which headings count as one."""


@dataclass(frozen=True)
class Rest:
    """One standstill: mean specific force (3,) [m/s^2], heading, roll, pitch [rad], NaN where unknown, and its span."""

    force: FloatArray
    heading: float
    roll: float
    pitch: float
    span: int


def rests(recording: Recording) -> list[Rest]:
    """Standstills with their mean specific force and attitude."""
    starts = [s.start for s in recording.spans()]
    attitude = {name: filled(recording, name) for name in ("pose_yaw", "roll", "pitch")}
    found = []
    for piece in standstills(recording):
        force = np.array([_mean(recording[f"specific_force_{axis}"][piece]) for axis in "xyz"])
        # A heading may not be averaged across its jump; the robot stands, so its last value serves.
        heading, roll, pitch = (float(attitude[name][piece.stop - 1]) for name in ("pose_yaw", "roll", "pitch"))
        if np.all(np.isfinite(force[:2])):
            found.append(Rest(force, heading, roll, pitch, int(np.searchsorted(starts, piece.start, side="right"))))
    return found


def _mean(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else float("nan")


def gravity(recording: Recording) -> list[CheckFinding]:
    """Findings on size and direction of the specific force at rest."""
    found = rests(recording)
    if not found:
        why = "The robot never stands with an accelerometer."
        return [not_testable(CHECK, "specific_force", why, "Let the robot stand at several headings.")]
    forces = np.array([r.force for r in found])
    findings = []
    if np.any(np.isfinite(forces[:, 2])):
        findings.append(_norm(np.linalg.norm(forces, axis=1)))
    return findings + _direction(recording, found)


def _norm(norms: FloatArray) -> CheckFinding:
    size, interval = mean_interval(norms)
    if norms.size < 2:
        interval = (size, size)
    return NORM.answer(
        "specific_force, size", size, interval, meaning=f"At rest the specific force is {size:.3f} m/s^2."
    )


def _direction(recording: Recording, found: list[Rest]) -> list[CheckFinding]:
    absolute = len(recording.meta.spans) == 1 and all(np.isfinite([r.roll, r.pitch]).all() for r in found)
    absolute = absolute and bool(np.nan_to_num([recording["roll"], recording["pitch"]]).any())
    if absolute and len(found) >= 2:
        return offset_findings(*offset_by_attitude(found), "against the pose's roll and pitch", len(found))
    by_heading = offset_by_heading(found)
    if by_heading is not None:
        return offset_findings(*by_heading, "over rests at several headings", len(found))
    return [_single_heading(found)]


def offset_by_attitude(found: list[Rest]) -> tuple[FloatArray, list[Interval]]:
    """Body-fixed offset (x, y) [m/s^2] against gravity by roll and pitch, with Student intervals over the rests.

    At rest f = g (-sin pitch, sin roll cos pitch, cos roll cos pitch).
    """
    g = STANDARD_GRAVITY
    x = np.array([r.force[0] + g * np.sin(r.pitch) for r in found])
    y = np.array([r.force[1] - g * np.sin(r.roll) * np.cos(r.pitch) for r in found])
    pairs = [mean_interval(x), mean_interval(y)]
    return np.array([p[0] for p in pairs]), [p[1] for p in pairs]


def offset_by_heading(found: list[Rest]) -> tuple[FloatArray, list[Interval]] | None:
    """Body-fixed offset (x, y) [m/s^2] apart from a slope common to all rests; None where headings are alike."""
    spans = [r.span for r in found if np.isfinite(r.heading)]
    usable = [r for r in found if np.isfinite(r.heading) and r.span == max(set(spans), key=spans.count)]
    if len(usable) < 4:
        return None
    yaw = np.array([r.heading for r in usable])
    if abs(np.mean(np.exp(1j * yaw))) > HEADING_SPREAD:
        return None
    zero, one, cos, sin = np.zeros_like(yaw), np.ones_like(yaw), np.cos(yaw), np.sin(yaw)
    design = np.concatenate([np.stack([cos, sin, one, zero], axis=1), np.stack([-sin, cos, zero, one], axis=1)])
    force = np.concatenate([[r.force[0] for r in usable], [r.force[1] for r in usable]])
    values, _, _, _ = np.linalg.lstsq(design, force, rcond=None)
    freedom = force.size - 4
    variance = float(np.sum((force - design @ values) ** 2)) / freedom
    half = stdtrit(freedom, (1 + CONFIDENCE) / 2) * np.sqrt(variance * np.diag(np.linalg.inv(design.T @ design)))
    return values[2:], [(float(v - h), float(v + h)) for v, h in zip(values[2:], half[2:], strict=True)]


def offset_findings(values: FloatArray, intervals: list[Interval], how: str, count: int) -> list[CheckFinding]:
    """Findings on a body-fixed offset.

    Args:
        values: (2,) x and y [m/s^2].
        intervals: of both.
        how: words on what it was found by.
        count: number of rests.
    """
    return [
        OFFSET.answer(
            f"specific_force_{axis}",
            float(value),
            interval,
            meaning=f"At rest it is off by {value:.3f} m/s^2 {how} ({count} rests).",
        )
        for axis, value, interval in zip("xy", values, intervals, strict=True)
    ]


def _single_heading(found: list[Rest]) -> CheckFinding:
    tilts = np.array([np.hypot(*r.force[:2]) for r in found])
    tilt, interval = mean_interval(tilts)
    if tilts.size < 2:
        interval = (tilt, tilt)
    return TILT.answer(
        "specific_force, direction",
        tilt,
        interval,
        meaning=f"At rest {tilt:.3f} m/s^2 lie in the horizontal axes; without rests at several headings a slope, a "
        "tilted sensor and a bias cannot be distinguished.",
    )
