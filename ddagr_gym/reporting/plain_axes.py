"""Horizontal axes over several decades whose ticks are plain numbers."""

from __future__ import annotations

import math
from typing import Any

MANTISSAS = (1.0, 2.0, 5.0)
"""Of ticks within a decade."""

_FEW_DECADES = 0.6
"""Decades below which ticks at 1, 2 and 5 are too few (ours)."""

_MOST_DECADES = 2.5
"""Decades beyond which only powers of ten have ticks (ours)."""


def plain_log(axis: Any) -> None:
    """Logarithmic axis with plain numbers at 1, 2 and 5; at even steps where it spans little. After all is drawn."""
    from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter, NullLocator

    axis.set_xscale("log")
    low, high = axis.get_xlim()
    decades = math.log10(high / low)
    subs = (1.0,) if decades > _MOST_DECADES else MANTISSAS
    few = decades < _FEW_DECADES
    axis.xaxis.set_major_locator(MaxNLocator(4, prune=None) if few else LogLocator(subs=subs))
    axis.xaxis.set_minor_locator(NullLocator())
    axis.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.xaxis.set_minor_formatter(NullFormatter())


def plain_symlog(axis: Any, linear: float, farthest: float) -> None:
    """Axis with plain numbers that is linear up to a size and logarithmic beyond; linear where little is beyond.

    Args:
        axis: of matplotlib.
        linear: size up to which it is linear to either side.
        farthest: largest size that is drawn.
    """
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    formatter = FuncFormatter(lambda value, _: f"{value:g}".replace("-", "−"))
    axis.xaxis.set_major_formatter(formatter)
    if farthest <= 2.0 * linear:
        return
    axis.set_xscale("symlog", linthresh=linear)
    ticks = symlog_ticks(linear, farthest)
    axis.xaxis.set_major_locator(FixedLocator([-tick for tick in reversed(ticks)] + [0.0] + ticks))
    axis.xaxis.set_minor_locator(NullLocator())
    axis.xaxis.set_major_formatter(formatter)


def symlog_ticks(linear: float, farthest: float) -> list[float]:
    """Positive ticks: half and all of the linear part, then 1, 2 and 5 of each decade, or 1 alone of many.

    Args:
        linear: size up to which the axis is linear.
        farthest: largest size that is drawn.
    """
    decades = math.log10(farthest / linear)
    mantissas = (1.0,) if decades > _MOST_DECADES else MANTISSAS
    first, last = math.floor(math.log10(linear)), math.ceil(math.log10(farthest))
    beyond = [m * 10.0**power for power in range(first, last + 1) for m in mantissas]
    return [0.5 * linear, linear, *(tick for tick in beyond if 1.5 * linear < tick <= 1.1 * farthest)]
