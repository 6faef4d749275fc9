"""Units of what a fit changed, in words."""

from __future__ import annotations

from functools import lru_cache


def unit_in_words(name: str, unit: str) -> str:
    """Unit of the change of a parameter of robot or ground.

    Args:
        name: of the parameter.
        unit: its own; "-" of a factor's logarithm, and of a pure number to which the change is added.
    """
    if unit != "-":
        return unit
    return "added, no unit" if name in _added() else "log of a factor"


@lru_cache(maxsize=1)
def _added() -> frozenset[str]:
    """Names of the pure numbers to which changes are added."""
    from ddagr_gym.identification.parameters import slope_parameters, soil_parameters

    listed = (*soil_parameters(), *slope_parameters((0.0, 0.0)))
    return frozenset(item.name for item in listed if item.unit == "-" and not item.factor)
