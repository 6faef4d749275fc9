"""Signs and scales of what measures turning: gyro, pose and the encoders' difference."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ddagr_gym.recordings.checks.clock_offsets import (
    encoder_lag,
    encoder_offset,
    known_lag,
    pose_offset,
    unwrapped_heading,
)
from ddagr_gym.recordings.checks.findings import CheckFinding, Question, Status, not_testable
from ddagr_gym.recordings.checks.regression import (
    MOST_INFLATION,
    Estimate,
    blocks_in_spans,
    estimate,
    inflation,
    inside,
    normal_equations,
    sampled,
    solve,
)
from ddagr_gym.recordings.checks.signals import filled, integral, moving_mask, new_rows
from ddagr_gym.recordings.schema import BoolArray, FloatArray, Recording

CHECK = "sign_and_scale"

GYRO_SCALE = Question(CHECK, (0.95, 1.05), "-", "Correct the gyro's sign or scale in the map, or fit gyro_scale.")
"""Gyro over pose [-]; data sheets promise 3 % for low-cost gyros."""
GYRO_BIAS = Question("bias", (-0.02, 0.02), "rad/s", "Subtract the bias, or fit gyro_bias.", ("gyro_bias",))
"""Gyro bias against the pose [rad/s]: 70 degrees a minute is more than a zeroed low-cost gyro drifts."""
TRACK = Question(
    CHECK, (0.9, 6.0), "-", "Check the signs of gyro and encoders, whether the banks are swapped, and the units."
)
"""Effective over geometric track [-]: 1.3 to 1.9 for fielded skid-steer robots, more on loose ground and on ice;
never below 1."""
BALANCE = Question(
    "balance",
    (0.95, 1.055),
    "-",
    "Compare the banks' encoder scales and wheel radii; ground that differs by side does the same.",
    ("encoder_scale", "wheel_radius_mismatch", "soil_split", "centre_of_mass_offset"),
)
"""Right over left bank's share in the yaw rate [-]; 1 for equal radii, scales and ground, 1.02 to 1.04 on the open
recordings."""
LEAST_TURN = 0.05
"""Root mean square yaw rate of a moving robot below which turns tell nothing [rad/s]."""
LEAST_MOTION = 5.0
"""Time in motion from which standing does not count against the turns [s] (ours): less is a jerk or a gyro's spikes."""

APART = 1.0
"""Time between two headings by which a rate is told beside their noise [s] (ours)."""

BANKS = "encoder_right to encoder_left"
"""Channel of the findings on the share of each bank in the yaw rate."""
_DRIVE = "Drive turns to both sides at several speeds."


def turning(recording: Recording, rng: np.random.Generator) -> list[CheckFinding]:
    """Findings on gyro against pose and on encoders against gyro.

    Args:
        recording: any; what needs wheel radius and track is not testable without the robot.
        rng: for the resampling.
    """
    return [*against_poses(recording, rng), *_track_findings(recording, rng)]


def gyro_against_pose(recording: Recording, rng: np.random.Generator) -> Estimate | None:
    """Scale [-] and bias [rad/s] of the gyro, (2,): heading = (turned - bias t) / scale in each block, clocks matched.

    The heading is the target since its noise is the larger one: noise in a regressor makes its coefficient too small.

    Returns:
        None without poses or turns.
    """
    offset = pose_offset(recording, rng) if recording.has("pose_yaw", "yaw_rate") else None
    if offset is None:
        return None
    heading, turned = unwrapped_heading(recording), integral(recording, recording["yaw_rate"])
    sums = []
    for span, block in blocks_in_spans(recording):
        rows = block.start + np.flatnonzero(np.isfinite(heading[block]))
        at = recording.t[rows] - known_lag(offset)
        rows, at = rows[inside(recording, span, at)], at[inside(recording, span, at)]
        gyro = sampled(recording, span, turned, at)
        if rows.size >= 5 and np.all(np.isfinite(gyro)):
            design = np.stack([gyro, at], axis=1)
            sums.append(normal_equations(design - design.mean(axis=0), heading[rows] - heading[rows].mean()))

    def values(totals: FloatArray) -> FloatArray:
        turned, per_time = solve(totals).T
        return np.stack([1.0 / turned, -per_time / turned], axis=1)

    return estimate(sums, values, rng)


def effective_track(recording: Recording, rng: np.random.Generator) -> Estimate | None:
    """Effective over geometric track chi [-] and the right over the left bank's share in the yaw rate [-], (2,).

    Yaw rate = a right - b left + c by least squares with the encoders' clock matched. Without slip a = b = R/(2 W);
    chi = R/(W (a + b)), the share a/b. Where both banks do the same or the opposite throughout, a = b is presumed,
    and the interval of the share is infinite.

    Returns:
        None without encoders, gyro or the robot's geometry.
    """
    geometry = recording.meta.geometry
    if geometry is None or not recording.has("encoder_right", "encoder_left", "yaw_rate"):
        return None
    offset = encoder_offset(recording, rng)
    sums = _track_sums(recording, encoder_lag(offset))
    ratio = geometry.wheel_radius / geometry.half_track

    def of_banks(totals: FloatArray) -> FloatArray:
        a, b, _ = solve(totals).T
        return np.stack([ratio / (a + b), a / b], axis=1)

    def of_difference(totals: FloatArray) -> FloatArray:
        common = np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
        reduced = np.concatenate([common.T @ totals[..., :3] @ common, common.T @ totals[..., 3:]], axis=-1)
        a = solve(reduced)[:, 0]
        return np.stack([0.5 * ratio / a, np.ones(len(a))], axis=1)

    if sums and inflation(sums, constant=2)[0] > MOST_INFLATION:
        found = estimate(sums, of_difference, rng)
        return found and replace(found, intervals=(found.intervals[0], (-np.inf, np.inf)))
    return estimate(sums, of_banks, rng)


def _track_sums(recording: Recording, lag: float) -> list[FloatArray]:
    right, left = filled(recording, "encoder_right"), filled(recording, "encoder_left")
    usable = new_rows(recording, "encoder_right", "encoder_left") & np.isfinite(right) & np.isfinite(left)
    sums = []
    for span, block in blocks_in_spans(recording):
        rows = block.start + np.flatnonzero(usable[block])
        at = recording.t[rows] - lag
        rows, at = rows[inside(recording, span, at)], at[inside(recording, span, at)]
        gyro = sampled(recording, span, recording["yaw_rate"], at)
        if rows.size >= 5 and np.all(np.isfinite(gyro)):
            sums.append(normal_equations(np.stack([right[rows], -left[rows], np.ones(rows.size)], axis=1), gyro))
    return sums


def left_over_right(recording: Recording, rng: np.random.Generator) -> float | None:
    """Scale of the left encoder over that of the right one, by the turns of each [-]; 1 where they may be alike.

    Args:
        recording: any.
        rng: for the resampling.

    Returns:
        None where both banks do the same throughout, or without encoders, gyro or the robot's geometry.
    """
    track = track_in_turns(recording, rng)
    if track is None or not np.isfinite(track.intervals[1]).all():
        return None
    share, interval = float(track.values[1]), track.intervals[1]
    apart = BALANCE.answer(BANKS, share, interval, meaning="").status is Status.SUSPICIOUS
    return share if apart and interval[0] > 0.0 else 1.0


def track_in_turns(recording: Recording, rng: np.random.Generator) -> Estimate | None:
    """:func:`effective_track`; None also on a straight drive, where it is a ratio of noise to noise."""
    return effective_track(recording, rng) if turns(recording) else None


def turns(recording: Recording) -> bool:
    """Whether a drive turns enough to tell a scale by: as the gyro says, or poses and wheels together, against it."""
    if not recording.has("yaw_rate"):
        return False
    moving, period = moving_mask(recording), recording.period
    if enough_turns(recording["yaw_rate"], moving, period):
        return True
    rate, moved = _pose_rate(recording, moving)
    return enough_turns(rate, moved, APART) and enough_turns(_wheel_rate(recording), moving, period)


def enough_turns(rate: FloatArray, moving: BoolArray, period: float) -> bool:
    """Whether a yaw rate holds turns while the robot moves, however long it stands besides.

    Args:
        rate: (n,), NaN where it is not known [rad/s].
        moving: (n,) where the robot moves; all of the rate counts where that is shorter than :data:`LEAST_MOTION`.
        period: between the values [s].
    """
    known = np.isfinite(rate)
    driven = rate[known & moving]
    if driven.size * period < LEAST_MOTION:
        driven = rate[known]
    return bool(driven.size) and float(np.sqrt(np.mean(driven**2))) >= LEAST_TURN


def _pose_rate(recording: Recording, moving: BoolArray) -> tuple[FloatArray, BoolArray]:
    """Yaw rate by headings :data:`APART` apart [rad/s], and whether the robot moves at the later one of each two.

    A turn by more than half a round between two poses is lost.
    """
    rates, moved = [np.empty(0)], [np.empty(0, dtype=bool)]
    for span in recording.spans():
        rows = span.start + np.flatnonzero(np.isfinite(recording["pose_yaw"][span]))
        t, heading = recording.t[rows], np.unwrap(recording["pose_yaw"][rows])
        if rows.size >= 2:
            later = np.arange(t[0] + APART, t[-1], APART)
            rates.append(np.diff(np.interp(later, t, heading)) / APART)
            moved.append(moving[np.searchsorted(recording.t, later[1:])])
    return np.concatenate(rates), np.concatenate(moved)


def _wheel_rate(recording: Recording) -> FloatArray:
    """Yaw rate of wheels that roll without slip (n,) [rad/s]; unknown without the robot's geometry."""
    geometry = recording.meta.geometry
    if geometry is None:
        return np.full(len(recording), np.nan)
    difference = filled(recording, "encoder_right") - filled(recording, "encoder_left")
    return np.asarray(geometry.wheel_radius * difference / (2.0 * geometry.half_track))


def against_poses(recording: Recording, rng: np.random.Generator) -> list[CheckFinding]:
    """Findings on the gyro's scale and bias against the headings of the poses.

    Args:
        recording: any; not testable without turns or poses.
        rng: for the resampling.
    """
    pair = "yaw_rate to pose_yaw"
    found = gyro_against_pose(recording, rng) if turns(recording) else None
    if found is None:
        why = "There are no turns with a pose to hold the gyro against."
        return [not_testable(CHECK, pair, why, "Record a pose with heading. " + _DRIVE)]
    scale, bias = (float(v) for v in found.values)
    sign = "the wrong way" if scale < 0 else f"{scale:.3f} times what the pose turns"
    return [
        GYRO_SCALE.answer(
            pair,
            scale,
            found.intervals[0],
            meaning=f"The gyro turns {sign}.",
            suspects=("gyro_sign",) if scale < 0 else ("gyro_scale",),
        ),
        GYRO_BIAS.answer(
            pair, bias, found.intervals[1], meaning=f"The gyro drifts by {bias:.4f} rad/s against the pose."
        ),
    ]


def _track_findings(recording: Recording, rng: np.random.Generator) -> list[CheckFinding]:
    pair = "encoder to yaw_rate"
    found = track_in_turns(recording, rng)
    if found is None:
        missing = "The robot's wheel radius and track are not known." if recording.meta.geometry is None else ""
        why = missing or "Encoders and gyro share too few turns."
        return [not_testable(CHECK, pair, why, "Name the robot with --robot." if missing else _DRIVE)]
    chi, share = (float(v) for v in found.values)
    track = TRACK.answer(
        pair,
        chi,
        found.intervals[0],
        meaning=_track_sentence(chi),
        suspects=("gyro_sign",) if chi < 0 else ("gyro_scale", "encoder_scale"),
    )
    if not np.isfinite(found.intervals[1][0]):
        why = "Both banks do the same throughout, so that nothing tells what a turn of either does."
        return [track, not_testable(BALANCE.check, BANKS, why, _DRIVE)]
    meaning = f"A turn of the right wheels turns the robot {share:.3f} times as much as one of the left."
    return [track, BALANCE.answer(BANKS, share, found.intervals[1], meaning=meaning)]


def _track_sentence(chi: float) -> str:
    if chi < 0:
        return "The gyro turns against the encoders' difference."
    return f"The robot turns as if its track were {chi:.2f} times as wide as it is."
