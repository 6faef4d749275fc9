"""How a diagnosis cuts and weighs recordings, and the problem that follows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ddagr_gym.errors import InputError
from ddagr_gym.identification.block_means import BLOCK, block_windows, located
from ddagr_gym.identification.fit_numerics import block_mean_numerics, far_off_numerics, field_slope_numerics
from ddagr_gym.identification.headings import without_poses
from ddagr_gym.identification.noise import noise_from_differences
from ddagr_gym.identification.nuisances import NuisancePriors, nuisances
from ddagr_gym.identification.problem import Problem
from ddagr_gym.identification.windows import cut_windows
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.recordings.schema import Recording

SHORTEST = 1.0
"""Shortest windows that are cut to fit segments [s]: five time constants of a bank."""

LEAST_WINDOWS = 8
"""Windows below which neither noise nor a score has a meaning (ours)."""

SHORT = 2.0
"""Windows to which short recordings are cut at least, so that there are enough of them [s]."""

HISTORY = 0.6
"""Commands kept from before a window [s]: longer than the longest delay of the library."""


@dataclass(frozen=True)
class Setting:
    """Choices of a diagnosis.

    Attributes:
        duration: of a window [s].
        stride: between the starts of windows [s].
        block: length of the means that are compared [s].
        priors: of what is uncertain.
        threads: of the simulator.
        far_off: whether the simulator is only as accurate as a model that is far off needs.
    """

    duration: float = 2.0
    stride: float = 2.0
    block: float = BLOCK
    priors: NuisancePriors = field(default_factory=NuisancePriors)
    threads: int = 1
    far_off: bool = False

    def with_windows(self, duration: float, stride: float | None = None) -> Setting:
        """The same with windows of another length.

        Args:
            duration: of a window [s].
            stride: between their starts [s]; by default their length, which uses all samples once.

        Raises:
            InputError: windows that overlap: gains and intervals would count their samples several times.
        """
        if stride is not None and stride < duration:
            raise InputError(
                f"a stride of {stride:g} s makes windows of {duration:g} s overlap, and samples count several times: "
                "give at least the windows' length."
            )
        return replace(self, duration=duration, stride=duration if stride is None else stride)


def window_duration(recordings: Sequence[Recording], setting: Setting) -> float:
    """Length of windows [s]: as set, or shorter where short recordings or segments have no room for enough of them."""
    lengths: list[float] = [(s.stop - s.start - 1) * item.period for item in recordings for s in item.segments()]
    commanded = [seconds for item in recordings for seconds in commanded_seconds(item)]
    wanted = min(setting.duration, max(_longest(commanded), SHORT))
    usual = float(np.median(lengths)) if lengths else 0.0
    return min(wanted, usual) if usual >= SHORTEST else wanted


def commanded_seconds(recording: Recording) -> list[float]:
    """Time under known commands in each segment [s]."""
    right, left = recording.held_commands()
    known = np.isfinite(right) & np.isfinite(left)
    return [max(int(known[s].sum()) - 1, 0) * recording.period for s in recording.segments()]


def windows_in(seconds: Sequence[float], duration: float) -> int:
    """Windows of one duration that stretches have room for."""
    return sum(int(item / duration + 1e-6) for item in seconds)


def _longest(seconds: Sequence[float]) -> float:
    """Longest windows of which stretches have room for as many as are needed; 0 without stretches."""
    lengths = {item / count for item in seconds for count in range(1, LEAST_WINDOWS + 1) if item > 0.0}
    return next((d for d in sorted(lengths, reverse=True) if windows_in(seconds, d) >= LEAST_WINDOWS), 0.0)


def make_problem(
    robot: Robot,
    soil: Soil,
    recordings: Sequence[Recording],
    setting: Setting = Setting(),
) -> Problem:
    """Windows of recordings with their noise, and what is uncertain about them.

    Args:
        robot: nominal.
        soil: nominal.
        recordings: of one robot and period.
        setting: choices.

    Raises:
        InputError: see :func:`ddagr_gym.identification.windows.cut_windows`.
    """
    radius = robot.outer_radius
    duration = window_duration(recordings, setting)
    windows = cut_windows(
        recordings,
        duration,
        stride=setting.stride * min(duration / setting.duration, 1.0),
        wheel_radius=radius,
        half_track=robot.half_track,
        history=HISTORY,
    )
    noise = noise_from_differences(recordings, radius)
    blocked = block_windows(located(windows, recordings, radius), noise, radius, setting.block)
    reckoned = without_poses(recordings)
    # where none has poses the first one begins along the world's x axis
    unplaced = reckoned[1:] if len(reckoned) == len(recordings) else reckoned
    uncertain = nuisances(robot, len(recordings), windows.period, setting.priors, unplaced)
    numerics = far_off_numerics() if setting.far_off else block_mean_numerics()
    slopes = field_slope_numerics() if setting.far_off else None
    return Problem(robot, soil, blocked, uncertain, threads=setting.threads, numerics=numerics, slopes=slopes)
