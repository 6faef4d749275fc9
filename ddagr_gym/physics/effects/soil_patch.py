"""A place where the soil is different: a wet hollow, a dung heap; a band of it: an old track, a headland, a furrow."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.physics.effects.base import DriveExtent, Effect, Vector, shape, size
from ddagr_gym.physics.effects.soil_factors import HIGHEST_FACTOR, LOWEST_FACTOR, scale_soil
from ddagr_gym.physics.layout import FELT_DEPTH, POINT_SOIL, SOIL, SOIL_EXPONENT, WHEEL_X, WHEEL_Y

Array = NDArray[np.float64]

_FAR = 20.0  # rim widths: less than 1e-17 of the factor is left
_CELLS = 4  # probes per longer side of the area driven on
_SMALLEST_CELL = 1.0  # [m], about the size of a robot
_BEARINGS = 4  # of the bands that are tried, evenly over half a turn


def place_patch(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Scale the soil of the wheels in the patch; its rim is a smooth step.

    The depth that it adds, by N ~ k z^(n + 1) of a torus, is no tilt that is felt: relief tilts a robot as briefly and
    as much.
    """
    half_length = parameters[6]
    cosine, sine = math.cos(parameters[7]), math.sin(parameters[7])
    for i in range(4):
        x = row[WHEEL_X + i] - parameters[2]
        y = row[WHEEL_Y + i] - parameters[3]
        along = min(max(x * cosine + y * sine, -half_length), half_length)
        x -= along * cosine
        y -= along * sine
        outside = (math.sqrt(x * x + y * y) - parameters[4]) / parameters[5]
        if outside < _FAR:
            share = 1.0 / (1.0 + math.exp(2.0 * outside))
            stiffness = 1.0 + share * (parameters[1] - 1.0)
            scale_soil(row, i, 1.0 + share * (parameters[0] - 1.0), stiffness)
            row[FELT_DEPTH + i] *= stiffness ** (1.0 / (row[SOIL + 9 * i + SOIL_EXPONENT] + 1.0))


def from_middle_line(x: Array, y: Array, half_length: float, bearing: float) -> Array:
    """Distance [m] of places to the middle line of a patch.

    Args:
        x: from its centre, in the world [m].
        y: the same.
        half_length: of the line [m]; 0 for a disc.
        bearing: of the line [rad].
    """
    cosine, sine = math.cos(bearing), math.sin(bearing)
    along = np.clip(x * cosine + y * sine, -half_length, half_length)
    return np.hypot(x - along * cosine, y - along * sine)


@dataclass(frozen=True)
class SoilPatch(Effect):
    """Patch of the world with other strength and stiffness: a disc, or a band with round ends.

    Attributes:
        strength: factor inside; least: 20 percent, the spread between neighbouring shear vane readings.
        stiffness: factor inside; least: 30 percent, the spread between neighbouring cone index readings.
        centre_x: world.
        centre_y: world.
        radius: where the factors have half their effect; of a band half its width.
        edge: width of the rim.
        half_length: of the middle line of a band, from its centre to where the round ends begin; 0 is a disc.
        bearing: of that line, from the world's x axis counter-clockwise.
    """

    name = "soil_patch"
    needs_one_frame = True
    title = "Soil patch"
    group = "ground"
    equation = (
        "1 + (factor - 1)/(1 + exp(2 (distance of the wheel from the middle line - radius)/edge)) on strength and "
        "stiffness of each wheel; the line of a disc is its centre"
    )
    source = "Bekker-Mohr-Coulomb parameters by place; the rim's form is ours"
    signature = "mismatch that starts and ends with the place, wheel by wheel, and returns with it"
    confused_with = ("soil_change", "soil_split")
    actions = ((POINT_SOIL, place_patch),)

    strength: float = size("-", LOWEST_FACTOR, HIGHEST_FACTOR, least=0.2, neutral=1.0, step=0.04)
    stiffness: float = size("-", LOWEST_FACTOR, HIGHEST_FACTOR, least=0.3, default=1.0, neutral=1.0, step=0.06)
    centre_x: float = shape("m", -1e6, 1e6, default=0.0, step=0.1)
    centre_y: float = shape("m", -1e6, 1e6, default=0.0, step=0.1)
    radius: float = shape("m", 0.1, 1e3, default=1.5, step=0.1)
    edge: float = shape("m", 0.02, 10.0, default=0.3, step=0.05)
    half_length: float = shape("m", 0.0, 1e6, default=0.0, step=0.1)
    bearing: float = shape("rad", -7.0, 7.0, default=0.0, step=0.03)

    @classmethod
    def probes(cls, extent: DriveExtent) -> tuple[Effect, ...]:
        """Discs that tile the area driven on, each in strength and in stiffness, and bands that cross it, in both.

        One probe for each band saves half the simulations: what is wet is both weaker and softer.
        """
        strength, stiffness = (1.0 + cls.parameter(name).metadata["step"] for name in ("strength", "stiffness"))
        spans = (extent.x[1] - extent.x[0], extent.y[1] - extent.y[0])
        width = max(max(spans) / _CELLS, _SMALLEST_CELL)
        found: list[Effect] = []
        for disc in cls._discs(extent, spans, width):
            found += [replace(disc, strength=strength), replace(disc, stiffness=stiffness)]
        bands = cls._bands(extent, spans, width)
        return (*found, *(replace(band, strength=strength, stiffness=stiffness) for band in bands))

    @classmethod
    def _discs(cls, extent: DriveExtent, spans: tuple[float, float], width: float) -> Iterator[Self]:
        """One in every cell of an area."""
        rim = cls._rim(0.6 * width, width)
        columns, lines = (max(math.ceil(span / width - 1e-9), 1) for span in spans)
        for i in range(columns):
            for j in range(lines):
                x = extent.x[0] + (i + 0.5) / columns * spans[0]
                y = extent.y[0] + (j + 0.5) / lines * spans[1]
                yield cls.neutral(centre_x=x, centre_y=y, **rim)

    @classmethod
    def _bands(cls, extent: DriveExtent, spans: tuple[float, float], width: float) -> Iterator[Self]:
        """Side by side at several bearings, longer than an area; centred where they pass its middle."""
        rim = cls._rim(0.5 * width, width)
        x, y = (0.5 * (low + high) for low, high in (extent.x, extent.y))
        for bearing in (k * math.pi / _BEARINGS for k in range(_BEARINGS)):
            across = spans[0] * abs(math.sin(bearing)) + spans[1] * abs(math.cos(bearing))
            count = max(math.ceil(across / width - 1e-9), 1)
            for k in range(count):
                offset = ((k + 0.5) / count - 0.5) * across
                yield cls.neutral(
                    centre_x=x - offset * math.sin(bearing),
                    centre_y=y + offset * math.cos(bearing),
                    half_length=math.hypot(*spans),
                    bearing=bearing,
                    **rim,
                )

    @classmethod
    def _rim(cls, radius: float, width: float) -> dict[str, float]:
        """Radius and edge inside their bounds, in cells of a width."""
        wanted = {"radius": radius, "edge": 0.2 * width}
        return {name: min(value, cls.parameter(name).metadata["high"]) for name, value in wanted.items()}

    @property
    def idle_shapes(self) -> frozenset[str]:
        """A disc stays a disc; a band is as long as it is, and only its place across itself can show."""
        if self.half_length == 0.0:
            return frozenset({"half_length", "bearing"})
        runs_along_x = abs(math.cos(self.bearing)) > math.sqrt(0.5)
        return frozenset({"half_length", "centre_x" if runs_along_x else "centre_y"})

    @property
    def soils(self) -> Mapping[str, tuple[float, float]]:
        """Well inside the patch and outside."""
        return {"in the patch": (self.strength, self.stiffness), "outside it": (1.0, 1.0)}
