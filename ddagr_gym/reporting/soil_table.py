"""The table of what a soil does under a wheel, beside its strength and stiffness."""

from __future__ import annotations

import math
from typing import Any

from ddagr_gym.diagnosis.answer.amounts import fixed
from ddagr_gym.diagnosis.answer.soil_at_work import SoilAtWork, SoilQuantity
from ddagr_gym.diagnosis.result.soil_words import TITLES

_MILLIMETRES = 1e3


def soil_section(soil: SoilAtWork) -> dict[str, Any]:
    """Header, rows and note of the table.

    Args:
        soil: of a finding.
    """
    point = soil.point
    at = (
        f"One wheel at a slip of {point.slip:.2f}, a slip angle of {math.degrees(point.slip_angle):.0f} degrees, "
        f"{fixed(point.speed, 2)} m/s and a load of {point.load:.0f} N, as these drives have it where wheels slip most."
    )
    apart = "can" if soil.told_apart else "cannot"
    together = (
        f"Strength and stiffness {apart} be told apart here (correlation {fixed(soil.correlation, 2)}). The difference "
        "between the soils is known better than the values, which are those of the model's soil law."
    )
    header = ("", "difference", soil.first, soil.second)
    return {"header": header, "rows": [_row(item) for item in soil.quantities], "note": f"{at} {together}"}


def _row(item: SoilQuantity) -> tuple[str, str, str, str]:
    name = TITLES[item.name]
    first, second = _value(item.first, item.first_interval, item), _value(item.second, item.second_interval, item)
    return f"{name[:1].upper()}{name[1:]}", _change(item), first, second


def _value(value: float, interval: tuple[float, float], item: SoilQuantity) -> str:
    factor, unit, places = (_MILLIMETRES, "mm", 1) if item.unit == "m" else (1.0, item.unit, 0)
    low, high = (fixed(factor * end, places) for end in interval)
    return f"{fixed(factor * value, places)} {unit} ({low} to {high})"


def _change(item: SoilQuantity) -> str:
    if item.change is None or item.change_interval is None:
        return "–"
    value, low, high = (_signed(end) for end in (item.change, *item.change_interval))
    return f"{value} % ({low} to {high})"


def _signed(share: float) -> str:
    """Percent with a sign; "0" for what rounds to it."""
    percent = round(100.0 * share)
    return f"{percent:+d}".replace("-", "−") if percent else "0"
