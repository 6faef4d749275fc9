"""Sizes with their doubt as text, in units that people use.

``±`` is half of the 90 % interval, where it is nearly symmetric and does not reach over zero by this alone; otherwise
the interval stands in brackets.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ddagr_gym.diagnosis.answer.verdict import Estimate

DEGREES = 180.0 / math.pi
"""In a radian."""

_LOPSIDED = 0.5
"""Distance of a value from the middle of its interval, over the half width, beyond which the interval is written."""


@dataclass(frozen=True)
class Amount:
    """A size with its interval.

    Attributes:
        value: in ``unit``.
        unit: SI, "-" for none.
        interval: low and high; None where nothing was estimated.
    """

    value: float
    unit: str = "-"
    interval: tuple[float, float] | None = None

    def scaled(self, factor: float, shift: float = 0.0) -> Amount:
        """The same in another unit: ``factor * value + shift``."""
        ends = None if self.interval is None else sorted(factor * end + shift for end in self.interval)
        return Amount(factor * self.value + shift, self.unit, None if ends is None else (ends[0], ends[1]))


Amounts = Mapping[str, Amount]


def amounts(parameters: Mapping[str, Estimate]) -> dict[str, Amount]:
    """Amounts of a finding's parameters; an interval whose ends are not finite is none."""
    return {name: amount_of(item) for name, item in parameters.items()}


def amount_of(item: Estimate) -> Amount:
    """An estimate as an amount; an interval whose ends are not finite is none."""
    known = item.interval is not None and all(math.isfinite(end) for end in item.interval)
    return Amount(item.value, item.unit or "-", item.interval if known else None)


def number(value: float, digits: int = 2) -> str:
    """Significant digits without an exponent where that reads well; a true minus sign."""
    if not math.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    places = digits - 1 - math.floor(math.log10(abs(value)))
    text = f"{value:.{digits - 1}e}" if abs(value) >= 1e6 or abs(value) < 1e-4 else f"{value:.{max(places, 0)}f}"
    return text.replace("-", "−")


def quantity(amount: Amount, unit: str = "", signed: bool = False) -> str:
    """Value, doubt and unit, rounded to what the doubt leaves of it.

    Args:
        amount: what to write.
        unit: as people write it, after a space.
        signed: write a plus sign too.
    """
    value = amount.value if signed else abs(amount.value)
    after = f" {unit}" if unit else ""
    plus = "+" if signed and value > 0.0 else ""
    if amount.interval is None or not math.isfinite(value):
        return f"{plus}{number(value, 2)}{after}"
    low, high = amount.interval
    if not signed and amount.value < 0.0:
        low, high = -high, -low
    half = 0.5 * (high - low)
    if half <= 0.0:
        return f"{plus}{number(value, 3)}{after}"
    places = decimals(half)
    beyond = low > 0.0 >= value - half
    if beyond or abs(value - 0.5 * (low + high)) > _LOPSIDED * half:
        return f"{plus}{fixed(value, places)}{after} ({fixed(low, places)} to {fixed(high, places)})"
    return f"{plus}{fixed(value, places)} ± {fixed(half, places)}{after}"


def decimals(half: float) -> int:
    """Decimals that leave one or two digits of half an interval's width, which is above zero."""
    places = max(1 - math.floor(math.log10(half)), 0) if half < 10.0 else 0
    return places - 1 if places > 0 and half * 10.0**places >= 20.0 else places


def rounded(amount: Amount) -> str:
    """A value to the digits that its interval leaves of it, so that a factor near 1 keeps what it differs by."""
    half = _half_width(amount)
    return number(amount.value) if half is None else fixed(amount.value, decimals(half))


def with_interval(amount: Amount) -> str:
    """Value, unit and the interval in brackets, as it is where that is known, rounded by its width."""
    unit = unit_in_words(amount.unit)
    text = f"{rounded(amount)} {unit}".rstrip()
    if amount.interval is None:
        return text
    low, high = (rounded(Amount(end, interval=amount.interval)) for end in amount.interval)
    return f"{text} ({low} to {high})"


def _half_width(amount: Amount) -> float | None:
    """Half of an interval's width; None where there is none."""
    if amount.interval is None:
        return None
    half = 0.5 * (amount.interval[1] - amount.interval[0])
    return half if math.isfinite(amount.value) and math.isfinite(half) and half > 0.0 else None


def unit_in_words(unit: str) -> str:
    """A unit as it is printed; "" for one of a mere number."""
    return unit.replace("^2", "²").replace("^3", "³").strip("-")


def size(amount: Amount) -> str:
    """A parameter with its interval and unit; angles in degrees."""
    if amount.unit == "rad":
        return quantity(amount.scaled(DEGREES), "degrees", signed=amount.value < 0.0)
    return quantity(amount, unit_in_words(amount.unit), signed=amount.value < 0.0)


def fixed(value: float, places: int) -> str:
    """So many decimals; a true minus sign."""
    return f"{value:.{places}f}".replace("-", "−")
