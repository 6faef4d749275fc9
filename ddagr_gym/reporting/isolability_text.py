"""An isolability table as text."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ddagr_gym.reporting.text_table import format_table

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.planning.isolability import Isolability

HEADER = ("effect", "size", "least detectable", "unit", "/ least meaningful", "confused with (share of its own)")

_NOT_SEEN = 1e3
"""Multiple of the least meaningful size from which an effect counts as not seen."""


def table_text(table: Isolability) -> str:
    """One line per size of an effect, the effects that show at the smallest sizes first."""
    return f"{table_head(table)}\n\n{format_table(HEADER, table_rows(table))}"


def table_head(table: Isolability) -> str:
    """Robot, soil, manoeuvres, sensors and gates."""
    unsure = "" if table.soil_uncertainty == 1.0 else f" ({table.soil_uncertainty:g} times as uncertain as usual)"
    return (
        f"{table.robot} on {table.soil}{unsure}: {', '.join(table.manoeuvres)} ({table.duration:.0f} s) with "
        f"{', '.join(table.sensors)}; gates: {table.gates}"
    )


def table_rows(table: Isolability) -> list[tuple[str, ...]]:
    """Rows under :data:`HEADER`."""
    return [
        (name, item.field, _size(item.size), item.unit, _multiples(item.multiples), _rivals(table, name))
        for name in sorted(table.effects, key=lambda name: table.of(name).multiples)
        for item in table.detectable
        if item.effect == name
    ]


def _size(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "none"


def _multiples(value: float) -> str:
    return f"{value:.2g}" if value < _NOT_SEEN else "not seen"


def _rivals(table: Isolability, name: str) -> str:
    if table.of(name).multiples >= _NOT_SEEN:
        return ""
    row = table.share[table.effects.index(name)]
    pairs = [f"{rival} ({row[table.effects.index(rival)]:.2f})" for rival in table.confused(name)]
    return ", ".join(pairs)
