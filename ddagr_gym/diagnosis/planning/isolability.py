"""Before any data: which effects some manoeuvres and sensors could show, how small, and which they could tell apart.

From the sensitivities of planned drives (:mod:`ddagr_gym.diagnosis.planning.planned_drive`) with windows' unknowns and
nominal parameters projected out follow, to first order in the sizes,

- the least detectable size: the one that passes the gate nine times in ten; its expected gain is half its squared
  sensitivity;
- isolability of one effect against another: the share of its sensitivity that the other cannot imitate at any likely
  size of its own (prior of :mod:`ddagr_gym.identification.size_prior`), in the worst of its detectable sizes;
- the size from which the two are told apart: where the expected gains differ so far that the wrong name keeps a weight
  of 5 percent (:func:`ddagr_gym.diagnosis.result.equivalence.runs_apart`). Where that is less than the library's form
  of the right name may lose, no size is told apart.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.control.manoeuvres import Manoeuvre
from ddagr_gym.diagnosis.gates.thresholds import LEVEL, Gate, Thresholds
from ddagr_gym.diagnosis.planning.planned_drive import plan, with_room
from ddagr_gym.diagnosis.result.detectable import Detectable, detectable, least_multiple
from ddagr_gym.diagnosis.result.equivalence import runs_apart
from ddagr_gym.diagnosis.result.files import finite_or_null
from ddagr_gym.diagnosis.search.candidates import Candidate
from ddagr_gym.diagnosis.search.inner_products import Terms
from ddagr_gym.diagnosis.search.scan import scan
from ddagr_gym.diagnosis.setting import Setting
from ddagr_gym.identification.nuisances import NuisancePriors
from ddagr_gym.identification.size_prior import TYPICAL_MULTIPLE
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.physics.effects import Effect

Array = NDArray[np.float64]

SCHEMA = "ddagr-isolability/1"

ALIKE = 0.2
"""Isolability below which a pair counts as confused (ours: telling apart takes twice the detectable size and more)."""

CHANCE = "chi-square"
"""Source of gates that come from no null bank."""


@dataclass(frozen=True)
class Isolability:
    """The table.

    Attributes:
        robot: name.
        soil: name.
        manoeuvres: names.
        duration: of all of them [s].
        sensors: names.
        gates: where they come from.
        effects: names, in the order of rows and columns.
        detectable: one per size of an effect.
        share: (n, n) share of the row's sensitivity that the column cannot imitate; NaN on the diagonal.
        apart: (n, n) multiples of the row's least meaningful size from which it is told from the column.
        soil_uncertainty: factor on how far the soil may be from the nominal one.
    """

    robot: str
    soil: str
    manoeuvres: tuple[str, ...]
    duration: float
    sensors: tuple[str, ...]
    gates: str
    effects: tuple[str, ...]
    detectable: tuple[Detectable, ...]
    share: tuple[tuple[float, ...], ...]
    apart: tuple[tuple[float, ...], ...]
    soil_uncertainty: float = 1.0

    def of(self, effect: str) -> Detectable:
        """The size of an effect that shows best."""
        return min((item for item in self.detectable if item.effect == effect), key=lambda item: item.multiples)

    def confused(self, effect: str) -> tuple[str, ...]:
        """Effects that imitate an effect all but :data:`ALIKE` of it, the closest first."""
        row = self.share[self.effects.index(effect)]
        pairs = [(value, name) for value, name in zip(row, self.effects, strict=True) if value < ALIKE]
        return tuple(name for _, name in sorted(pairs))

    def as_mapping(self) -> dict[str, Any]:
        """As it stands in ``isolability.json``; what cannot be seen or told apart is null."""
        mapping = {
            "schema": SCHEMA,
            "robot": self.robot,
            "soil": self.soil,
            "soil_uncertainty": self.soil_uncertainty,
            "manoeuvres": list(self.manoeuvres),
            "duration": self.duration,
            "sensors": list(self.sensors),
            "gates": self.gates,
            "effects": {
                name: {
                    "detectable": [_entry(item) for item in self.detectable if item.effect == name],
                    "confused_with": list(self.confused(name)),
                }
                for name in self.effects
            },
            "isolability": _pairs(self.effects, self.share),
            "told_apart_from_multiples": _pairs(self.effects, self.apart),
        }
        return {key: finite_or_null(value) for key, value in mapping.items()}


def _entry(item: Detectable) -> dict[str, Any]:
    """A size without the effect that it belongs to."""
    return {key: value for key, value in asdict(item).items() if key != "effect"}


def _pairs(names: Sequence[str], table: Sequence[Sequence[float]]) -> dict[str, dict[str, float]]:
    return {
        row: {column: value for column, value in zip(names, values, strict=True) if column != row}
        for row, values in zip(names, table, strict=True)
    }


def isolability(
    robot: Robot,
    soil: Soil,
    manoeuvres: Sequence[Manoeuvre],
    sensors: Sequence[str],
    *,
    thresholds: Thresholds | None = None,
    kinds: Mapping[str, type[Effect]] | None = None,
    setting: Setting | None = None,
    seed: int = 0,
    soil_name: str = "",
    soil_uncertainty: float = 1.0,
    progress: Callable[[str], None] = lambda name: None,
) -> Isolability:
    """Table of manoeuvres and sensors (theory: diagnosis, section 12).

    Args:
        robot: nominal.
        soil: nominal.
        manoeuvres: see :func:`ddagr_gym.diagnosis.planning.planned_drive.plan`.
        sensors: see there.
        thresholds: of a null bank; gates for normal errors (:func:`chance_gates`) without them.
        kinds: effects by name, the library by default. Held readings are found in the values themselves, left out.
        setting: of the diagnosis; windows as those of the thresholds, shorter where a manoeuvre is short, by default.
        seed: see :func:`ddagr_gym.diagnosis.planning.planned_drive.plan`.
        soil_name: for the table.
        soil_uncertainty: factor on how far the soil may be from the nominal one, where no setting is given.
        progress: called with the name of each effect when it is done.

    Raises:
        InputError: see :func:`ddagr_gym.diagnosis.planning.planned_drive.plan`.
    """
    if setting is None:
        setting = Setting(priors=NuisancePriors().with_soil(soil_uncertainty))
        if thresholds is not None:
            setting = with_room(setting.with_windows(thresholds.duration), manoeuvres)
    planned = plan(robot, soil, manoeuvres, sensors, seed=seed, setting=setting)
    terms = scan(planned.problem, planned.fitted, kinds, progress)
    gates = chance_gates(terms) if thresholds is None else thresholds.for_length(planned.problem.covered)
    matrix = terms.reduced().information
    names = tuple(dict.fromkeys(c.name for c in terms.candidates))
    sizes = {name: _directions(name, terms, matrix, gates.of(name)) for name in names}
    share = np.full((len(names), len(names)), np.nan)
    apart = np.full((len(names), len(names)), np.nan)
    for i, row in enumerate(names):
        for j, column in enumerate(names):
            if i != j:
                share[i, j], apart[i, j] = _pair(sizes[row], column, terms, matrix)
    return Isolability(
        robot.name,
        soil_name,
        tuple(m.name for m in manoeuvres),
        math.fsum(m.duration for m in manoeuvres),
        tuple(sensors),
        f"null bank {gates.bank} of {gates.nulls} drives" if gates.nulls else gates.bank,
        names,
        tuple(item for name in names for item in _best_by_field([d.size for d in sizes[name]])),
        tuple(map(tuple, share.tolist())),
        tuple(map(tuple, apart.tolist())),
        soil_uncertainty,
    )


def chance_gates(terms: Terms) -> Thresholds:
    """Gates that pure normal noise passes in any effect with probability :data:`LEVEL`, no null bank needed.

    Twice the gain of an effect with k probes is at most chi-square distributed with k degrees of freedom; the level is
    divided among the effects by Sidak's rule. Real drives need the wider gates of a null bank.
    """
    from scipy.stats import chi2

    names = list(dict.fromkeys(c.name for c in terms.candidates))
    probes = {name: sum(len(c.columns) for c in terms.candidates if c.name == name) for name in names}
    quantile = (1.0 - LEVEL) ** (1.0 / len(names))
    gates = {name: Gate(0.5 * float(chi2.ppf(quantile, probes[name])), 0.0) for name in names}
    return Thresholds(gates, {}, 0, CHANCE)


@dataclass(frozen=True)
class _Direction:
    """One probe of an effect, and what it takes to see it."""

    candidate: Candidate
    column: int
    least: float  # multiple of the probe that is the least meaningful size
    size: Detectable


def _directions(name: str, terms: Terms, matrix: Array, gate: Gate) -> list[_Direction]:
    """Probes of an effect's best-placed candidate; of limits and flips those that the table states."""
    own = [c for c in terms.candidates if c.name == name]
    absorbed = terms.absorbed.get(name, 0.0)
    found = [
        [
            _Direction(
                c, column, least_multiple(c, k), detectable(c, k, float(matrix[column, column]), gate, 1.0, absorbed)
            )
            for k, column in enumerate(c.columns)
        ]
        for c in own
    ]
    if not own[0].has_sizes:
        every = [item for group in found for item in group]
        stated = _best_by_field([item.size for item in every])
        return [item for item in every if item.size in stated]
    return min(found, key=lambda group: min(item.size.multiples for item in group))


def _best_by_field(sizes: Sequence[Detectable]) -> list[Detectable]:
    """One entry per field; of an effect's limits the mildest that shows, of directions the one that shows worst."""
    found: dict[str, Detectable] = {}
    for item in sizes:
        before = found.get(item.field)
        if before is None or _ranks_before(item, before):
            found[item.field] = item
    return list(found.values())


def _ranks_before(item: Detectable, before: Detectable) -> bool:
    limits = item.least_meaningful != before.least_meaningful
    if limits:
        shows, showed = item.multiples <= 1.0, before.multiples <= 1.0
        return shows > showed or (shows == showed and item.least_meaningful > before.least_meaningful)
    return item.multiples > before.multiples


def _pair(directions: Sequence[_Direction], rival: str, terms: Terms, matrix: Array) -> tuple[float, float]:
    """Share that a rival cannot imitate, and multiples from which the two are told apart; the worst direction's."""
    seen = [d for d in directions if d.size.multiples <= TYPICAL_MULTIPLE]
    rivals = [c for c in terms.candidates if c.name == rival]
    worst = (1.0, 0.0)
    for direction in seen or [min(directions, key=lambda d: d.size.multiples)]:
        own = float(matrix[direction.column, direction.column])
        if own <= 1e-12:
            return math.nan, math.inf
        imitated = max(_imitated(direction, c, matrix) for c in rivals)
        share = min(max(1.0 - imitated / own, 0.0), 1.0)
        # gains grow with the square of the size as they do with the number of drives
        needed = math.sqrt(runs_apart(0.5 * share * own, 0.5 * own)) / direction.least
        multiples = max(needed, _shown(direction, directions))
        if share < worst[0] or (share == worst[0] and multiples > worst[1]):
            worst = (share, multiples)
    return worst if worst[1] > 0.0 else (1.0, min(d.size.multiples for d in directions))


def _shown(direction: _Direction, directions: Sequence[_Direction]) -> float:
    """Multiples that the table states for the field of a direction: those of its worst one."""
    return max(d.size.multiples for d in directions if d.size.field == direction.size.field)


def _imitated(direction: _Direction, rival: Candidate, matrix: Array) -> float:
    """Information of a probe that a rival's probes explain, at a typical size of the probe."""
    columns = np.array(rival.columns)
    cross = matrix[columns, direction.column]
    inside = matrix[np.ix_(columns, columns)]
    if rival.whole is not None:
        # all or nothing, and of the sign that suits it
        size = TYPICAL_MULTIPLE * direction.least
        gain = rival.whole * size * abs(float(cross[0])) - 0.5 * rival.whole**2 * float(inside[0, 0])
        return max(2.0 * gain / size**2, 0.0)
    inside = inside + np.diag(1.0 / np.array(rival.scales) ** 2 + 1e-9 * np.maximum(np.diag(inside), 1e-12))
    return float(cross @ np.linalg.solve(inside, cross))
