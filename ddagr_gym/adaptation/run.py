"""Adapt a controller to a corrected simulator: what it knows, what it is taught, its gains, and what is kept."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import stdtrit

from ddagr_gym.adaptation.corrected import Corrected
from ddagr_gym.adaptation.teaching import taught
from ddagr_gym.adaptation.turns import DrivenTurn, MeasuredTurns, sizes
from ddagr_gym.control.pid import PidGains
from ddagr_gym.control.tracker_settings import LoopSettings, TrackerSettings
from ddagr_gym.errors import unknown_name
from ddagr_gym.estimation.filter_model import SoilPrior
from ddagr_gym.estimation.force_laws import ForceLaw
from ddagr_gym.evaluation.adapted_controller import AdaptedSettings
from ddagr_gym.evaluation.bundles import Bundle
from ddagr_gym.evaluation.force_law_fits import fit_to_soil
from ddagr_gym.evaluation.gain_search import Outcome, SearchBox, Wanted, episodes_of, objective, search_box
from ddagr_gym.evaluation.ladder_gains import ladder_gains, tracker_settings
from ddagr_gym.parameters import STANDARD_GRAVITY, Robot, Soil

_TEACHING, _SELECTION, _REPORT = 1000, 2000, 3000
"""First numbers of the turns that teach, that decide what is kept, and that are reported; the search has 0 on."""

_KNOWN_SOIL = {"B4": 0.5, "B6": 1.0}
"""Deviations of the filter's prior, once a soil was refitted, over those of all soils (ours). With half of them
B6 made half of the turns on a slope in another simulator, before its filter was told of slopes and drag."""


_FARTHEST = 1.5
"""Of B6's gains, over those that it has, or one over it (ours). With a factor of 3 a look-ahead of half a second came
out of turns with a late command, which made the robot swing in another simulator."""


@dataclass(frozen=True)
class Effort:
    """How many turns are driven.

    Attributes:
        rounds: of teaching.
        taught: turns of a round, both sides together.
        stages: (candidates, turns) of the search for gains.
        selection: turns that decide what is kept.
        report: turns of before and after.
    """

    rounds: int = 3
    taught: int = 6
    stages: tuple[tuple[int, int], ...] = ((8, 4), (3, 8))
    selection: int = 16
    report: int = 20

    def turns(self, controller: str) -> int:
        """All turns together; only B4 is taught."""
        teaching = (self.rounds + 1) * self.taught if controller == "B4" else 0
        return teaching + episodes_of(self.stages) + 3 * self.selection + 2 * self.report


@dataclass(frozen=True, eq=False)
class Adapted:
    """What came of an adaptation.

    Attributes:
        bundle: what is kept.
        nominal: what there was before.
        kept: "nominal", "known" (the corrected robot, soil and sensors alone), and with gains too "tuned" (B6) or
            "taught" (B4, which gets a feed-forward besides).
        scores: objective of each of the three in the corrected simulator, lower is better.
        used: names of effects that filter and controller know themselves.
        search: record of the search for gains.
        before: turns of the nominal controller in the corrected simulator.
        after: the same turns by what is kept.
    """

    bundle: Bundle
    nominal: Bundle
    kept: str
    scores: dict[str, float]
    used: tuple[str, ...]
    search: dict[str, Any]
    before: tuple[DrivenTurn, ...]
    after: tuple[DrivenTurn, ...]


def adapted(
    corrected: Corrected,
    nominal_robot: Robot,
    nominal_soil: Soil,
    turns: MeasuredTurns,
    *,
    controller: str = "B4",
    row_heading: float = 0.0,
    effort: Effort = Effort(),
    seed: int = 0,
) -> Adapted:
    """Adapt a controller to a corrected simulator.

    Args:
        corrected: the simulator.
        nominal_robot: that the controller knew before.
        nominal_soil: likewise.
        turns: in the corrected simulator.
        controller: one of :data:`ADAPTABLE`.
        row_heading: of the rows in the world of the recordings' poses [rad].
        effort: how many turns are driven.
        seed: of the candidates' gains.

    Raises:
        InputError: another controller, or the robot cannot make the turn on this soil.
    """
    plain = nominal_settings(controller)
    nominal = Bundle(plain, nominal_robot, nominal_soil)
    prior = refitted_prior(corrected.robot, corrected.soil, _KNOWN_SOIL[controller])
    settings = replace(plain, row_heading=row_heading, soil_prior=prior, sensors=corrected.sensors)
    known = Bundle(settings, corrected.robot, corrected.soil, corrected.all_effects)
    name, improved, record = _improved(known, turns, effort, seed)
    candidates = {"nominal": nominal, "known": known, name: improved}
    deciding = range(_SELECTION, _SELECTION + effort.selection)
    driven = {name: turns.measure_all(item, deciding) for name, item in candidates.items()}
    scores = {name: score(own) for name, own in driven.items()}
    kept = _kept(driven, scores)
    shown = range(_REPORT, _REPORT + effort.report)
    return Adapted(
        bundle=candidates[kept],
        nominal=nominal,
        kept=kept,
        scores=scores,
        used=() if kept == "nominal" else known.used,
        search=record,
        before=tuple(turns.measure_all(nominal, shown)),
        after=tuple(turns.measure_all(candidates[kept], shown)),
    )


ADAPTABLE = ("B4", "B6")
"""Controllers that can be adapted."""


def nominal_settings(controller: str) -> AdaptedSettings:
    """Of a controller as it is shipped.

    Raises:
        InputError: it is none of :data:`ADAPTABLE`.
    """
    if controller not in ADAPTABLE:
        raise unknown_name("controller that can be adapted", controller, ADAPTABLE)
    return AdaptedSettings(tracker=tracker_settings() if controller == "B6" else None)


def _improved(known: Bundle, turns: MeasuredTurns, effort: Effort, seed: int) -> tuple[str, Bundle, dict[str, Any]]:
    """What turns in the corrected simulator make of a controller, what that is called, and the search's record."""
    tracker = known.settings.tracker
    if tracker is not None:
        tuned, record = _tuned_tracker(known, tracker, turns, effort, seed)
        return "tuned", tuned, record
    lessons = range(_TEACHING, _TEACHING + effort.taught)
    learnt, record = _tuned(taught(known, turns, lessons, effort.rounds), turns, effort, seed)
    return "taught", taught(learnt, turns, lessons, 1), record


def score(driven: Sequence[DrivenTurn]) -> float:
    """The search's objective of driven turns, lower is better."""
    return objective([(item.error, item.success) for item in driven])


def _kept(driven: Mapping[str, Sequence[DrivenTurn]], scores: Mapping[str, float]) -> str:
    """Of B4 the best; of B6 what it knows, unless the nominal one or searched gains are better beyond doubt."""
    if "tuned" not in driven:
        return min(scores, key=lambda name: scores[name])
    better = [name for name in ("nominal", "tuned") if surely_better(driven[name], driven["known"])]
    return min(better, key=lambda name: scores[name], default="known")


def surely_better(driven: Sequence[DrivenTurn], than: Sequence[DrivenTurn]) -> bool:
    """Whether turns are better than the same turns driven otherwise, by a one-sided paired t test at 95 %.

    Gains that a search prefers by less than its turns can tell are as often worse in another simulator. A turn counts
    with its radius error, at most 1, and 1 more where it fails.
    """
    own, other = (sizes(turns) + [not item.success for item in turns] for turns in (driven, than))
    gained = other - own
    doubt = float(np.std(gained, ddof=1) / math.sqrt(len(gained)))
    return float(gained.mean()) > float(stdtrit(len(gained) - 1, 0.95)) * doubt


def refitted_prior(robot: Robot, soil: Soil, known: float) -> SoilPrior:
    """The filter's prior of a soil that was refitted: its force law there.

    Args:
        robot: that was refitted.
        soil: likewise.
        known: deviations over those of all soils [-].

    Raises:
        InputError: a soil into which the robot sinks.
    """
    fit = fit_to_soil(ForceLaw.coupled, robot, soil)
    limit, rate, stiffness, resistance = np.exp(fit.logs).tolist()
    usual = SoilPrior()
    return SoilPrior(
        traction_limit_over_load=limit / (robot.mass * STANDARD_GRAVITY / 4.0),
        traction_rate=rate,
        coupling=stiffness / (limit * rate),
        resistance_over_limit=resistance / limit,
        traction_limit_deviation=known * usual.traction_limit_deviation,
        traction_rate_deviation=known * usual.traction_rate_deviation,
        coupling_deviation=usual.coupling_deviation,
        resistance_deviation=known * usual.resistance_deviation,
    )


def _tuned(bundle: Bundle, turns: MeasuredTurns, effort: Effort, seed: int) -> tuple[Bundle, dict[str, Any]]:
    """B4 with the best gains of the search, and its record."""
    before = ladder_gains().force_balance.gains
    box = SearchBox(
        (("proportional", 0.02, 5.0), ("integral", 0.05, 20.0), ("derivative", 1e-4, 0.3)),
        (before.proportional, before.integral, before.derivative),
    )

    def with_gains(values: dict[str, float]) -> Bundle:
        loop = LoopSettings(PidGains(**values, limit=before.limit), bundle.settings.gains.lead_factor)
        return bundle.with_settings(replace(bundle.settings, gains=loop))

    return _searched(box, with_gains, turns, effort, seed)


def _tuned_tracker(
    bundle: Bundle, tracker: TrackerSettings, turns: MeasuredTurns, effort: Effort, seed: int
) -> tuple[Bundle, dict[str, Any]]:
    """B6 with the best gains of the search around those that it has, and its record."""
    gains = tracker.loop.gains
    start = {"proportional": gains.proportional, "course": tracker.course, "ahead": tracker.ahead}
    ranges = tuple((name, value / _FARTHEST, value * _FARTHEST) for name, value in start.items())
    box = SearchBox(ranges, tuple(start.values()))

    def with_gains(values: dict[str, float]) -> Bundle:
        loop = replace(tracker.loop, gains=replace(gains, proportional=values["proportional"]))
        own = replace(tracker, loop=loop, course=values["course"], ahead=values["ahead"])
        return bundle.with_settings(replace(bundle.settings, tracker=own))

    return _searched(box, with_gains, turns, effort, seed)


def _searched(
    box: SearchBox, with_gains: Callable[[dict[str, float]], Bundle], turns: MeasuredTurns, effort: Effort, seed: int
) -> tuple[Bundle, dict[str, Any]]:
    """The best of a search's bundles, and its record."""

    def drive(wanted: Sequence[Wanted]) -> list[Outcome]:
        found = [turns.measure(with_gains(values), number) for values, number in wanted]
        return [(item.error, item.success) for item in found]

    record = search_box(box, drive, effort.stages, seed)
    return with_gains(record["best"]), record
