"""Recordings as everything after them sees them: faults that show in the values mended, then cut into windows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ddagr_gym.diagnosis.preprocessing.repeated_readings import Held, find_repeated_readings, without_repeats
from ddagr_gym.diagnosis.preprocessing.reversed_gyro import ReversedGyro, find_reversed_gyro, with_gyro_reversed
from ddagr_gym.diagnosis.setting import Setting, make_problem
from ddagr_gym.identification.problem import Problem
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.recordings.schema import Recording


@dataclass(frozen=True, eq=False)
class Mended:
    """Recordings without the faults that need no model.

    Attributes:
        recordings: with repeats as missing samples, and the sign of a reversed gyro turned.
        held: sensors that repeat their readings.
        flipped: evidence of a reversed gyro; None where it is right.
    """

    recordings: tuple[Recording, ...]
    held: tuple[Held, ...]
    flipped: ReversedGyro | None


def mended(recordings: Sequence[Recording]) -> Mended:
    """Find and mend repeated readings and a reversed gyro.

    Args:
        recordings: at least one, of one robot.
    """
    held = tuple(find_repeated_readings(recordings))
    clean = tuple(without_repeats(recording, held) for recording in recordings) if held else tuple(recordings)
    flipped = find_reversed_gyro(clean)
    if flipped is not None:
        clean = tuple(with_gyro_reversed(recording) for recording in clean)
    return Mended(clean, held, flipped)


@dataclass(frozen=True, eq=False)
class Prepared(Mended):
    """Recordings ready for a search.

    Attributes:
        recordings: see :class:`Mended`, and the following.
        held: see there.
        flipped: see there.
        problem: their windows.
    """

    problem: Problem


def prepare(robot: Robot, soil: Soil, recordings: Sequence[Recording], setting: Setting) -> Prepared:
    """Held readings, noise, windows.

    Args:
        robot: nominal.
        soil: nominal.
        recordings: at least one, of one period.
        setting: choices.
    """
    found = mended(recordings)
    problem = make_problem(robot, soil, found.recordings, setting)
    return Prepared(found.recordings, found.held, found.flipped, problem)
