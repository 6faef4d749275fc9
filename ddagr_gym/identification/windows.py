"""Cutting recordings into windows of equal length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.identification.first_states import ROWS, guess_state
from ddagr_gym.identification.signals import bank_speeds
from ddagr_gym.recordings.continued import RowsOfSegment, rows_by_segment
from ddagr_gym.recordings.pose_frames import frames_apart
from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]

CHANNELS = (
    "specific_force_x",
    "specific_force_y",
    "yaw_rate",
    "encoder_right",
    "encoder_left",
    "pose_x",
    "pose_y",
    "pose_yaw",
)
"""Channels that the simulator predicts, in the order of ``layout.READINGS``."""

STATE = ("x", "y", "yaw", "v_x", "v_y", "yaw_rate", "omega_right", "omega_left")
"""Initial state of a window; the first three only shift the pose while the ground is the same everywhere."""

PERIOD_TOLERANCE = 0.02
"""Relative difference of sample periods that still counts as equal."""


@dataclass(frozen=True, eq=False)
class WindowSet:
    """W windows of T samples after their start.

    Attributes:
        period: between samples [s].
        recording: (W,) index of the recording that each came from.
        start: (W,) row of the recording at which it starts.
        time: (W,) recording time at the start [s].
        commands: (W, H + T + A, 2) right and left commands [rad/s]; command [H + k] is in force in the period that
            ends at sample k, the first H belong to the past (for delays), the last A to the future (for late clocks).
        history: H.
        measured: (W, T, 8) in the order of CHANNELS, NaN where there is no new sample; (W, T, 10) with the currents of
            the right and left motors behind them, where those are compared.
        initial: (W, 8) first guess of STATE at the start.
        ahead: A.
        unknown: (W,) how many of the first commands nobody recorded: before a recording, or a stretch of it, the first
            one stands for them.
        speeds: (W, H + T, 2) recorded bank speeds between their samples [rad/s], NaN where unknown; the first H belong
            to the past.
        frames_apart: whether stretches of a drive have poses in frames of their own, so that nothing can be said of
            directions and places in the world.
        run_in: what was driven right before those windows before which enough is known; None where that was not asked
            for.
    """

    period: float
    recording: NDArray[np.int64]
    start: NDArray[np.int64]
    time: Array
    commands: Array
    history: int
    measured: Array
    initial: Array
    ahead: int = 0
    unknown: NDArray[np.int64] = field(default_factory=lambda: np.zeros(1, dtype=np.int64))
    speeds: Array = field(default_factory=lambda: np.full((1, 1, 2), np.nan))
    frames_apart: bool = False
    run_in: RunIn | None = None

    def __post_init__(self) -> None:
        """One count for all windows, by default none, stands for each of them, and so do unknown speeds.

        Of windows that are made shorter the speeds of the rest go.
        """
        object.__setattr__(self, "unknown", np.broadcast_to(self.unknown, self.start.shape))
        length = self.history + self.samples
        speeds = np.broadcast_to(self.speeds[:, :length], (len(self.start), length, 2))
        object.__setattr__(self, "speeds", speeds)

    @property
    def count(self) -> int:
        """W."""
        return len(self.start)

    @property
    def samples(self) -> int:
        """T."""
        return int(self.measured.shape[1])

    @property
    def duration(self) -> float:
        """Of a window [s]."""
        return self.samples * self.period

    def drive(self, delay: float | Array = 0.0) -> Array:
        """(W, T, 2) commands as they act after ``delay`` [s], one or (W,); a negative one takes them from later rows.

        Between samples of the period they are interpolated; before and after what was kept, held.
        """
        return self._commands(np.arange(self.samples), delay)

    def past(self, delay: float | Array = 0.0) -> Array:
        """(W, H, 2) commands that acted in the same way before the start, the latest last; NaN where unknown."""
        late = np.broadcast_to(np.ceil(np.asarray(delay) / self.period - 1e-9).astype(np.int64), (self.count,))
        known = np.arange(self.history) - late[:, None] >= self.unknown[:, None]
        return np.where(known[..., None], self._commands(np.arange(-self.history, 0), delay), np.nan)

    @property
    def past_speeds(self) -> Array:
        """(W, H, 2) recorded bank speeds before the start, the latest last [rad/s]; NaN where unknown."""
        return self.speeds[:, : self.history]

    def _commands(self, samples: NDArray[np.int64], delay: float | Array) -> Array:
        """Commands that act in samples counted from the start."""
        periods = np.broadcast_to(np.asarray(delay, dtype=np.float64) / self.period, (self.count,))
        whole = np.floor(periods).astype(np.int64)
        part = (periods - whole)[:, None, None]
        rows = self.history + samples - whole[:, None]
        last = self.commands.shape[1] - 1
        window = np.arange(self.count)[:, None]
        newer = self.commands[window, np.clip(rows, 0, last)]
        if not part.any():
            return np.asarray(newer)
        return np.asarray((1.0 - part) * newer + part * self.commands[window, np.clip(rows - 1, 0, last)])

    def subset(self, chosen: NDArray[np.int64] | NDArray[np.bool_]) -> WindowSet:
        """Only the chosen windows."""
        names = ("recording", "start", "time", "commands", "measured", "initial", "unknown", "speeds")
        found = replace(self, **{name: getattr(self, name)[chosen] for name in names})
        if self.run_in is None:
            return found
        return replace(found, run_in=self.run_in.subset(np.arange(self.count)[chosen], self.count))


@dataclass(frozen=True, eq=False)
class RunIn:
    """What was driven right before windows: from it a simulation knows what a drivetrain holds at their start.

    Attributes:
        windows: that end where others begin; nothing is compared with them.
        leads_to: (M,) the window that follows each.
    """

    windows: WindowSet
    leads_to: NDArray[np.int64]

    def subset(self, chosen: NDArray[np.int64], count: int) -> RunIn:
        """Of chosen windows (K,), by number among ``count``, some of which may come several times."""
        place = np.full(count, -1)
        place[self.leads_to] = np.arange(len(self.leads_to))
        rows = place[chosen]
        return RunIn(self.windows.subset(rows[rows >= 0]), np.flatnonzero(rows >= 0))


def cut_windows(
    recordings: Sequence[Recording],
    duration: float,
    *,
    stride: float | None = None,
    wheel_radius: float,
    half_track: float,
    drive_by: str = "commands",
    history: float = 0.5,
    ahead: float = 0.0,
    run_in: float = 0.0,
) -> WindowSet:
    """Windows of ``duration`` inside the segments of recordings of one sample period.

    Args:
        recordings: of one robot.
        duration: of a window [s].
        stride: between starts [s], gaps left out; ``duration`` by default.
        wheel_radius: for the first guess of the speed [m].
        half_track: for the first guess of the yaw rate where no gyro is [m].
        drive_by: "commands", or "encoders" to impose the recorded wheel speeds.
        history: commands kept from before the start [s].
        ahead: commands kept from after the end [s].
        run_in: also keep that much of what was driven right before, where it is known [s].

    Raises:
        InputError: periods differ, no window fits, or commands or encoders are absent.
    """
    period = _common_period(recordings)
    samples = max(round(duration / period), 2)
    step = samples if stride is None else max(round(stride / period), 1)
    past, later, before = round(history / period), round(ahead / period), round(run_in / period)
    parts: list[_Part] = []
    earlier: dict[int, _Part] = {}
    for number, recording in enumerate(recordings):
        driven = (_drive(recording, drive_by), bank_speeds(recording))
        due = 0
        for rows in rows_by_segment(recording, past + before + ROWS):
            for first in range(max(rows.segment.start, due), rows.segment.stop - samples, step):
                part = _window(recording, number, driven, first, samples, (past, later), rows)
                if part is None:
                    continue
                run = _run_in(recording, number, driven, first, before, past, rows)
                if run is not None:
                    earlier[len(parts)] = run
                parts.append(part)
                due = first + step
    if not parts:
        names = ", ".join(r.meta.source for r in recordings)
        raise InputError(f"{names}: no window of {duration:g} s fits into valid {drive_by}: choose a shorter one.")
    windows = _stack(recordings, parts, period, (past, later), wheel_radius, half_track)
    if not earlier:
        return windows
    stacked = _stack(recordings, list(earlier.values()), period, (past, 0), wheel_radius, half_track)
    return replace(windows, run_in=RunIn(stacked, np.array(list(earlier), dtype=np.int64)))


def cut_runs(
    recordings: Sequence[Recording],
    *,
    wheel_radius: float,
    half_track: float,
    drive_by: str = "commands",
    shortest: float = 1.0,
    history: float = 0.5,
    ahead: float = 0.0,
) -> tuple[WindowSet, ...]:
    """The longest possible windows: each stretch of a segment with a known drive is one; one set per length.

    Args:
        recordings: see :func:`cut_windows`, and the others.
        wheel_radius: see there.
        half_track: see there.
        drive_by: see there.
        shortest: stretch that counts [s].
        history: see there.
        ahead: see there.

    Returns:
        Sets in the order of length, none where nothing is long enough.
    """
    period = _common_period(recordings)
    past, later = round(history / period), round(ahead / period)
    by_length: dict[int, list[_Part]] = {}
    for number, recording in enumerate(recordings):
        drive, speeds = _drive(recording, drive_by), bank_speeds(recording)
        for rows in rows_by_segment(recording, past + ROWS):
            segment = rows.segment
            known = np.isfinite(drive[segment]).all(axis=1)
            edges = segment.start + np.flatnonzero(np.diff(np.concatenate([[False], known, [False]]).astype(int)))
            for first, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
                samples = stop - first - 1
                if samples <= 1:
                    continue
                part = _window(recording, number, (drive, speeds), first, samples, (past, later), rows)
                if part is not None and samples * period >= shortest - 0.5 * period:
                    by_length.setdefault(samples, []).append(part)
    return tuple(
        _stack(recordings, by_length[n], period, (past, later), wheel_radius, half_track) for n in sorted(by_length)
    )


_Part = tuple[int, int, float, Array, Array, int, Array, RowsOfSegment]


def _stack(
    recordings: Sequence[Recording],
    parts: Sequence[_Part],
    period: float,
    kept: tuple[int, int],
    wheel_radius: float,
    half_track: float,
) -> WindowSet:
    *columns, rows = zip(*parts, strict=True)
    number, start, time, commands, measured, unknown, speeds = (np.array(column) for column in columns)
    guesses = [
        guess_state(recordings[n], int(s), own, drive, wheel_radius, half_track)
        for n, s, own, drive in zip(number, start, rows, commands[:, max(kept[0] - 1, 0)], strict=True)
    ]
    return WindowSet(
        period, number, start, time, commands, kept[0], measured, np.stack(guesses), kept[1], unknown, speeds,
        any(frames_apart(recording) for recording in recordings),
    )  # fmt: skip


def _common_period(recordings: Sequence[Recording]) -> float:
    periods = np.array([recording.period for recording in recordings])
    if not len(periods) or not np.isfinite(periods).all():
        raise InputError("no recording with at least two rows was given: nothing can be replayed.")
    if np.ptp(periods) > PERIOD_TOLERANCE * periods[0]:
        raise InputError(f"the recordings have periods {periods.tolist()} s: replay those of one rate together.")
    return float(np.median(periods))


def _drive(recording: Recording, drive_by: str) -> Array:
    """(n, 2) right and left speeds that drive the simulator; NaN where unknown."""
    if drive_by == "commands":
        return np.stack(recording.held_commands(), axis=1)
    if drive_by != "encoders":
        raise InputError(f"drive_by is {drive_by!r}: give 'commands' or 'encoders'.")
    return bank_speeds(recording)


def _window(
    recording: Recording,
    number: int,
    driven: tuple[Array, Array],
    first: int,
    samples: int,
    kept: tuple[int, int],
    rows: RowsOfSegment,
) -> _Part | None:
    past, later = kept
    drive, speeds = driven
    at, known = rows.at(np.arange(first + 1 - past, first + 1 + samples + later))
    commands = drive[at]
    if not np.isfinite(commands[past : past + samples]).all():
        return None
    commands, first_given = _held(commands)
    unknown = max(int((~known).sum()), first_given)
    inside = slice(first + 1, first + 1 + samples)
    measured = np.stack([recording[name][inside] for name in CHANNELS], axis=1)
    at, known = at[: past + samples], known[: past + samples]
    turned = np.where(known[:, None], speeds[at], np.nan)
    return number, first, float(recording.t[first]), commands, measured, unknown, turned, rows


def _held(commands: Array) -> tuple[Array, int]:
    """Commands (n, 2) where unknown ones are those before, and how many there are before the first known one.

    The robot is taken to have had that one before it.
    """
    given = np.isfinite(commands).all(axis=1)
    first = int(np.argmax(given))
    return commands[np.maximum.accumulate(np.where(given, np.arange(len(commands)), first))], first


def _run_in(
    recording: Recording,
    number: int,
    driven: tuple[Array, Array],
    first: int,
    samples: int,
    past: int,
    rows: RowsOfSegment,
) -> _Part | None:
    """What was driven in so many samples before a window's first row; None where that is not known."""
    drive, speeds = driven
    at, known = rows.at(np.arange(first + 1 - samples - past, first + 1))
    commands = drive[at]
    needed = slice(past - 1 if past else 0, None)
    whole = known[needed].all() and np.isfinite(commands[needed]).all() and np.isfinite(speeds[at[needed]]).all()
    if not samples or not whole:
        return None
    commands, first_given = _held(np.where(known[:, None], commands, np.nan))
    turned = np.where(known[:, None], speeds[at], np.nan)
    start = int(at[needed][0])
    nothing = np.full((samples, len(CHANNELS)), np.nan)
    alone = RowsOfSegment(rows.segment, rows.before[:0])
    return number, start, float(recording.t[start]), commands, nothing, first_given, turned, alone


def with_presumed_past(windows: WindowSet) -> WindowSet:
    """Windows in which the commands that nobody recorded are the bank speeds at the start.

    Before a recorded stretch the first command is no better guess: a step begins with a new one, and a robot that is
    late goes on as it was.
    """
    rows = np.arange(windows.commands.shape[1])
    unknown = rows[None, :, None] < windows.unknown[:, None, None]
    banks = slice(STATE.index("omega_right"), STATE.index("omega_left") + 1)
    commands = np.where(unknown, windows.initial[:, None, banks], windows.commands)
    earlier = windows.run_in
    if earlier is not None:
        earlier = replace(earlier, windows=with_presumed_past(earlier.windows))
    return replace(windows, commands=commands, unknown=np.zeros(windows.count, dtype=np.int64), run_in=earlier)
