"""Recordings made ready for a replay: clocks, noise, parts, and the windows cut from them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.identification.data_split import Split, evenly, split_recording
from ddagr_gym.identification.recording_noise import RecordingNoise, dead_channels, recording_noise
from ddagr_gym.identification.timing_repair import aligned_poses, bridged
from ddagr_gym.identification.window_model import RUN_IN
from ddagr_gym.identification.windows import WindowSet, cut_runs, cut_windows
from ddagr_gym.parameters import Robot
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.pose_latency import PoseLatency
from ddagr_gym.physics.effects.sensor_hold import SensorHold
from ddagr_gym.presets import robot_option
from ddagr_gym.recordings.drive_requirements import check_rows
from ddagr_gym.recordings.schema import Recording, RobotGeometry
from ddagr_gym.replay_analysis.fitting import LATEST_CLOCK

Array = NDArray[np.float64]
Part = Callable[[WindowSet, Sequence[Split]], NDArray[np.bool_]]

DRIVES = ("commands", "encoders")
"""What can drive the simulator."""


@dataclass(frozen=True, eq=False)
class Prepared:
    """Recordings of one robot on one ground, ready to be cut.

    Attributes:
        recordings: bridged, with poses at their own time.
        noise: of each.
        splits: of each.
        geometry: of the robot.
        dead: channels without information in any of them.
        notes: sentences on what was left out or corrected.
    """

    recordings: tuple[Recording, ...]
    noise: tuple[RecordingNoise, ...]
    splits: tuple[Split, ...]
    geometry: RobotGeometry
    dead: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def period(self) -> float:
        """Between samples [s]."""
        return self.recordings[0].period

    @property
    def sigma(self) -> Array:
        """(8,) noise of the channels, the largest of the recordings'."""
        return np.asarray(np.max([item.sigma for item in self.noise], axis=0))

    def windows(
        self, duration: float, drive_by: str, *, stride: float | None = None, part: Part | None = None, most: int = 600
    ) -> WindowSet | None:
        """Windows of ``duration`` [s], at most ``most`` evenly chosen ones; None where none fits.

        Args:
            duration: of a window [s].
            drive_by: of DRIVES.
            stride: between starts [s].
            part: picks a part, such as :func:`ddagr_gym.identification.data_split.training`.
            most: windows.
        """
        try:
            windows = cut_windows(
                self.recordings, duration, stride=stride, wheel_radius=self.geometry.wheel_radius,
                half_track=self.geometry.half_track, drive_by=drive_by, history=LATEST_CLOCK, ahead=LATEST_CLOCK,
                run_in=RUN_IN if drive_by == "commands" else 0.0,
            )  # fmt: skip
        except InputError:
            return None
        chosen = np.ones(windows.count, dtype=bool) if part is None else part(windows, self.splits)
        rows = np.flatnonzero(chosen)
        return windows.subset(rows[evenly(rows.size, most)]) if rows.size else None

    def runs(self, drive_by: str) -> tuple[WindowSet, ...]:
        """Every stretch with a known drive as one window; see :func:`ddagr_gym.identification.windows.cut_runs`."""
        return cut_runs(
            self.recordings, wheel_radius=self.geometry.wheel_radius, half_track=self.geometry.half_track,
            drive_by=drive_by, history=LATEST_CLOCK, ahead=LATEST_CLOCK,
        )  # fmt: skip


def prepare(
    recordings: Sequence[Recording],
    robot: Robot,
    rng: np.random.Generator,
    swapped: bool = False,
    effects: Sequence[Effect] = (),
) -> Prepared:
    """Correct clocks, judge noise, split.

    Args:
        recordings: of ``robot``, of one sample period.
        robot: that drove.
        rng: for the interval of the poses' lateness.
        swapped: let training and judging part change their roles.
        effects: of the simulator; a lateness of the poses among them is taken from the recordings where they do not
            tell their own (see :func:`simulated_effects`).

    Raises:
        InputError: a recording of another robot, or without time.
    """
    for recording in recordings:
        if recording.meta.robot not in ("", robot.name):
            raise InputError(
                f"{recording.meta.source} is a recording of the robot {recording.meta.robot!r}: "
                f"replay it with {robot_option(recording.meta.robot)}, not {robot.name}."
            )
        check_rows(recording, "a replay")
    noise = tuple(recording_noise(recording, rng) for recording in recordings)
    known = sum(effect.latency for effect in effects if isinstance(effect, PoseLatency))
    late = [item.pose_lateness or known for item in noise]
    even = [aligned_poses(bridged(r), time) for r, time in zip(recordings, late, strict=True)]
    dead = sorted({name for recording in recordings for name in dead_channels(recording)})
    return Prepared(
        tuple(even),
        noise,
        tuple(split_recording(recording, swapped) for recording in even),
        RobotGeometry.of(robot),
        tuple(dead),
        tuple(_notes(recordings, noise, late, dead)),
    )


def simulated_effects(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """Effects that the simulator has in a replay: all but those of when readings come.

    Poses that come late are moved back in the recordings instead: a window begins with its first readings, so that a
    simulated lateness would stand still for its own length first. Held readings count when they are new; when that is
    a simulated hold does not know.
    """
    return tuple(effect for effect in effects if not isinstance(effect, PoseLatency | SensorHold))


def _notes(
    recordings: Sequence[Recording], noise: Sequence[RecordingNoise], late: Sequence[float], dead: Sequence[str]
) -> Iterator[str]:
    for name in dead:
        yield f"{name} never changes and was left out of every fit: stuck, or zeros logged as data."
    for recording, item, moved in zip(recordings, noise, late, strict=True):
        if item.opposed:
            yield f"{recording.meta.source}: gyro and poses turn opposite ways, see ddagr check; nothing was corrected."
        if item.pose_lateness > 0.0:
            scatter = "" if item.opposed else f"; their lateness scatters by about {item.pose_jitter:.2f} s"
            how = f"{item.pose_lateness:.2f} s behind the gyro and were moved back{scatter}"
            yield f"{recording.meta.source}: poses come {how}."
        elif moved > 0.0:
            yield f"{recording.meta.source}: poses were moved back by {moved:.2f} s, as an effect says."
        for sentence in recording.validate():
            yield f"{recording.meta.source}: {sentence}"
