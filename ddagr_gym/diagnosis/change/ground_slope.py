"""Slope of the ground in ordinary drives, which is taken to be there in later ones on it too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.slope import Slope

SAME_SLOPE = 0.005
"""Deviation of the ground's gradient from one drive on it to another (ours): 0.3 degrees."""

SLOPE_OF_FIELDS = 0.05
"""Deviation of a field's gradient (ours): 3 degrees."""


@dataclass(frozen=True)
class GroundSlope:
    """Slope of the ground of ordinary drives.

    Attributes:
        gradient: along the world's axes x and y [-].
        deviations: of another drive's on the same ground from it.
    """

    gradient: tuple[float, float]
    deviations: tuple[float, float]

    @classmethod
    def estimated(cls, gradient: Sequence[float], deviations: Sequence[float]) -> GroundSlope:
        """A gradient as drives tell it; that of another drive may be another one.

        Args:
            gradient: along the world's axes [-].
            deviations: with which it is known.
        """
        x, y = (float(np.hypot(SAME_SLOPE, deviation)) for deviation in deviations)
        return cls((float(gradient[0]), float(gradient[1])), (x, y))

    @classmethod
    def of_any_field(cls) -> GroundSlope:
        """That of a field of which nothing is known."""
        return cls((0.0, 0.0), (SLOPE_OF_FIELDS, SLOPE_OF_FIELDS))

    @property
    def effects(self) -> tuple[Slope]:
        """As missing physics of a robot that is taken to stand level."""
        return (Slope.of_gradient(*self.gradient),)

    @property
    def turned(self) -> GroundSlope:
        """The same in axes that may be any."""
        x, y = np.hypot(np.hypot(*self.gradient), self.deviations).tolist()
        return GroundSlope((0.0, 0.0), (x, y))

    def with_named(self, effects: Sequence[Effect]) -> tuple[Effect, ...]:
        """Named effects on this ground: a slope among them comes on top of it; one too small to matter is left out."""
        further = [e.gradient for e in effects if isinstance(e, Slope)]
        if not further and not self.matters:
            return tuple(effects)
        x, y = np.add(self.gradient, np.sum(further, axis=0))
        return (*(e for e in effects if not isinstance(e, Slope)), Slope.of_gradient(float(x), float(y)))

    @property
    def matters(self) -> bool:
        """Whether anybody would care."""
        return self.effects[0].angle >= float(Slope.parameter("angle").metadata["least"])


def effects_of(slope: GroundSlope | None) -> tuple[Slope, ...]:
    """Missing physics of a robot that is taken to stand level; none where nothing is said of a slope."""
    return () if slope is None else slope.effects


def deviations_of(slope: GroundSlope | None) -> tuple[float, ...]:
    """Deviations of the gradient along the world's axes; none where nothing is said of a slope."""
    return () if slope is None else slope.deviations
