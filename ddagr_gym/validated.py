"""Dataclass fields that carry their unit and the interval in which they are valid."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field, fields, replace
from numbers import Real
from typing import Any, Self

from ddagr_gym.errors import InputError


def bounded(
    unit: str,
    low: float = -math.inf,
    high: float = math.inf,
    *,
    default: Any = None,
    open_low: bool = False,
    length: int = 0,
) -> Any:
    """Dataclass field that carries its unit and the interval in which it is valid; ``length`` > 0 for a tuple."""
    metadata = {"unit": unit, "low": low, "high": high, "open_low": open_low, "length": length}
    return field(metadata=metadata) if default is None else field(default=default, metadata=metadata)


def _check_field(owner: object, name: str, metadata: Mapping[str, Any]) -> None:
    value = getattr(owner, name)
    place = f"{type(owner).__name__}.{name}"
    length = metadata.get("length", 0)
    if not length:
        check_number(place, value, metadata)
        return
    if not isinstance(value, tuple | list) or len(value) != length:
        raise InputError(f"{place} is {value!r}: give {length} numbers in {metadata['unit']}.")
    for number in value:
        check_number(place, number, metadata)


def check_number(place: str, value: object, metadata: Mapping[str, Any]) -> None:
    """Refuse what is no finite number in the interval of ``metadata``, naming ``place``.

    Raises:
        InputError: with the value and the interval.
    """
    if isinstance(value, bool) or not isinstance(value, Real):
        raise InputError(f"{place} is {value!r}: give a number in {metadata['unit']}.")
    number = float(value)
    below = number <= metadata["low"] if metadata["open_low"] else number < metadata["low"]
    if not math.isfinite(number) or below or number > metadata["high"]:
        bracket = "(" if metadata["open_low"] else "["
        interval = f"{bracket}{metadata['low']:g}, {metadata['high']:g}]"
        raise InputError(f"{place} is {number:g}: give a finite value in {interval} {metadata['unit']}.")


class Validated:
    """Mixin: checks every field declared with :func:`bounded` after construction."""

    def __post_init__(self) -> None:
        for item in fields(self):  # type: ignore[arg-type]
            if "unit" in item.metadata:
                _check_field(self, item.name, item.metadata)
        self._check()

    def _check(self) -> None:
        """Relations between fields; overridden where there are any."""

    def with_values(self, **changes: Any) -> Self:
        """Copy with some fields changed, validated again."""
        return replace(self, **changes)  # type: ignore[type-var]
