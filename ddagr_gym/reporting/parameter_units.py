"""Units of what a fit changed, in words."""

from __future__ import annotations

from ddagr_gym.identification.parameters import added_numbers


def unit_in_words(name: str, unit: str) -> str:
    """Unit of the change of a parameter of robot or ground.

    Args:
        name: of the parameter.
        unit: its own; "-" of a factor's logarithm, and of a pure number to which the change is added.
    """
    if unit != "-":
        return unit
    return "added, no unit" if name in added_numbers() else "log of a factor"
