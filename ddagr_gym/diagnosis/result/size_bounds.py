"""Sizes that a fit pushes to the bound of what exists: the robot's effect has another form than the library's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ddagr_gym.diagnosis.answer.verdict import Estimate, Finding
from ddagr_gym.physics.effects.registry import effect_kinds

_NEAR = 1e-3
"""Distance from a bound, in its distance from neutral, that counts as there (rounding of a bounded fit)."""


@dataclass(frozen=True)
class Pushed:
    """A size at its bound.

    Attributes:
        name: of the effect.
        field: the size.
        bound: what its interval reaches, in unit.
        unit: SI.
    """

    name: str
    field: str
    bound: float
    unit: str


def pushed_to_bounds(findings: Sequence[Finding]) -> list[Pushed]:
    """Sizes whose 90 % interval reaches the bound on their side of neutral.

    Args:
        findings: of a diagnosis.
    """
    found = []
    for finding in findings:
        kind = effect_kinds().get(finding.name)
        if kind is None or kind.categorical or not kind.differentiable:
            continue
        for field in kind.size_names():
            estimate = finding.parameters.get(field)
            bound = None if estimate is None else _reached(estimate, kind.parameter(field).metadata)
            if estimate is not None and bound is not None:
                found.append(Pushed(finding.name, field, bound, estimate.unit))
    return found


def _reached(estimate: Estimate, limits: Mapping[str, Any]) -> float | None:
    """Bound that an interval reaches; None where it ends inside, or where the size was not fitted."""
    if estimate.interval is None or estimate.value == limits["neutral"]:
        return None
    upwards = estimate.value > limits["neutral"]
    bound = float(limits["high"] if upwards else limits["low"])
    far = estimate.interval[1] if upwards else estimate.interval[0]
    return bound if abs(far - limits["neutral"]) >= (1.0 - _NEAR) * abs(bound - limits["neutral"]) else None
