"""Arms of the ablation that scan the library: as it is, nominal fixed, no null bank, BIC forward, one long roll-out.

All say what they say after the first scan, before any joint refit: the search of a diagnosis goes on from there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

from ddagr_gym.diagnosis.gates.thresholds import Gate, Thresholds
from ddagr_gym.diagnosis.preprocessing.mended_recordings import MendedRecordings
from ddagr_gym.diagnosis.search.candidates import Candidate
from ddagr_gym.diagnosis.search.scanned_model import ScannedModel, scan_model
from ddagr_gym.identification.gauss_newton import Fitted, cost_of
from ddagr_gym.identification.misfit import roughest
from ddagr_gym.identification.nuisances import LOCAL, Nuisances
from ddagr_gym.identification.problem import Problem
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.parameters import Soil
from ddagr_gym.physics.effects.registry import effect_kinds

_LOCKED = 1e-6
"""Deviation that allows nothing, in any unit of a local variation; zero would divide by it."""

_CERTAIN = 1e9
"""Gain over a gate where none was needed."""

_LEVEL = 0.05
_DIRECTIONS = 3
"""Degrees of freedom of the largest candidates: two sizes and the choice among places or moments."""


@dataclass(frozen=True)
class First:
    """What a first scan says of a case.

    Attributes:
        name: effect that stands first, "" for none.
        passes: whether it passes its gate.
        ratio: its gain over its gate.
        rough: largest misfit of a channel over its limit; 0 where the arm has no limits.
    """

    name: str
    passes: bool
    ratio: float
    rough: float = 0.0

    @property
    def alarm(self) -> bool:
        """Whether it says that something is missing, with or without a name."""
        return self.passes or self.rough > 1.0

    def as_mapping(self) -> dict[str, object]:
        """For JSON."""
        return asdict(self) | {"alarm": self.alarm}


def from_values(mended: MendedRecordings) -> First | None:
    """What the readings themselves show before any simulation, alike in all arms that scan; None for nothing."""
    return First(mended.names[0], True, _CERTAIN) if mended.names else None


def first_of(scans: Sequence[ScannedModel], thresholds: Thresholds) -> First:
    """The effect that a search tries first: by how much its gain exceeds its gate, those that pass before the others.

    Args:
        scans: at one or two nominal models; each effect has the larger of its gains.
        thresholds: of the gates and of the misfit of the first.
    """
    _, rough = roughest(scans[0].misfit, dict(thresholds.misfit))
    found = [
        (thresholds.passes(gain.name, gain.gain, scan), gain.gain - thresholds.of(gain.name).gain, gain)
        for scan in scans
        for gain in scan.gains
    ]
    passes, _, gain = max(found, key=lambda item: item[:2])
    return First(gain.name, passes, gain.gain / thresholds.of(gain.name).gain, rough)


def noise_thresholds(problem: Problem) -> Thresholds:
    """Gates and limits that white noise alone would need: quantiles of chi-square, corrected for how many there are.

    Args:
        problem: whose means and windows are counted.
    """
    from scipy.stats import chi2

    names = tuple(effect_kinds())
    gate = Gate(0.5 * float(chi2.ppf(1.0 - _LEVEL / len(names), _DIRECTIONS)), 0.0)
    means = problem.blocked.mask.reshape(problem.blocked.sigma.shape).sum(axis=(0, 1))
    counts = dict(zip(CHANNELS, means.tolist(), strict=True)) | dict.fromkeys(LOCAL, problem.blocked.windows.count)
    share = 1.0 - _LEVEL / len(counts)
    limits = {name: float(chi2.ppf(share, count)) / count for name, count in counts.items() if count > 0}
    return Thresholds(dict.fromkeys(names, gate), limits, 0, "chi-square")


def bic_thresholds(problem: Problem, candidates: Sequence[Candidate]) -> Thresholds:
    """Gates of the Bayesian information criterion (G. Schwarz, Ann. Statist. 6 (1978) 461), and no limits of misfit.

    The criterion, twice the cost over the dispersion plus ln(readings) per parameter, falls where the gain exceeds half
    of the latter. Left-out windows are not asked. Forward selection takes the effect by which it falls most, which
    :func:`first_of` puts first.

    Args:
        problem: whose readings are counted: the block means of the windows, which use every sample once.
        candidates: of the scan.
    """
    each = 0.5 * math.log(max(float(problem.blocked.mask.sum()), 1.0))
    gates = {name: Gate(each * count, -math.inf) for name, count in parameter_counts(candidates).items()}
    return Thresholds(gates, {}, 0, "BIC")


def parameter_counts(candidates: Sequence[Candidate]) -> dict[str, int]:
    """Parameters that a scan fits, by effect: multiples fitted together, and shapes in which the candidates differ.

    A direction is two multiples; a flip or a limit is one; a patch has a place besides its sizes, a band a bearing and
    one size: of the two forms the one with more parameters counts.

    Args:
        candidates: of the scan.
    """
    by_form: dict[tuple[str, bool], list[Candidate]] = {}
    for candidate in candidates:
        by_form.setdefault((candidate.name, candidate.is_band), []).append(candidate)
    counts: dict[str, int] = {}
    for (name, _), found in by_form.items():
        counts[name] = max(counts.get(name, 0), max(len(c.columns) for c in found) + _shapes_tried(found))
    return counts


def _shapes_tried(candidates: Sequence[Candidate]) -> int:
    """Number of shapes of which the first probes of an effect's candidates try several values."""
    probes = [candidate.probes[0] for candidate in candidates]
    return sum(len({getattr(probe, name) for probe in probes}) > 1 for name in probes[0].shape_names())


def without_nuisances(problem: Problem, soil: Soil) -> Problem:
    """The problem with soil, robot, biases and local variations at their nominal values; only states are free.

    Args:
        problem: with its nuisances.
        soil: nominal.
    """
    parameters = tuple(replace(parameter, prior=0.0) for parameter in problem.nuisances.parameters)
    local = tuple(replace(unknown, deviation=_LOCKED) for unknown in problem.nuisances.local)
    return Problem(problem.robot, soil, problem.blocked, Nuisances(parameters, local))


def scan_raw_nominal(problem: Problem, raw: Fitted, soil: Soil) -> ScannedModel:
    """Scan at the raw nominal model with nothing but the windows' states eliminated.

    Args:
        problem: with its nuisances.
        raw: its raw nominal model, not refitted.
        soil: nominal.
    """
    fixed = without_nuisances(problem, soil)
    elimination = fixed.eliminate(raw.point, raw.prediction, raw.by_parameter)
    cost, shares = cost_of(fixed, raw.point, raw.prediction, elimination)
    return scan_model(fixed, replace(raw, cost=cost, elimination=elimination, window_cost=shares))
