"""How small a size may be and still show: of one probe in some drives, and of every size of the library."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ddagr_gym.diagnosis.gates.thresholds import Gate, Thresholds
from ddagr_gym.diagnosis.search.candidates import Candidate, moved_field
from ddagr_gym.diagnosis.search.inner_products import Terms
from ddagr_gym.physics.effects import Effect

_NO_GAIN = 1e-12
"""Gain of a least meaningful size below which there is nothing but rounding."""


@dataclass(frozen=True)
class Detectable:
    """How small one size of an effect may be and still show.

    Attributes:
        effect: name.
        field: of the effect.
        unit: of the sizes.
        least_meaningful: distance from neutral below which nobody would care; of an effect that acts beyond a limit
            only, the limit that was tried.
        size: least detectable distance from neutral, infinite where nothing that can exist shows; a limit is given as
            it is.
        multiples: of the least meaningful size, by the square root of the gain.
    """

    effect: str
    field: str
    unit: str
    least_meaningful: float
    size: float
    multiples: float


def least_multiple(candidate: Candidate, k: int) -> float:
    """Multiple of a candidate's probe that is the least meaningful size; of a flip or a limit the whole of it."""
    probe = candidate.probes[k]
    if candidate.whole is not None:
        return candidate.whole
    _, data, away = moved_field(probe)
    return float(data["least"] / abs(away)) if probe.differentiable else 1.0


def detectable(
    candidate: Candidate, k: int, information: float, gate: Gate, dispersion: float = 1.0, absorbed: float = 0.0
) -> Detectable:
    """A probe's size that is named nine times in ten (theory: diagnosis, eq. (11)).

    Args:
        candidate: of the probe.
        k: its place in the candidate.
        information: that is left of the probe beside the nuisances.
        gate: of the effect; a size below its least meaningful one has to be unmistakable besides.
        dispersion: by which gains are divided.
        absorbed: size that a nuisance would take over, on top.
    """
    probe = candidate.probes[k]
    name, data, away = moved_field(probe)
    if candidate.has_sizes:
        distance = float(data["least"])
    else:
        distance = abs(float(getattr(probe, name)) if candidate.whole is None else candidate.whole * away)
    gain = 0.5 * least_multiple(candidate, k) ** 2 * max(information, 0.0)
    passing = _multiples(gate.detectable * dispersion, gain)
    if candidate.has_sizes:
        below = _multiples(gate.detectable_below_least * dispersion, gain)
        passing = max(passing, min(1.0 - absorbed / distance, below))
    multiples = passing + absorbed / distance
    if candidate.has_sizes:
        size = distance * multiples if distance * multiples <= probe.reach(name) else math.inf
    else:  # a limit or a flip is there or not
        size = distance if multiples <= 1.0 else math.inf
    return Detectable(candidate.name, name, str(data["unit"]), distance, size, multiples)


def _multiples(wanted: float, gain: float) -> float:
    """Multiples of a size by which its gain becomes the wanted one."""
    return math.sqrt(wanted / gain) if gain > _NO_GAIN else math.inf


def least_detectable(terms: Terms, thresholds: Thresholds, dispersion: float) -> Mapping[str, dict[str, float]]:
    """Distance of each size from neutral that is named nine times in ten, by effect and field.

    Of an effect that may act at any time or in any way, the usual one counts, which is its default (a change of soil
    from the beginning on); of one that has a place, the median over the discs that the drives touch. Of a limit stands
    the mildest of the tried ones that shows, as it is, and of a reversed sign 1. What a nuisance can take over (see
    :attr:`Terms.absorbed`) comes on top.
    """
    information = np.diag(terms.reduced().information)
    found: dict[str, dict[str, list[tuple[Candidate, Effect, float]]]] = {}
    for candidate in terms.candidates:
        if candidate.is_band:
            continue
        gate, absorbed = thresholds.of(candidate.name), terms.absorbed.get(candidate.name, 0.0)
        shown = [
            (probe, detectable(candidate, k, float(information[candidate.columns[k]]), gate, dispersion, absorbed))
            for k, probe in enumerate(candidate.probes)
        ]
        if candidate.is_direction:
            # any direction is as usual as another: the one that shows worst counts
            shown = [max(shown, key=lambda item: item[1].size)]
        for probe, item in shown:
            found.setdefault(item.effect, {}).setdefault(item.field, []).append((candidate, probe, item.size))
    return {effect: {field: _stated(sizes) for field, sizes in fields.items()} for effect, fields in found.items()}


def _stated(sizes: Sequence[tuple[Candidate, Effect, float]]) -> float:
    """The size that is stated of those of an effect's probes."""
    known = [size for _, _, size in sizes if math.isfinite(size)]
    if not sizes[0][0].has_sizes:
        return max(known, default=math.inf)
    usual = [size for candidate, probe, size in sizes if candidate.is_direction or _has_usual_shape(probe)]
    return float(np.median(usual or known or [math.inf]))


def _has_usual_shape(probe: Effect) -> bool:
    return all(getattr(probe, name) == probe.parameter(name).default for name in probe.shape_names())
