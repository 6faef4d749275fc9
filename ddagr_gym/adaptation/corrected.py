"""The corrected simulator as a controller is tuned on it: robot, soil, effects, and how far each is known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ddagr_gym.envs.options import make_settings
from ddagr_gym.envs.settings import TurnSettings
from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Robot, Sensors, Soil
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.draws import draw_sizes


@dataclass(frozen=True)
class Corrected:
    """What recordings say about a robot on its ground.

    Attributes:
        robot: refitted.
        soil: refitted.
        effects: named, at their estimated sizes.
        intervals: 90 %, by parameter, of each effect.
        verdict: names.
        complete: whether nothing else is left.
        sentence: the answer in words.
        calibration: folder of a calibration, whose drives say how much robot and soil differ; None without one.
        ground: of the calibration.
        ordinary: effects that the calibration has of its own, of its sensors.
        sensors: with the noise that recordings show.
    """

    robot: Robot
    soil: Soil
    effects: tuple[Effect, ...] = ()
    intervals: tuple[Mapping[str, tuple[float, float]], ...] = ()
    verdict: tuple[str, ...] = ("none",)
    complete: bool = True
    sentence: str = ""
    calibration: Path | None = None
    ground: str = ""
    ordinary: tuple[Effect, ...] = ()
    sensors: Sensors = Sensors()

    @property
    def all_effects(self) -> tuple[Effect, ...]:
        """What belongs to the robot as calibrated, and what was named."""
        return (*self.ordinary, *self.effects)

    def __post_init__(self) -> None:
        if len(self.intervals) not in (0, len(self.effects)):
            raise InputError(
                f"{len(self.intervals)} sets of intervals for {len(self.effects)} effects: give one for each, or none."
            )

    def draw_effects(self, rng: np.random.Generator) -> tuple[Effect, ...]:
        """Effects with sizes drawn from their intervals; at their estimates where there are none."""
        known = self.intervals or ({},) * len(self.effects)
        pairs = zip(self.effects, known, strict=True)
        return tuple(draw_sizes(effect, own, rng, inside=True) for effect, own in pairs)

    def settings(self, rng: np.random.Generator, radius: float, speed: float, side: str) -> TurnSettings:
        """Settings of the environment of one turn."""
        turn = {"radius": radius, "speed": speed, "side": side, "sensors": self.sensors}
        effects = self.draw_effects(rng)
        if self.calibration is not None:
            return make_settings(calibration=self.calibration, ground=self.ground, effects=effects, **turn)  # type: ignore[arg-type]
        return make_settings(robot=self.robot, soil=self.soil, effects=effects, **turn)  # type: ignore[arg-type]
