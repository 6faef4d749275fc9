"""Signs and scales of what measures travel: pose against encoders."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ddagr_gym.recordings.checks.clock_offsets import gyro_direction, known_lag, pose_offset, unwrapped_heading
from ddagr_gym.recordings.checks.findings import CheckFinding, Question, not_testable
from ddagr_gym.recordings.checks.regression import Estimate, blocks_in_spans, estimate, inside, sampled
from ddagr_gym.recordings.checks.signals import filled, integral
from ddagr_gym.recordings.schema import FloatArray, Recording

CHECK = "sign_and_scale"

TRAVEL = Question(
    CHECK,
    (0.2, 1.05),
    "-",
    "Check the encoders' sign and unit, the wheel radius, and the pose's unit.",
    ("encoder_scale",),
)
"""Travelled over rolled distance [-]: 1 without slip, little on ice; more than 1 only when pushed or with a wrong
radius or scale."""
COHERENCE = Question(
    "coherence",
    (0.6, 1.0),
    "-",
    "Check the signs of the pose's axes and heading, the encoders' signs, and the clocks.",
    ("encoder_scale", "gyro_sign", "pose_latency"),
)
"""Cosine between rolled and travelled paths [-]: 0.95 to 0.99 on the open recordings, 0.3 at most with a
mirrored axis."""
DIRECTION = Question(
    "direction",
    (-0.12, 0.12),
    "rad",
    "Check the heading's zero, sign and frame against REP 103; a steady side slope makes robots crab.",
    ("slope",),
)
"""Direction of travel against the pose's heading [rad] (7 degrees): skid-steer robots travel where they point."""
WINDOW = 2.0
"""Time over which distances are compared [s]."""
LEAST_SLIPPING = 0.1
"""Share of the windows that counts as those that slip least (ours)."""
LEAST_SLIP = (0.97, 1.17)
"""Travelled over rolled distance where a sound robot slips least [-] (ours): 0.99 to 1.17 in three minutes of six
ordinary drives, 0.97 on simulated ice."""
Vectors = tuple[FloatArray, FloatArray]
"""Rolled and travelled vectors, (2, n) each."""
_TRAVEL_CHANNELS = ("pose_x", "pose_y", "pose_yaw", "yaw_rate", "encoder_right", "encoder_left")


def travel(recording: Recording, rng: np.random.Generator) -> list[CheckFinding]:
    """Findings on pose against encoders.

    Args:
        recording: any; distances are not testable without the robot's wheel radius.
        rng: for the resampling.
    """
    pair = "encoder to pose"
    found = travelled_over_rolled(recording, rng)
    if found is None:
        missing = recording.meta.geometry is None
        why = "The robot's wheel radius is not known." if missing else "There is no travel with a pose to compare."
        return [
            not_testable(CHECK, pair, why, "Name the robot with --robot." if missing else "Record poses while driving.")
        ]
    along, _, coherence = (float(v) for v in found.values)
    return [
        TRAVEL.answer(
            pair, along, found.intervals[0], meaning=f"The pose travels {along:.3f} of what the wheels roll."
        ),
        _direction_finding(found),
        COHERENCE.answer(
            pair,
            coherence,
            found.intervals[2],
            meaning=f"Rolled and travelled paths agree by {coherence:.2f}, 1 being along each other at all times.",
        ),
    ]


def travelled_over_rolled(recording: Recording, rng: np.random.Generator) -> Estimate | None:
    """:func:`travelled_shares` of a drive; None also without pose, gyro or the robot's geometry."""
    return travelled_shares(rolled_and_travelled(recording, rng), rng)


def travelled_shares(vectors: Sequence[Vectors], rng: np.random.Generator) -> Estimate | None:
    """Travelled over rolled distance as forward and sideways shares, and their coherence, (3,).

    Coherence is the cosine between both paths, weighted by length: 1 where every rolled piece is travelled in its
    direction in one proportion.

    Args:
        vectors: of the blocks of a drive.
        rng: for the resampling of the blocks.

    Returns:
        None without motion.
    """
    sums = [_moments(*pair) for pair in vectors]
    return estimate([s for s in sums if s[2] > 0 and s[3] > 0], _shares, rng)


def share_with_least_slip(vectors: Sequence[Vectors], wheel_radius: float) -> float | None:
    """Travelled over rolled distance where the robot slips least: in the best tenth of the longer half of windows [-].

    It is near 1 on any ground, on ice too, where the wheels mostly spin: some windows are gentle. A wrong wheel radius
    changes it as much as all others. In windows in which the robot hardly gets on, it is noise.

    Args:
        vectors: of the blocks of a drive.
        wheel_radius: that windows must roll at least [m].

    Returns:
        None without motion.
    """
    pairs = [np.zeros((2, 0))]
    pairs += [np.stack([np.hypot(*rolled), np.hypot(*travelled)]) for rolled, travelled in vectors]
    rolled, travelled = np.concatenate(pairs, axis=1)
    known = np.isfinite(travelled) & (rolled > wheel_radius)
    if not known.any():
        return None
    far = known & (rolled >= np.median(rolled[known]))
    return float(np.quantile(travelled[far] / rolled[far], 1.0 - LEAST_SLIPPING))


def drive_share_with_least_slip(recording: Recording, rng: np.random.Generator) -> float | None:
    """:func:`share_with_least_slip` of a drive; None also without pose, gyro or the robot's geometry."""
    geometry = recording.meta.geometry
    if geometry is None:
        return None
    return share_with_least_slip(rolled_and_travelled(recording, rng), geometry.wheel_radius)


def rolled_and_travelled(recording: Recording, rng: np.random.Generator) -> list[Vectors]:
    """Rolled and travelled vectors of a drive over :data:`WINDOW` in the pose's frame, block by block.

    The rolled path is the wheel radius times the banks' mean speed, laid along the gyro's heading; the pose's clock is
    matched to it.

    Args:
        recording: any; without pose, gyro, encoders or the robot's geometry there are none.
        rng: for the resampling behind the clocks' offset.
    """
    geometry = recording.meta.geometry
    if geometry is None or not recording.has(*_TRAVEL_CHANNELS):
        return []
    lag = known_lag(pose_offset(recording, rng))
    speed = 0.5 * geometry.wheel_radius * (filled(recording, "encoder_right") + filled(recording, "encoder_left"))
    heading = gyro_direction(recording) * integral(recording, recording["yaw_rate"])
    rolled = [integral(recording, speed * np.cos(heading)), integral(recording, speed * np.sin(heading))]
    pose_heading = unwrapped_heading(recording)
    vectors = []
    for span, block in blocks_in_spans(recording):
        rows = block.start + np.flatnonzero(np.isfinite(pose_heading[block]))
        at = recording.t[rows] - lag
        rows, at = rows[inside(recording, span, at)], at[inside(recording, span, at)]
        path = np.stack([sampled(recording, span, component, at) for component in rolled])
        turn = pose_heading[rows] - sampled(recording, span, heading, at)
        position = np.stack([recording["pose_x"][rows], recording["pose_y"][rows]])
        vectors.append(_over_windows(at, path, position, turn))
    return vectors


def _over_windows(at: FloatArray, path: FloatArray, position: FloatArray, turn: FloatArray) -> Vectors:
    """Rolled and travelled vectors (2, n) over windows.

    Args:
        at: times of the poses (n,) [s].
        path: rolled position (2, n) in the gyro's frame.
        position: pose (2, n).
        turn: heading of the pose's frame against the gyro's (n,) [rad].
    """
    end = np.searchsorted(at, at + WINDOW)
    first = np.flatnonzero(end < len(at))
    last = end[first]
    angle = 0.5 * (turn[first] + turn[last])
    dx, dy = path[:, last] - path[:, first]
    rolled = np.stack([np.cos(angle) * dx - np.sin(angle) * dy, np.sin(angle) * dx + np.cos(angle) * dy])
    return rolled, position[:, last] - position[:, first]


def _moments(rolled: FloatArray, travelled: FloatArray) -> FloatArray:
    """Sums of rolled and travelled vectors: along, across, squared rolled and travelled length."""
    along = np.sum(rolled * travelled)
    across = np.sum(rolled[0] * travelled[1] - rolled[1] * travelled[0])
    moments = np.array([along, across, np.sum(rolled**2), np.sum(travelled**2)])
    return moments if np.all(np.isfinite(moments)) else np.zeros(4)


def _shares(totals: FloatArray) -> FloatArray:
    along, across, rolled, travelled = totals.T
    return np.stack([along / rolled, across / rolled, along / np.sqrt(rolled * travelled)], axis=1)


def _direction_finding(found: Estimate) -> CheckFinding:
    """Whether the robot travels where the pose says that it points."""
    along, across, _ = (float(v) for v in found.values)
    angle = float(np.arctan2(across, along))
    low, high = found.intervals[1]
    spread = max(abs(along), 1e-3)
    return DIRECTION.answer(
        "pose",
        angle,
        (angle + (low - across) / spread, angle + (high - across) / spread),
        meaning=f"The robot travels {angle:.3f} rad to the left of the pose's heading.",
    )
