"""By how much ordinary drives differ, as far as that is known before any of them was driven."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ddagr_gym.diagnosis.result.uncertainty import STRUCTURE, STRUCTURE_OF_LIMIT
from ddagr_gym.diagnosis.search.candidates import Candidate

EXPECTED_DRIVES = 4.0
"""Degrees of freedom of the expected scatter where nothing was measured (ours): as if it came from five drives."""

RISE = 0.25
"""Deviation of the logarithm of what a fit leaves of a channel, where nothing was measured (ours)."""


@dataclass(frozen=True)
class ExpectedScatter:
    """By how much the sizes of effects differ between ordinary drives because simulators differ in structure.

    Attributes:
        deviations: by effect, in least sizes that matter, of limits and signs in the whole of them; those that are
            missing have what intervals are widened by.
        degrees: of freedom with which that is known of a robot before any of its drives.
        moves: by parameter of robot and soil, in prior deviations (r.m.s.); those that are missing move by one.
        rises: by channel, deviation of the logarithm of the mean square that a fit leaves of it.
        agreeing: the degrees for effects of which the robot's own ordinary drives scatter no more, if these are more.
    """

    deviations: Mapping[str, float] = field(default_factory=dict)
    degrees: float = EXPECTED_DRIVES
    moves: Mapping[str, float] = field(default_factory=dict)
    rises: Mapping[str, float] = field(default_factory=dict)
    agreeing: float = 0.0

    @property
    def of_calibrations(self) -> ExpectedScatter:
        """What is expected of a robot whose own drives say more: little, but where they agree with it."""
        return ExpectedScatter(self.deviations, agreeing=self.degrees)

    def of(self, candidate: Candidate) -> float:
        """Deviation of a candidate's sizes, in least sizes that matter."""
        usual = STRUCTURE if candidate.has_sizes else STRUCTURE_OF_LIMIT
        return self.deviations.get(candidate.name, usual)

    def move(self, parameter: str) -> float:
        """Prior deviations by which a drive moves a parameter of robot or soil (r.m.s.)."""
        return self.moves.get(parameter, 1.0)

    def rise(self, channel: str) -> float:
        """Deviation of the logarithm of what a fit leaves of a channel."""
        return self.rises.get(channel, RISE)
