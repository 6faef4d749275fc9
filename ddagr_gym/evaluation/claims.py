"""Claims that were written before the scenario sets were opened, checked against a summary."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from ddagr_gym.config import configs_dir, load_config
from ddagr_gym.errors import InputError, unknown_name

HEADLINE = "headline"
"""Stands for the arm that the claims' file names."""

RELATIONS = {
    "at most": lambda value, bound: value <= bound,
    "at least": lambda value, bound: value >= bound,
    "less than": lambda value, bound: value < bound,
    "more than": lambda value, bound: value > bound,
}
"""Comparisons of a value with its bound."""

_NUMBERS = ("value", "low", "high")

Verdict = Literal["held", "not held", "not driven"]


@dataclass(frozen=True)
class Bound:
    """Number of another arm: its metric times ``factor`` plus ``offset``.

    Attributes:
        of: the arm.
        factor: [-].
        offset: in the metric's unit.
    """

    of: str
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Claim:
    """One claim; it holds if it holds on each of its sets.

    Attributes:
        name: in words.
        arm: controller or arm, or "headline".
        sets: scenario sets.
        metric: name in the summary.
        relation: of RELATIONS.
        bound: number, or another arm's.
        number: value, or low or high end of the interval.
    """

    name: str
    arm: str
    sets: tuple[str, ...]
    metric: str
    relation: str
    bound: float | Bound
    number: str = "value"

    def __post_init__(self) -> None:
        if self.relation not in RELATIONS:
            raise unknown_name("relation", self.relation, RELATIONS)
        if self.number not in _NUMBERS:
            raise unknown_name("number of a metric", self.number, _NUMBERS)
        if not self.sets:
            raise InputError(f"claim {self.name!r} names no scenario set: give one at least.")


@dataclass(frozen=True)
class Claims:
    """A file of claims.

    Attributes:
        headline: arm that "headline" stands for.
        claims: all of them.
    """

    headline: str
    claims: tuple[Claim, ...]


@dataclass(frozen=True)
class CheckedClaim:
    """A claim on one set, and what was measured.

    Attributes:
        name: of the claim.
        arm: the arm's own name.
        set_name: scenario set.
        metric: in the summary, with the end of its interval that counted.
        measured: the number; None where it is infinite (a failure) or was not driven.
        relation: between the two.
        bound: the number; None likewise.
        verdict: "held", "not held", or "not driven" where the summary has no such number.
    """

    name: str
    arm: str
    set_name: str
    metric: str
    measured: float | None
    relation: str
    bound: float | None
    verdict: Verdict


def load_claims(path: Path | None = None) -> Claims:
    """Claims of a file, of ``configs/evaluation/claims.yaml`` by default; InputError where it is not valid."""
    return load_config(configs_dir() / "evaluation" / "claims.yaml" if path is None else path, Claims)


def _number(summary: Mapping[str, Any], arm: str, set_name: str, metric: str, which: str) -> float | None:
    """Number of a summary, infinite where a failure made it so; None where it is not there."""
    found = summary.get(arm, {}).get(set_name, {}).get(metric)
    if found is None:
        return None
    if not isinstance(found, Mapping) or "value" not in found:
        raise InputError(f"{metric!r} of the summary is no metric with a value and an interval: claim another one.")
    if which == "value":
        number = found["value"]
    elif found["interval"] is None:
        return None
    else:
        number = found["interval"][_NUMBERS.index(which) - 1]
    return math.inf if number is None else float(number)


def _bound(claim: Claim, summary: Mapping[str, Any], set_name: str, headline: str) -> float | None:
    if not isinstance(claim.bound, Bound):
        return float(claim.bound)
    arm = headline if claim.bound.of == HEADLINE else claim.bound.of
    number = _number(summary, arm, set_name, claim.metric, "value")
    return None if number is None else claim.bound.factor * number + claim.bound.offset


def _finite(number: float | None) -> float | None:
    return number if number is not None and math.isfinite(number) else None


def check_claims(claims: Claims, summary: Mapping[str, Any]) -> list[CheckedClaim]:
    """Every claim on each of its sets against a summary of :func:`ddagr_gym.evaluation.summary.summaries`."""
    checked = []
    for claim in claims.claims:
        arm = claims.headline if claim.arm == HEADLINE else claim.arm
        for set_name in claim.sets:
            measured = _number(summary, arm, set_name, claim.metric, claim.number)
            bound = _bound(claim, summary, set_name, claims.headline)
            verdict: Verdict = "not driven"
            if measured is not None and bound is not None:
                verdict = "held" if RELATIONS[claim.relation](measured, bound) else "not held"
            metric = claim.metric if claim.number == "value" else f"{claim.metric} ({claim.number})"
            checked.append(
                CheckedClaim(
                    claim.name, arm, set_name, metric, _finite(measured), claim.relation, _finite(bound), verdict
                )
            )
    return checked


def claims_table(checked: Sequence[CheckedClaim]) -> tuple[tuple[str, ...], list[tuple[object, ...]]]:
    """Header and rows for printing."""
    header = ("claim", "arm", "set", "measured", "", "bound", "verdict")
    return header, [
        (item.name, item.arm, item.set_name, _text(item, item.measured), item.relation, _text(item, item.bound),
         item.verdict)
        for item in checked
    ]  # fmt: skip


def _text(item: CheckedClaim, number: float | None) -> str:
    if item.verdict == "not driven":
        return "-" if number is None else f"{number:.3g}"
    return "failed" if number is None else f"{number:.3g}"
