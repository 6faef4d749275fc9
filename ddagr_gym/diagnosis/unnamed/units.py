"""Signals with units: sums of unlike quantities, and functions of anything but pure numbers, are refused.

Angles are pure numbers in the algebra; their unit is carried along so that a coefficient reads in N s/rad.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError

Array = NDArray[np.float64]

_SYMBOLS = ("kg", "m", "s", "rad")


@dataclass(frozen=True)
class Unit:
    """Product of powers of SI base units.

    Attributes:
        powers: of kg, m, s and rad.
    """

    powers: tuple[int, int, int, int] = (0, 0, 0, 0)

    @property
    def dimension(self) -> tuple[int, int, int]:
        """Powers that must agree in a sum: those of kg, m and s."""
        return self.powers[:3]

    def __mul__(self, other: Unit) -> Unit:
        return Unit(tuple(a + b for a, b in zip(self.powers, other.powers, strict=True)))  # type: ignore[arg-type]

    def __truediv__(self, other: Unit) -> Unit:
        return Unit(tuple(a - b for a, b in zip(self.powers, other.powers, strict=True)))  # type: ignore[arg-type]

    def __str__(self) -> str:
        kg, m, s, rad = self.powers
        symbols = dict(zip(_SYMBOLS, self.powers, strict=True))
        if kg and s:  # forces read better than kg m/s^2
            symbols = {"N": kg, "m": m - kg, "s": s + 2 * kg, "rad": rad}
        above = [_power(name, p) for name, p in symbols.items() if p > 0]
        below = [_power(name, -p) for name, p in symbols.items() if p < 0]
        if not below:
            return " ".join(above) or "-"
        under = below[0] if len(below) == 1 else f"({' '.join(below)})"
        return f"{' '.join(above) or '1'}/{under}"


def _power(name: str, power: int) -> str:
    return name if power == 1 else f"{name}^{power}"


NUMBER = Unit()
METRE = Unit((0, 1, 0, 0))
SECOND = Unit((0, 0, 1, 0))
RADIAN = Unit((0, 0, 0, 1))
NEWTON = Unit((1, 1, -2, 0))
NEWTON_METRE = NEWTON * METRE
SPEED = METRE / SECOND
TURN_RATE = RADIAN / SECOND
ACCELERATION = SPEED / SECOND
TURN_ACCELERATION = TURN_RATE / SECOND


@dataclass(frozen=True, eq=False)
class Signal:
    """A quantity along drives.

    Attributes:
        name: as it stands in an equation.
        values: of any shape.
        unit: of the values.
    """

    name: str
    values: Array
    unit: Unit

    def __add__(self, other: Signal) -> Signal:
        return self._sum(other, 1.0, "+")

    def __sub__(self, other: Signal) -> Signal:
        return self._sum(other, -1.0, "-")

    def _sum(self, other: Signal, sign: float, symbol: str) -> Signal:
        if self.unit.dimension != other.unit.dimension:
            raise InputError(
                f"{self.name} [{self.unit}] {symbol} {other.name} [{other.unit}]: only like quantities can be added."
            )
        return Signal(f"({self.name} {symbol} {other.name})", self.values + sign * other.values, self.unit)

    def __mul__(self, other: Signal) -> Signal:
        return Signal(f"{self.name} {other.name}", self.values * other.values, self.unit * other.unit)

    def named(self, name: str, unit: Unit | None = None) -> Signal:
        """The same under a shorter name, and in another unit of the same dimension.

        Raises:
            InputError: the unit has another dimension.
        """
        if unit is not None and unit.dimension != self.unit.dimension:
            raise InputError(f"{name} has the unit {self.unit}: it cannot be given in {unit}.")
        return Signal(name, self.values, self.unit if unit is None else unit)

    def squared(self) -> Signal:
        """Square that keeps the sign: |x| x."""
        return Signal(f"|{self.name}| {self.name}", np.abs(self.values) * self.values, self.unit * self.unit)

    def sign(self, smooth: float) -> Signal:
        """Sign, rounded within ``smooth`` of zero."""
        return Signal(f"sgn({self.name})", np.tanh(self.values / smooth), NUMBER)

    def of_number(self, function: str, multiple: float = 1.0) -> Signal:
        """``cos``, ``sin`` or ``exp`` of a multiple of an angle or a pure number.

        Raises:
            InputError: the signal has a dimension.
        """
        if self.unit.dimension != (0, 0, 0):
            raise InputError(f"{function}({self.name}): its argument has the unit {self.unit}, divide by a scale.")
        text = self.name if multiple == 1.0 else f"{multiple:g} {self.name}"
        return Signal(f"{function}({text})", getattr(np, function)(multiple * self.values), NUMBER)

    def decay(self, scale: float) -> Signal:
        """exp(-|x|/scale), the scale in the signal's unit."""
        unit = "" if str(self.unit) == "-" else f" {self.unit}"
        return Signal(f"exp(-|{self.name}|/{scale:g}{unit})", np.exp(-np.abs(self.values) / scale), NUMBER)
