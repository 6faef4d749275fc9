"""How far each source says that the robot moved and turned, in short windows on one clock.

Three instants a time :data:`STEP` apart make a window. Turning is known to the gyro, the pose's heading, the direction
in which the pose's position moves, the encoders' and the commands' difference, and the sideways specific force
(centripetal: f_y = v w). Driving forward is known to the encoders' and the commands' mean, the pose and the forward
specific force (f_x = dv/dt). Clocks are matched by the offsets of :mod:`.clock_offsets` first.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ddagr_gym.recordings.checks.blocks import cut_blocks
from ddagr_gym.recordings.checks.clock_offsets import (
    ENCODER,
    POSE,
    RESPONSE,
    Offset,
    encoder_lag,
    known_lag,
    unwrapped_heading,
)
from ddagr_gym.recordings.checks.signals import filled, integral, wrap
from ddagr_gym.recordings.checks.silences import heard_spans
from ddagr_gym.recordings.checks.timing import LONGEST_HOLE
from ddagr_gym.recordings.schema import FloatArray, Recording, cut_at_gaps

STEP = 0.75
"""Half a window [s] (ours): three periods of encoders at 4 Hz, and less than half a turn at 4 rad/s."""
LEAST_TRAVEL = 0.15
"""Distance in a half window from which the pose's positions show a direction [m] (ours): ten times the scatter of a
good lidar pose."""
LARGEST_TURN = 2.0
"""Change of the travel's direction within half a window beyond which it may be a reversal [rad] (ours)."""

GYRO, HEADING, COURSE, ENCODERS, COMMANDS, FORCE = "gyro", "heading", "course", "encoders", "commands", "force"
POSITION = "position"


@dataclass(frozen=True)
class MotionWindows:
    """Motion in windows (n,), NaN where a source does not know it.

    Attributes:
        block: number of the block of the drive that holds the window.
        turn: angle turned in half a window, by source [rad].
        forward: distance driven in half a window, by source [m].
        turn_change: angular acceleration, by source [rad/s^2].
        forward_change: dv/dt, by source [m/s^2].
        force: specific force on the axes x, y, z, under the weights of the changes (n, 3) [m/s^2].
        banks: distance rolled in half a window by right and left wheels, as encoders and as commands say, (n, 2) [m].
        half_track: of the robot [m].
    """

    block: FloatArray
    turn: Mapping[str, FloatArray]
    forward: Mapping[str, FloatArray]
    turn_change: Mapping[str, FloatArray]
    forward_change: Mapping[str, FloatArray]
    force: FloatArray
    banks: Mapping[str, FloatArray]
    half_track: float


def motion_windows(recording: Recording, offsets: Mapping[str, Offset | None]) -> MotionWindows | None:
    """Windows of a drive; None without the robot's geometry or where no stretch without a gap holds one.

    Args:
        recording: any.
        offsets: of the clocks, by pair.
    """
    geometry, pieces = recording.meta.geometry, stretches(recording)
    instants, block = _in_blocks(recording, _instants(recording, pieces))
    if geometry is None or not len(instants):
        return None
    late = {pair: (encoder_lag if pair == ENCODER else known_lag)(found) for pair, found in offsets.items()}
    sample = _Sampler(recording, pieces, instants)
    rolled = {s: geometry.wheel_radius * r for s, r in _rolled(recording, sample, late).items()}
    heading = sample.values(unwrapped_heading(recording), late[POSE])
    position = np.stack([sample.values(recording[f"pose_{axis}"], late[POSE]) for axis in "xy"], axis=-1)
    angles = {GYRO: sample.integral(recording["yaw_rate"], 0.0), HEADING: heading}
    angles |= {source: (r[..., 0] - r[..., 1]) / (2 * geometry.half_track) for source, r in rolled.items()}
    paths = {source: r.mean(axis=-1) for source, r in rolled.items()}
    force = [_second(sample.double_integral(recording[f"specific_force_{axis}"])) for axis in "xyz"]
    return MotionWindows(
        block=block,
        turn={source: _first(angle) for source, angle in angles.items()} | {COURSE: _course(position)},
        forward={source: _first(path) for source, path in paths.items()} | {POSITION: _along(position, heading[:, 1])},
        turn_change={source: _second(angle) for source, angle in angles.items()},
        forward_change={s: _second(path) for s, path in paths.items()} | {POSITION: _change(position, heading)},
        force=np.stack(force, axis=1),
        banks={source: _first(r) for source, r in rolled.items()},
        half_track=geometry.half_track,
    )


def _rolled(recording: Recording, sample: _Sampler, late: Mapping[str, float]) -> dict[str, FloatArray]:
    """Angles that right and left wheels have rolled, as encoders and as commands say, (n, 3, 2) [rad]."""
    encoder = late[ENCODER]
    speeds = [filled(recording, f"encoder_{bank}") for bank in ("right", "left")]
    both = ((ENCODERS, speeds, encoder), (COMMANDS, recording.held_commands(), encoder - late[RESPONSE]))
    return {source: np.stack([sample.integral(v, shift) for v in pair], axis=-1) for source, pair, shift in both}


def stretches(recording: Recording) -> tuple[slice, ...]:
    """Rows of the heard spans between gaps longer than half a window: what happens inside a gap no window can tell.

    Args:
        recording: any.

    Returns:
        Slices in the order of time, each inside a span.
    """
    spans = tuple((span.start, span.stop) for span in heard_spans(recording))
    longest = max(STEP, LONGEST_HOLE * recording.period)
    return tuple(slice(first, end) for first, end in cut_at_gaps(recording.t, spans, longest))


def _instants(recording: Recording, pieces: tuple[slice, ...]) -> FloatArray:
    """Beginning, middle and end of windows inside stretches, one every half step, (n, 3) [s]."""
    parts = [np.empty((0, 3))]
    for piece in pieces:
        first, last = recording.t[piece.start], recording.t[piece.stop - 1]
        middle = np.arange(first + STEP, last - STEP + 1e-9, 0.5 * STEP)
        parts.append(np.stack([middle - STEP, middle, middle + STEP], axis=1))
    return np.concatenate(parts)


@dataclass(frozen=True)
class _Sampler:
    """Channels at the instants of windows, each inside the stretch of its window."""

    recording: Recording
    pieces: tuple[slice, ...]
    instants: FloatArray

    def values(self, values: FloatArray, late: float) -> FloatArray:
        """A channel that comes ``late`` seconds late, interpolated; NaN outside its samples, (n, 3)."""
        out = np.full(self.instants.shape, np.nan)
        for piece in self.pieces:
            t, known = self.recording.t[piece], np.isfinite(values[piece])
            first = np.searchsorted(self.instants[:, 0], t[0])
            inside = slice(first, np.searchsorted(self.instants[:, 2], t[-1], side="right"))
            if np.count_nonzero(known) >= 2 and inside.start < inside.stop:
                at = self.instants[inside] + late
                out[inside] = np.interp(at, t[known], values[piece][known], left=np.nan, right=np.nan)
        return out

    def integral(self, values: FloatArray, late: float) -> FloatArray:
        """Time integral of a channel; NaN in windows that hold rows in which it is not known, (n, 3)."""
        return self._known(values, integral(self.recording, values), late)

    def double_integral(self, values: FloatArray) -> FloatArray:
        """Integral of a channel's integral, whose second difference is a mean of the channel; NaN as above, (n, 3)."""
        return self._known(values, integral(self.recording, integral(self.recording, values)), 0.0)

    def _known(self, values: FloatArray, total: FloatArray, late: float) -> FloatArray:
        """What was made of a channel, in windows that hold no row in which it is not known, (n, 3)."""
        missing = np.cumsum(~np.isfinite(filled_between(self.recording, values))).astype(np.float64)
        holes = self.values(missing, late)
        return np.where((holes[:, 2] - holes[:, 0] == 0)[:, None], self.values(total, late), np.nan)


def filled_between(recording: Recording, values: FloatArray) -> FloatArray:
    """Values with one missing sample at a time interpolated; longer holes stay NaN."""
    out = np.array(values)
    inner = np.flatnonzero(~np.isfinite(out[1:-1]) & np.isfinite(out[:-2]) & np.isfinite(out[2:])) + 1
    out[inner] = 0.5 * (out[inner - 1] + out[inner + 1])
    return out


def _first(values: FloatArray) -> FloatArray:
    """Mean change in half a window."""
    return np.asarray(0.5 * (values[:, 2] - values[:, 0]))


def _second(values: FloatArray) -> FloatArray:
    """Second difference over time [per s^2]: the second derivative's mean under a triangle as wide as the window."""
    return np.asarray((values[:, 2] - 2 * values[:, 1] + values[:, 0]) / STEP**2)


def _course(position: FloatArray) -> FloatArray:
    """Angle between the displacements of both halves (n,) [rad]."""
    before, after = position[:, 1] - position[:, 0], position[:, 2] - position[:, 1]
    angle = wrap(np.arctan2(after[:, 1], after[:, 0]) - np.arctan2(before[:, 1], before[:, 0]))
    far = np.minimum(np.hypot(*before.T), np.hypot(*after.T)) >= LEAST_TRAVEL
    return np.where(far & (np.abs(angle) <= LARGEST_TURN), angle, np.nan)


def _along(position: FloatArray, heading: FloatArray) -> FloatArray:
    """Displacement in half a window along the heading in its middle (n,) [m]."""
    moved = 0.5 * (position[:, 2] - position[:, 0])
    return np.asarray(moved[:, 0] * np.cos(heading) + moved[:, 1] * np.sin(heading))


def _change(position: FloatArray, heading: FloatArray) -> FloatArray:
    """Change of the speed along the heading from one half of a window to the other [m/s^2]."""
    parts = [position[:, k + 1] - position[:, k] for k in (0, 1)]
    along = [
        p[:, 0] * np.cos(a) + p[:, 1] * np.sin(a)
        for p, a in zip(parts, (0.5 * (heading[:, :-1] + heading[:, 1:])).T, strict=True)
    ]
    return np.asarray((along[1] - along[0]) / STEP**2)


def _in_blocks(recording: Recording, instants: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Windows and the number of the block in which the middle of each lies, or after which."""
    starts = [recording.t[block.start] for block in cut_blocks(recording)]
    block = np.asarray(np.searchsorted(starts, instants[:, 1], side="right") - 1, dtype=np.float64)
    # rows that come seconds apart make pieces that are too short for a block, also before the first one
    return instants[block >= 0], block[block >= 0]
