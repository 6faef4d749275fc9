"""Slope of the ground in drives from before, which is taken to be there in later ones too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.slope import Slope
from ddagr_gym.recordings.pose_frames import frames_apart
from ddagr_gym.recordings.schema import Recording


@dataclass(frozen=True)
class GroundSlope:
    """Slope of the ground of drives from before.

    Attributes:
        gradient: along the world's axes x and y [-].
        deviations: of another drive's on the same ground from it.
    """

    gradient: tuple[float, float]
    deviations: tuple[float, float]

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


def in_one_frame(recordings: Sequence[Recording]) -> bool:
    """Whether directions mean the same in all drives: they have headings, each in one frame."""
    return all(recording.has("pose_yaw") and not frames_apart(recording) for recording in recordings)
