"""What the figures of an estimated run are drawn from: lines over time with their bands, in panels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.rendering import palette

Array = NDArray[np.float64]

DEVIATIONS = 2.0
"""Half width of the bands in standard deviations."""


@dataclass(frozen=True, eq=False)
class Line:
    """One estimated quantity over time.

    Attributes:
        name: in the legend; "" for the only one of its panel.
        value: (T,).
        low: (T,) lower end of the band, None without one.
        high: (T,).
        truth: (T,), or one value; None where unknown.
        reading: (T,) what an instrument read, NaN where nothing.
        colour: of the line.
    """

    name: str
    value: Array
    low: Array | None = None
    high: Array | None = None
    truth: Array | float | None = None
    reading: Array | None = None
    colour: str = palette.ESTIMATE


@dataclass(frozen=True, eq=False)
class Panel:
    """One figure of the thesis's order.

    Attributes:
        file: name without suffix.
        title: in words.
        unit: of the axis.
        lines: what is drawn.
        logarithmic: whether the axis is.
    """

    file: str
    title: str
    unit: str
    lines: Sequence[Line]
    logarithmic: bool = False


@dataclass(frozen=True, eq=False)
class EstimateView:
    """Everything that the figures show of a run.

    Attributes:
        title: of the run.
        t: (T,) [s].
        spans: ranges of rows that lines may join.
        panels: in order.
        paths: (T, 2) by name: "estimated", and where known "true" or "measured" [m].
        innovations: (T, 5) standardised.
        channels: names of the innovations' channels.
        bands: 95 % band of a channel's NIS, and the NIS, by channel.
    """

    title: str
    t: Array
    spans: Sequence[tuple[int, int]]
    panels: Sequence[Panel]
    paths: Mapping[str, Array]
    innovations: Array
    channels: Sequence[str]
    bands: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
