"""Estimates of a filter over a recording, as text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ddagr_gym.reporting.text_table import format_table, short

HEADER = ("parameter", "estimate", "relative deviation", "best fit to the truth")


def estimate_text(summary: Mapping[str, Any]) -> str:
    """Parameters as a table, errors below.

    Args:
        summary: of :func:`ddagr_gym.evaluation.estimate_run.summary_of`.
    """
    lines = [format_table(HEADER, parameter_rows(summary))]
    lines += [f"{name}: {value}" for name, value in error_rows(summary)]
    if not summary["uses_commands"]:
        lines.append("The motors do not follow the first-order model: wheel speeds were taken from the encoders alone.")
    return "\n".join(lines)


def parameter_rows(summary: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """Final soil parameters under :data:`HEADER`."""
    return [
        (name.replace("_", " "), *(short(item[key]) for key in ("value", "log_deviation", "best_fit")))
        for name, item in summary["parameters"].items()
    ]


def error_rows(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Errors by name, where the truth is known."""
    return [(name, "broke down" if value is None else f"{value:.4g}") for name, value in summary["errors"].items()]
