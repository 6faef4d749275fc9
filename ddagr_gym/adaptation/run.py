"""Adapt a controller to a corrected simulator: what it knows, what it is taught, its gains, and what is kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ddagr_gym.adaptation.corrected import Corrected
from ddagr_gym.adaptation.teaching import taught
from ddagr_gym.adaptation.turns import DrivenTurn, MeasuredTurns
from ddagr_gym.control.pid import PidGains
from ddagr_gym.estimation.filter_model import SoilPrior
from ddagr_gym.estimation.force_laws import ForceLaw
from ddagr_gym.evaluation.adapted_controller import AdaptedSettings
from ddagr_gym.evaluation.bundles import Bundle
from ddagr_gym.evaluation.force_law_fits import fit_law, true_forces, turn_states
from ddagr_gym.evaluation.gain_search import Outcome, SearchBox, Wanted, episodes_of, objective, search_box
from ddagr_gym.evaluation.ladder_gains import LoopSettings, ladder_gains
from ddagr_gym.parameters import STANDARD_GRAVITY, Robot, Soil

_TEACHING, _SELECTION, _REPORT = 1000, 2000, 3000
"""First numbers of the turns that teach, that decide what is kept, and that are reported; the search has 0 on."""

_KNOWN_SOIL = 0.5
"""Deviations of the filter's prior, once a soil was refitted, over those of all soils (ours)."""


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
    selection: int = 8
    report: int = 20

    @property
    def turns(self) -> int:
        """All turns together."""
        return (self.rounds + 1) * self.taught + episodes_of(self.stages) + 3 * self.selection + 2 * self.report


@dataclass(frozen=True, eq=False)
class Adapted:
    """What came of an adaptation.

    Attributes:
        bundle: what is kept.
        nominal: what there was before.
        kept: "nominal", "known" (the corrected robot, soil and sensors alone) or "taught" (feed-forward and gains too).
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
    row_heading: float = 0.0,
    effort: Effort = Effort(),
    seed: int = 0,
) -> Adapted:
    """Adapt B4 to a corrected simulator.

    Args:
        corrected: the simulator.
        nominal_robot: that the controller knew before.
        nominal_soil: likewise.
        turns: in the corrected simulator.
        row_heading: of the rows in the world of the recordings' poses [rad].
        effort: how many turns are driven.
        seed: of the candidates' gains.

    Raises:
        InputError: the robot cannot make the turn on this soil.
    """
    settings = AdaptedSettings(row_heading=row_heading, soil_prior=refitted_prior(corrected.robot, corrected.soil))
    nominal = Bundle(AdaptedSettings(), nominal_robot, nominal_soil)
    known = Bundle(settings, corrected.robot, corrected.soil, corrected.all_effects)
    lessons = range(_TEACHING, _TEACHING + effort.taught)
    learnt, record = _tuned(taught(known, turns, lessons, effort.rounds), turns, effort, seed)
    candidates = {"nominal": nominal, "known": known, "taught": taught(learnt, turns, lessons, 1)}
    deciding = range(_SELECTION, _SELECTION + effort.selection)
    scores = {name: score(turns.measure_all(item, deciding)) for name, item in candidates.items()}
    kept = min(scores, key=lambda name: scores[name])
    shown = range(_REPORT, _REPORT + effort.report)
    return Adapted(
        bundle=candidates[kept],
        nominal=nominal,
        kept=kept,
        scores=scores,
        used=() if kept == "nominal" else known.known.used,
        search=record,
        before=tuple(turns.measure_all(nominal, shown)),
        after=tuple(turns.measure_all(candidates[kept], shown)),
    )


def score(driven: Sequence[DrivenTurn]) -> float:
    """The search's objective of driven turns, lower is better."""
    return objective([(item.error, item.success) for item in driven])


def refitted_prior(robot: Robot, soil: Soil) -> SoilPrior:
    """The filter's prior of a soil that was refitted: its force law there, with half the usual deviations."""
    states = turn_states(robot, np.random.default_rng(0))
    forces = true_forces(robot, soil, states)
    held = np.isfinite(forces).all(axis=1)
    fit = fit_law(ForceLaw.coupled, states[held], forces[held], robot.outer_radius)
    limit, rate, stiffness, resistance = np.exp(fit.logs).tolist()
    usual = SoilPrior()
    return SoilPrior(
        traction_limit_over_load=limit / (robot.mass * STANDARD_GRAVITY / 4.0),
        traction_rate=rate,
        coupling=stiffness / (limit * rate),
        resistance_over_limit=resistance / limit,
        traction_limit_deviation=_KNOWN_SOIL * usual.traction_limit_deviation,
        traction_rate_deviation=_KNOWN_SOIL * usual.traction_rate_deviation,
        coupling_deviation=usual.coupling_deviation,
        resistance_deviation=_KNOWN_SOIL * usual.resistance_deviation,
    )


def _tuned(bundle: Bundle, turns: MeasuredTurns, effort: Effort, seed: int) -> tuple[Bundle, dict[str, Any]]:
    """Bundle with the best gains of the search, and its record."""
    before = ladder_gains().force_balance.gains
    box = SearchBox(
        (("proportional", 0.02, 5.0), ("integral", 0.05, 20.0), ("derivative", 1e-4, 0.3)),
        (before.proportional, before.integral, before.derivative),
    )

    def with_gains(values: dict[str, float]) -> Bundle:
        loop = LoopSettings(PidGains(**values, limit=before.limit), bundle.settings.gains.lead_factor)
        return bundle.with_settings(replace(bundle.settings, gains=loop))

    def drive(wanted: Sequence[Wanted]) -> list[Outcome]:
        found = [turns.measure(with_gains(values), number) for values, number in wanted]
        return [(item.error, item.success) for item in found]

    record = search_box(box, drive, effort.stages, seed)
    return with_gains(record["best"]), record
