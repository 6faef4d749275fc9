"""A fit to a drive, and how far every effect and parameter is from ordinary drives there."""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import dataclass, replace

from ddagr_gym.diagnosis.change.channel_rises import ChannelRise, channel_rises
from ddagr_gym.diagnosis.change.contrasts import contrast_of, looks_of
from ddagr_gym.diagnosis.change.drive_fit import moved_parameters
from ddagr_gym.diagnosis.change.drive_scan import Compared, DriveScan, named_in, scan_drive
from ddagr_gym.diagnosis.change.ordinary import Comparison, Scores
from ddagr_gym.diagnosis.change.shifts import LEVEL, Pull, Shift, family_probability, shift_of
from ddagr_gym.diagnosis.mid_drive.search_in_time import parts_tried
from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.identification.misfit import channel_misfit, projected_residual
from ddagr_gym.identification.problem import Problem
from ddagr_gym.identification.windows import CHANNELS

NEAR = 0.4
"""Share of its limit at which an effect is refitted to see (ours): in a real drive poses that come half a second late
stand at 0.7 of it before the refit."""

MOST_NEAR = 3
"""Effects that are refitted to see (ours)."""

FORM = 0.1
"""Share of a named effect by which the library's form of it is not the robot's (ours): deviation of its size, and
distance that a further effect needs, since the rest of it looks like other effects."""


@dataclass(frozen=True, eq=False)
class Model:
    """A fit, and how far every effect that it lacks is from ordinary drives.

    Attributes:
        problem: that was fitted.
        fitted: with or without effects.
        scan: of the library there.
        shifts: of all candidates, the least probable first.
        pulls: of all parameters that may differ between drives.
        named: candidates of the fit's effects, as they were shifted when each was added.
        rises: of what is left of each channel; only against drives from before on the same ground.
    """

    problem: Problem
    fitted: Fitted
    scan: DriveScan
    shifts: tuple[Shift, ...]
    pulls: tuple[Pull, ...]
    named: tuple[Shift, ...] = ()
    rises: tuple[ChannelRise, ...] = ()

    @property
    def tests(self) -> int:
        """Number of candidates, parameters and channels."""
        return len(self.shifts) + len(self.pulls) + len(self.rises)

    def probability(self, shift: Shift | Pull | ChannelRise, looks: int = 1) -> float:
        """Of an ordinary drive to show as much in any candidate or parameter, each looked at so many times.

        What is present in a part of the drives was looked at in every part: that these overlap matters little far out.
        """
        parts = shift.looks if isinstance(shift, Shift) else 1
        return family_probability(shift.probability, looks * parts * self.tests)

    def parts_of(self, name: str) -> int:
        """In how many parts of the drives an effect was tried: 1 where it is present all along."""
        return parts_tried(self.problem.blocked.windows) if name in self.problem.spells else 1

    @property
    def best(self) -> tuple[Shift, ...]:
        """The least probable candidate of each effect, in their order."""
        found: dict[str, Shift] = {}
        for shift in self.shifts:
            found.setdefault(shift.compared.name, shift)
        return tuple(found.values())

    @property
    def conspicuous(self) -> tuple[Shift, ...]:
        """Those of :attr:`best` that ordinary drives hardly show."""
        least = FORM * max((shift.distance for shift in self.named), default=0.0)
        return tuple(s for s in self.best if self.probability(s) < LEVEL and s.distance > least)

    @property
    def near(self) -> tuple[Shift, ...]:
        """Those of :attr:`best` that are worth a refit: what is large a first step finds only in part."""
        listed = sorted(self.best, key=lambda s: -s.distance / s.limit(self.tests))
        return tuple(s for s in listed[:MOST_NEAR] if s.probability < 1.0 and s.distance > NEAR * s.limit(self.tests))

    @property
    def pulled(self) -> tuple[Pull, ...]:
        """Parameters that ordinary drives hardly move as far."""
        return tuple(pull for pull in self.pulls if self.probability(pull) < LEVEL)

    @property
    def rougher(self) -> tuple[ChannelRise, ...]:
        """Channels of which ordinary drives hardly leave as much, the least probable first."""
        found = [rise for rise in self.rises if self.probability(rise) < LEVEL]
        return tuple(sorted(found, key=lambda rise: rise.probability))

    @property
    def excess(self) -> float:
        """Cost of the channels that are left rougher than usual, beyond what ordinary drives leave of them."""
        if not self.rougher:
            return 0.0
        losses = self.problem.losses_by_channel(projected_residual(self.problem, self.fitted))
        return sum(losses[rise.channel] * (1.0 - rise.usual / rise.misfit) for rise in self.rougher)

    @property
    def left(self) -> float:
        """Largest distance over its limit of any effect or parameter."""
        parameters = (pull.distance / pull.limit(self.tests) for pull in self.pulls)
        return max(farthest(self.best, self.tests), max(parameters, default=0.0))


def model_of(problem: Problem, fitted: Fitted, ordinary: Comparison, named: Sequence[Shift] = ()) -> Model:
    """Scan a fit and compare it with ordinary drives.

    Args:
        problem: of the drive.
        fitted: to it.
        ordinary: what the drive is compared with.
        named: candidates of the fit's effects.
    """
    scan = scan_drive(problem, fitted)
    scores = scan.scores()
    beside = named_in(scan.keys)
    in_ordinary = [key for shift in named for key in shift.compared.keys]
    compared = _further(scan.compared, ordinary.unnamed, in_ordinary)
    found = [shift_of(item, scores, ordinary, beside, in_ordinary) for item in compared]
    known = [item for item in found if item is not None]
    shifts = sorted(_against_the_rest(known, problem, scores), key=lambda item: (item.probability, -item.distance))
    pulls = tuple(
        Pull(name, moved / ordinary.usual_move(name), ordinary.move_degrees)
        for name, moved in moved_parameters(problem, fitted).items()
    )
    misfit = {name: value for name, value in channel_misfit(problem, fitted).items() if name in CHANNELS}
    rises = channel_rises(misfit, ordinary.misfits, ordinary.expected, ordinary.misfit_errors)
    return Model(problem, fitted, scan, tuple(shifts), pulls, tuple(named), rises)


def _against_the_rest(shifts: Sequence[Shift], problem: Problem, scores: Scores) -> list[Shift]:
    """Shifts, those of effects in a part of the drives against the rest of them where that says more surely."""
    windows = problem.blocked.windows
    parts, looks = parts_tried(windows), looks_of(windows)
    return [
        _surer(replace(shift, looks=parts), contrast_of(shift.compared, scores, looks))
        if shift.compared.name in problem.spells
        else shift
        for shift in shifts
    ]


def _surer(shift: Shift, other: Shift | None) -> Shift:
    """Whichever ordinary drives show less often."""
    found = [shift] if other is None else [shift, other]
    return min(found, key=lambda item: family_probability(item.probability, item.looks))


def _further(library: Sequence[Compared], unnamed: Container[str], known: Sequence[str]) -> list[Compared]:
    """Candidates that can be what changed beside those of some keys in ordinary drives.

    A patch has the keys of a changed soil there, which is then no further effect.
    """
    return [item for item in library if item.name not in unnamed and not set(item.keys) & set(known)]


def farthest(shifts: Sequence[Shift], tests: int) -> float:
    """Largest distance over its limit of several shifts, each one of so many tests."""
    return max((s.distance / s.limit(tests) for s in shifts if s.probability < 1.0), default=0.0)
