"""Drives made ready for a joint fit: faults that show in their values mended, clocks matched, windows cut."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.calibration.ground_slopes import slopes_of
from ddagr_gym.calibration.settings import HISTORY, CalibrationSettings
from ddagr_gym.diagnosis.change.ground_slope import GroundSlope
from ddagr_gym.diagnosis.preprocessing.mended_recordings import mend_recordings
from ddagr_gym.diagnosis.wording import in_sentence
from ddagr_gym.errors import InputError
from ddagr_gym.identification.data_split import evenly
from ddagr_gym.identification.motor_currents import CurrentModel, current_model, with_currents
from ddagr_gym.identification.window_model import RUN_IN
from ddagr_gym.identification.windows import WindowSet, cut_windows, with_presumed_past
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.recordings.channels import CURRENTS
from ddagr_gym.recordings.checks.command_gains import straight_finding
from ddagr_gym.recordings.checks.currents import CurrentKind
from ddagr_gym.recordings.checks.findings import Status
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.replay_analysis.prepare import Prepared, prepare

Integers = NDArray[np.int64]

FEWEST_WINDOWS = 8
"""Windows of a drive below which neither its noise nor its estimates have a meaning (ours)."""

SUPPLY_LEFT_OUT = "the currents, which are what the motors draw from their supply, are left out of the fit."
"""Note on a drive with such currents."""

SHORTEST_WINDOW = 2.0
"""[s], ours: ten time constants of a bank."""


@dataclass(frozen=True, eq=False)
class CalibrationData:
    """Drives of one robot, ready to be fitted.

    Attributes:
        robot: of the data sheet.
        soils: nominal soil of each ground.
        prepared: drives with poses at their own time, and their noise.
        grounds: ground of each drive.
        windows: all of them, in the order of the drives and of time.
        notes: of each drive, sentences on what was mended.
        currents: how the motors' currents follow, None where none is compared; the windows hold them then.
        slopes: of the grounds that surely slope.
        holds: of each drive, time for which sensors repeat their readings, by sensor [s].
    """

    robot: Robot
    soils: Mapping[str, Soil]
    prepared: Prepared
    grounds: tuple[str, ...]
    windows: WindowSet
    notes: tuple[tuple[str, ...], ...]
    currents: CurrentModel | None = None
    slopes: Mapping[str, GroundSlope] = field(default_factory=dict)
    holds: tuple[Mapping[str, float], ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Of the drives."""
        return tuple(recording.meta.source for recording in self.prepared.recordings)

    @property
    def count(self) -> int:
        """Number of drives."""
        return len(self.grounds)

    @property
    def drives_on(self) -> dict[str, tuple[int, ...]]:
        """Numbers of the drives by ground."""
        return {
            ground: tuple(n for n, other in enumerate(self.grounds) if other == ground)
            for ground in dict.fromkeys(self.grounds)
        }

    def is_alone(self, drive: int) -> bool:
        """Whether no other one of several drives was on the ground of a drive."""
        return self.count > 1 and len(self.drives_on[self.grounds[drive]]) == 1

    def spread(self, most: int) -> WindowSet:
        """At most ``most`` windows of each drive, evenly over it."""
        chosen = []
        for drive in range(self.count):
            rows = np.flatnonzero(self.windows.recording == drive)
            chosen.append(rows[evenly(rows.size, most)])
        return self.windows.subset(np.concatenate(chosen))


def prepare_drives(
    recordings: Sequence[Recording],
    grounds: Sequence[str],
    robot: Robot,
    soils: Mapping[str, Soil],
    settings: CalibrationSettings,
) -> CalibrationData:
    """Mend drives, match their clocks, estimate their noise, cut their windows.

    Args:
        recordings: checked by :func:`~ddagr_gym.calibration.input_requirements.check_drives`.
        grounds: ground of each.
        robot: of the data sheet.
        soils: nominal soil of each ground.
        settings: length of the windows.

    Raises:
        InputError: a drive with too few windows.
    """
    mended, notes, holds = zip(*(_mended(recording, settings.seed) for recording in recordings), strict=True)
    prepared = prepare(mended, robot, np.random.default_rng(settings.seed))
    windows = cut_windows(
        prepared.recordings,
        _duration(prepared.recordings, settings.window),
        wheel_radius=robot.outer_radius,
        half_track=robot.half_track,
        history=HISTORY,
        run_in=RUN_IN,
    )
    for number, recording in enumerate(prepared.recordings):
        count = int(np.count_nonzero(windows.recording == number))
        if count < FEWEST_WINDOWS:
            raise InputError(
                f"{recording.meta.source} has {count} windows of {windows.duration:.3g} s without a gap and with "
                f"commands, a calibration needs {FEWEST_WINDOWS} of each drive: give a longer drive, or leave it out."
            )
    currents, said = current_model(prepared.recordings, robot, np.random.default_rng(settings.seed))
    if currents is not None and currents.kind is CurrentKind.SUPPLY and not settings.supply_currents:
        currents, said = None, (SUPPLY_LEFT_OUT,)
    notes = tuple((*own, *(said if r.has(*CURRENTS) else ())) for own, r in zip(notes, mended, strict=True))
    windows = with_presumed_past(windows)
    if currents is not None:
        windows = with_currents(windows, prepared.recordings)
    data = CalibrationData(robot, dict(soils), prepared, tuple(grounds), windows, notes, currents, holds=holds)
    return replace(data, slopes=slopes_of(prepared.recordings, windows, data.drives_on, robot.outer_radius))


def _mended(recording: Recording, seed: int) -> tuple[Recording, tuple[str, ...], dict[str, float]]:
    """A drive without the faults that show in its values, sentences on them, and how long sensors repeat readings."""
    found = mend_recordings([recording], seed)
    said = [f"the {item.sensor} repeats its readings: repeats are left out." for item in found.repeated]
    said += [f"{in_sentence(fault.name)}: readings were put where they belong." for fault in found.channel_faults]
    said += ["the gyro turns the wrong way: its sign was turned."] if found.reversed_gyro is not None else []
    faster = [item for item in straight_finding(found.recordings[0]) if item.status is Status.SUSPICIOUS]
    said += [f"{item.meaning} {item.remedy}" for item in faster]
    return found.recordings[0], tuple(said), found.holds


def _duration(recordings: Sequence[Recording], wanted: float) -> float:
    """Length of the windows [s]: as wanted, or shorter where most segments are."""
    lengths = [(s.stop - s.start - 1) * r.period for r in recordings for s in r.segments()]
    usual = float(np.median(lengths))
    return wanted if usual < SHORTEST_WINDOW else min(wanted, usual)
