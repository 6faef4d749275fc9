"""Which parts of the robot its drives support, by forecasts of left-out drives (backward elimination).

Every part is taken out in turn, what is fitted least often first. It stays out unless the forecasts of the left-out
drives become worse than the best so far by 2 % and by more than the standard error of that change between drives (the
one-standard-error rule; L. Breiman et al., Classification and Regression Trees, 1984, section 3.4.3), with Student's t
for few drives: of all parts together no more than that is given away. Of what nearly every robot has, the dead time,
2 % are enough: there the burden of proof is on its absence.
Forecasts are compared in what a drivetrain moves by itself, wheel speeds and the motors' currents: yaw rate and place
follow from them through the soil, whose own errors a wrong wheel speed may make up for, and places are the integral of
both, so that few large errors decide there.
A part is missed only by a fit that is settled, that has had steps enough, or that stays far above the fit with it, and
never by one that fits as well: that is a point of the model with the part, so that what forecasts differ by is where
fits stop. What is given away is compared with the best so far and with the same model with the part, whichever says
more surely that it is missed: one drive that the best so far happens to forecast badly would hide what all others miss.
The best so far counts where it is the better fit, and all parts together always.
What acts through parts that have all gone goes with them. Parts that make the wheels late stand for one another: a fit
without ramp or filter is also tried from a longer dead time, one without a filter from slower motors, and a ramp or a
filter that stayed where the dead time went gives way to a dead time that forecasts as well. One without friction is
also tried from an integral part that is less by what undoes friction.
What was kept by little, or hardly acts where the fit stands in the end, is asked for again when others have gone: with
all parts free, a fit without it may stop where others half stand in for it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial

from ddagr_gym.calibration.exchanged_parts import DELAY, FILTER, RAMP, other_starts, with_late_commands
from ddagr_gym.calibration.joint_fit import Standing
from ddagr_gym.calibration.part_comparison import (
    HOPELESS,
    Candidate,
    Comparison,
    is_missed,
    least_growth,
    mean_growth,
    misses,
    worse_by,
)
from ddagr_gym.calibration.parts import PARTS, Part, RobotModel, idle_parts, part_named
from ddagr_gym.calibration.result import PartDecision
from ddagr_gym.diagnosis.store import StepCache

DOUBTFUL = 2.0
"""Times the growth by which a part is missed, up to which one that was kept is asked for again (ours): a simulated
robot without friction missed it by 1.06 times that beside an integral part that undid it."""

HARDLY = 0.1
"""Growth of the cost where a fit stands, below which a part hardly acts there (ours): a simulated robot kept friction
of 0, because a fit without it had stopped far off beside a filter."""

FitFrom = Callable[[str, Standing], "Candidate"]
"""A model, fitted from a start; the text tells fits of the same parts apart among the finished steps."""


@dataclass(frozen=True, eq=False)
class Selection:
    """Parts that forecasts of left-out drives ask for.

    Attributes:
        left_out: names of the others.
        decisions: one per part that was tried, in that order.
        standing: of the model with the parts that are kept.
    """

    left_out: frozenset[str]
    decisions: tuple[PartDecision, ...]
    standing: Standing


def select_parts(
    comparison: Comparison,
    model: RobotModel,
    full: Candidate,
    cache: StepCache,
    progress: Callable[[str], None],
) -> Selection:
    """Take parts out one after the other while forecasts of left-out drives do not suffer.

    Args:
        comparison: what models are fitted to and forecast.
        model: with all parts that may be taken out.
        full: the same, fitted.
        cache: of models that are fitted already.
        progress: called with a line of text for each part.
    """
    elimination = Elimination(comparison, model, full, cache, progress)
    for part in elimination.parts:
        elimination.ask(part)
    elimination.ask_again()
    for name in (RAMP, FILTER):
        elimination.try_delay_for(name)
    elimination.drop_idle()
    return Selection(elimination.left_out, tuple(elimination.decisions.values()), elimination.best.standing)


class Elimination:
    """Parts taken out of a model one after the other, as far as they were asked for; made as :func:`select_parts`."""

    def __init__(
        self,
        comparison: Comparison,
        model: RobotModel,
        full: Candidate,
        cache: StepCache,
        progress: Callable[[str], None],
    ) -> None:
        self._comparison, self._model, self._full = comparison, model, full
        self._cache, self._progress = cache, progress
        self._least = full
        self.parts = tuple(part for part in PARTS if model.free & set(part.parameters))
        self.best, self.left_out = full, frozenset[str]()
        self.decisions: dict[str, PartDecision] = {}
        self._asked_with: dict[str, frozenset[str]] = {}

    def ask(self, part: Part) -> bool:
        """Take a part out unless forecasts miss it; whether it went."""
        again = part.name in self.decisions
        count = ", once more" if again else f": {self.parts.index(part) + 1} of {len(self.parts)} parts"
        self._progress(f"forecasts of left-out drives without {part.title}{count}")
        before, out = (self._full, self._least, self.best), self.left_out | {part.name}
        fit = partial(self._fitted_without, out)
        starts = other_starts(part.name, self.best.standing, self._model.robot, self.left_out)
        tried = _settled(fit, before, self._comparison.settlings, part.usual)
        tried, (kept, growth, error) = from_other_starts(tried, before, starts, fit, part.usual)
        self.decisions[part.name] = PartDecision(part.name, kept, growth, error)
        self._asked_with[part.name] = out
        if not kept:
            self.best, self.left_out = tried, out
            self._least = min(self._least, tried, key=partial(mean_growth, self._full))
        return not kept

    def ask_again(self) -> None:
        """Ask again for what is doubtful until nothing goes."""
        went = True
        while went:
            kept = [part_named(name) for name, item in self.decisions.items() if item.kept]
            went = sum(self.ask(part) for part in kept if self._is_doubtful(part)) > 0

    def _is_doubtful(self, part: Part) -> bool:
        """Whether others have gone since a part was asked for, and it was kept by little or hardly acts now."""
        if self._asked_with[part.name] == self.left_out | {part.name}:
            return False
        decision = self.decisions[part.name]
        needed = least_growth(decision.error, len(self.best.losses), part.usual)
        return decision.growth < DOUBTFUL * needed or self._hardly_acts(part)

    def _hardly_acts(self, part: Part) -> bool:
        """Whether a part may be taken out where the fit stands, without another step."""
        cost = self._comparison.cost(self._without(self.left_out | {part.name}), self.best.standing)
        return cost < (1.0 + HARDLY) * self.best.cost

    def try_delay_for(self, name: str) -> None:
        """A dead time in place of ramp or filter where it has gone and they stayed: all make the wheels late.

        Nearly every robot has a dead time and few have the others. Where forecasts do not suffer it takes their place,
        and is kept as any other part is, if forecasts without it are worse.
        """
        if DELAY not in self.left_out or name in self.left_out or name not in self._model.free:
            return
        self._progress(f"forecasts of left-out drives with a dead time in place of the {part_named(name).title}")
        exchanged, neither = (self.left_out - {DELAY}) | {name}, self.left_out | {name}
        start = with_late_commands(self.best.standing)
        late = self._fitted(f"{DELAY} for {name}", exchanged, start, self.best)
        growth, error = worse_by(self.best, late)
        if is_missed(growth, error, len(late.losses)):
            return
        prompt = self._fitted(f"neither {DELAY} nor {name}", neither, late.standing, late)
        missed, its_growth, its_error = misses((late,), prompt, usual=True)
        if not missed:
            return
        self.decisions[DELAY] = PartDecision(DELAY, True, its_growth, its_error)
        self.decisions[name] = PartDecision(name, False, growth, error)
        self.best, self.left_out = late, exchanged

    def drop_idle(self) -> None:
        """Take out what acts through parts that have all gone."""
        idle = idle_parts(self.left_out, self._comparison.data.robot)
        if not idle:
            return
        self.left_out |= idle
        self.best = self._fitted_without(self.left_out, "", self.best.standing)
        for name in idle & self.decisions.keys():
            self.decisions[name] = replace(self.decisions[name], kept=False)

    def _without(self, parts: frozenset[str]) -> RobotModel:
        return self._model.without(parts, self._comparison.data.robot)

    def _fitted_without(self, parts: frozenset[str], stage: str, start: Standing) -> Candidate:
        """Model without some parts, fitted from a start; ``stage`` tells fits of the same parts apart in the cache."""
        return self._fitted(f"without {' '.join(sorted(parts))}{stage}", parts, start, self.best)

    def _fitted(self, key: str, parts: frozenset[str], start: Standing, rival: Candidate) -> Candidate:
        made = partial(self._comparison.candidate, self._without(parts), start, rival=rival.cost)
        return self._cache(key, made)


def _settled(fit: FitFrom, before: tuple[Candidate, ...], settlings: int, usual: bool) -> Candidate:
    """A model without a part, fitted from where the last of those before stands; further while it misses the part."""
    tried = fit("", before[-1].standing)
    for time in range(settlings):
        missed, growth, _ = misses(before, tried, usual)
        if not missed or tried.standing.converged or growth > HOPELESS:
            break
        tried = fit(f", settling {time + 1}", tried.standing)
    return tried


def from_other_starts(
    tried: Candidate,
    before: tuple[Candidate, ...],
    starts: Iterable[tuple[str, Standing]],
    fit: FitFrom,
    usual: bool = False,
) -> tuple[Candidate, tuple[bool, float, float]]:
    """A model without a part or, as long as that misses the part, what fits best of it and of fits from other starts.

    Args:
        tried: the model.
        before: models with the part, as of :func:`misses`.
        starts: where else it may begin, as of :func:`~ddagr_gym.calibration.exchanged_parts.other_starts`.
        fit: from such a start.
        usual: whether nearly every robot has the part.

    Returns:
        The model, and what :func:`misses` says of it.
    """
    found = misses(before, tried, usual)
    for stage, start in starts:
        if not found[0]:
            break
        tried = min(tried, fit(stage, start), key=lambda item: item.cost)
        found = misses(before, tried, usual)
    return tried, found
