"""Which drive would settle what a diagnosis leaves open."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class DriveProposal:
    """A manoeuvre and what it would tell apart.

    Attributes:
        manoeuvre: name, "" where nothing helps.
        why: in words: what would show, and how often it has to be driven; or why nothing helps.
        separates: pairs of names that it tells apart within half an hour.
        power: least expected gain of a pair per minute of it; ln 19 = 2.9 tells a pair apart, where it is at least
            0.24 of all that the right name gains.
        minutes: of it until the worst pair is told apart; null where that takes more than half an hour.
    """

    manoeuvre: str
    why: str
    separates: tuple[tuple[str, str], ...]
    power: float
    minutes: float | None


@dataclass(frozen=True)
class NextDrivePlan(DriveProposal):
    """The manoeuvre that tells the remaining explanations apart best.

    Attributes:
        alternatives: further manoeuvres, best first.
    """

    alternatives: tuple[DriveProposal, ...] = ()

    @classmethod
    def none(cls, why: str, power: float = 0.0) -> NextDrivePlan:
        """No drive, and why."""
        return cls("", why, (), power, None)
