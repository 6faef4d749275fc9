"""A diagnosis as text."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from ddagr_gym.reporting.drivetrain_section import (
    ERROR_HEADER,
    PART_HEADER,
    error_rows,
    other_findings,
    part_rows,
    remaining_in_words,
)
from ddagr_gym.reporting.shown_parameters import shown_parameters
from ddagr_gym.reporting.text_table import format_table

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.answer.certificate import Certificate
    from ddagr_gym.diagnosis.answer.verdict import DataDoubt, Diagnosis, Finding

AgainstGate = tuple[float, float] | None
"""What speaks for a finding, and what that had to pass; None where it is seen in the values."""

FINDING_HEADER = ("effect", "size", "90 % interval", "unit", "gain", "gate", "could also be")

FIT_HEADER = ("error on unseen drives", "nominal", "refitted", "corrected", "black box", "ceiling", "unit")

_AS_LIKELY = 0.8
"""Weight of a rival over that of the name from which it counts as as likely (ours)."""

_SHOWN = ("position", "pose_yaw", "heading_by_gyro", "yaw_rate", "speed", "specific_force_x", "specific_force_y")
"""Channels whose errors are shown, in this order."""


def outcome_text(diagnosis: Diagnosis) -> str:
    """Answer, findings and errors at the horizons, as tables."""
    parts = [diagnosis.sentence]
    if diagnosis.checks:
        lines = [_doubt_line(doubt) for doubt in diagnosis.checks]
        parts.append("\n".join(["The recordings themselves are suspicious (`ddagr check` says more):", *lines]))
    if other_findings(diagnosis):
        parts.append(format_table(FINDING_HEADER, finding_rows(diagnosis)))
    if diagnosis.drivetrain is not None:
        parts.append(format_table(PART_HEADER, part_rows(diagnosis)))
        parts.append(format_table(ERROR_HEADER, error_rows(diagnosis.drivetrain)))
        parts.append(f"Squared error of the wheel speeds, corrected: {remaining_in_words(diagnosis.drivetrain)}.")
    if diagnosis.rejected:
        nearest = ", ".join(f"{item.name} (gain {item.gain:.1f})" for item in diagnosis.rejected)
        parts.append(f"What comes nearest leaves too much to be named: {nearest}.")
    if diagnosis.fit is not None:
        parts += _fit_texts(diagnosis.fit)
    if diagnosis.next_drive is not None:
        manoeuvre = diagnosis.next_drive.manoeuvre
        parts.append(f"Next drive: {manoeuvre or 'none'}. {diagnosis.next_drive.why}")
    return "\n\n".join(parts)


def _doubt_line(doubt: DataDoubt) -> str:
    place = " ".join(filter(None, (doubt.recording, doubt.channel)))
    return f"  {place}: {doubt.sentence}" if place else f"  {doubt.sentence}"


def _gain_and_gate(finding: Finding) -> AgainstGate:
    return (finding.gain, finding.gate) if max(finding.gain, finding.gate) > 0.0 else None


def finding_rows(
    diagnosis: Diagnosis, evidence: Callable[[Finding], AgainstGate] = _gain_and_gate
) -> list[tuple[str, ...]]:
    """One row per parameter of each finding that is no part of the drivetrain, under :data:`FINDING_HEADER`.

    Args:
        diagnosis: the answer.
        evidence: what speaks for a finding, as it is shown.
    """
    return [row for finding in other_findings(diagnosis) for row in _finding_rows(finding, evidence(finding))]


def _finding_rows(finding: Finding, evidence: AgainstGate) -> Iterator[tuple[str, ...]]:
    """One row per parameter; what belongs to the whole finding is in the first."""
    none = "not compared" if finding.by_forecasts else "nothing else" if finding.gate > 0.0 else "seen in the values"
    gated = ("–", "–") if evidence is None else tuple(_number(finding, value) for value in evidence)
    whole = (*gated, rivals(finding) or none)
    for number, (name, estimate) in enumerate(shown_parameters(finding).items()):
        interval = "" if estimate.interval is None else f"{estimate.interval[0]:.3g} to {estimate.interval[1]:.3g}"
        first = number == 0
        label = f"{finding.name if first else ''} {name}".strip()
        yield label, f"{estimate.value:.3g}", interval, estimate.unit, *(whole if first else ("", "", ""))


def rivals(finding: Finding) -> str:
    """What a finding could also be, and how likely that is; "" where nothing else is in question."""
    weights = finding.equivalence_set
    return ", ".join(_rival(finding, name, weight) for name, weight in weights.items() if name != finding.name)


def _rival(finding: Finding, name: str, weight: float) -> str:
    alike = weight >= _AS_LIKELY * finding.equivalence_set.get(finding.name, 0.0)
    return f"{name}: {'as likely' if alike else f'less likely ({100.0 * weight:.0f} %)'}"


def _number(finding: Finding, value: float) -> str:
    return f"{100.0 * value:+.1f} %" if finding.by_forecasts else f"{value:.1f}"


def fit_rows(fit: Certificate) -> list[tuple[str, ...]]:
    """Errors on unseen drives by channel and horizon, under :data:`FIT_HEADER`."""
    models = ("raw", "refitted", "corrected", "black_box", "ceiling")
    return [
        (f"{channel} after {horizon} s", *(f"{getattr(errors, model).value:.3g}" for model in models), errors.unit)
        for channel in _SHOWN
        for horizon, errors in fit.channels.get(channel, {}).items()
    ]


def _fit_texts(fit: Certificate) -> Iterator[str]:
    rows = fit_rows(fit)
    if rows:
        yield format_table(FIT_HEADER, rows)
    shares = [
        f"{100.0 * share.value:.0f} % after {horizon} s"
        for horizon, share in fit.gain_share.items()
        if share is not None
    ]
    if shares:
        yield f"Share of the explainable error that the named effects explain: {', '.join(shares)}."
    yield f"Predicted {fit.folds}. {fit.note}"
