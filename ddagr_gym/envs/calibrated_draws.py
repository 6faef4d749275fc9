"""Robots and grounds as a calibration found them, drawn anew for each episode from the scatter between its drives."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from ddagr_gym.config import load_config
from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.parameters import Drivetrain, Robot, Soil

NAME = "draws.yaml"
"""Of the file in the folder that ``ddagr calibrate`` writes."""

EFFECTS = "effects.yaml"
"""Likewise, with what was calibrated of the sensors."""

MOST_DEVIATIONS = 3.0
"""At which draws are cut off (ours), so that nothing changes sign."""

_ADDED = (
    "command_delay",
    "command_deadband",
    "integral_rate",
    "load_compliance",
    "limit_imbalance",
    "viscous_rate",
    "coulomb_friction",
)
"""Fields of a drivetrain that may be nothing: their deviations are differences, those of all others of logarithms."""


@dataclass(frozen=True)
class GroundDraws:
    """Soils and slopes of one ground.

    Attributes:
        name: of the ground.
        soil: calibrated.
        spread: deviations between drives on it: soil_strength, soil_stiffness and shear_modulus of logarithms,
            exit_angle_ratio of the ratio.
        gradient: rise per metre along the axes of the calibration's poses [-]; none where nothing surely slopes.
        gradient_deviations: of that of another drive on it [-].
    """

    name: str
    soil: Soil
    spread: Mapping[str, float]
    gradient: tuple[float, float] = (0.0, 0.0)
    gradient_deviations: tuple[float, float] = (0.0, 0.0)

    @property
    def slopes(self) -> bool:
        """Whether drives said so."""
        return any(self.gradient)

    def draw_gradient(self, rng: np.random.Generator) -> tuple[float, float]:
        """Rise per metre along the rows and across [-]; nothing is drawn on level ground.

        Rows may lie in any direction of the axes in which the gradient is known.
        """
        if not self.slopes:
            return 0.0, 0.0
        drawn = [g + d * _cut(rng) for g, d in zip(self.gradient, self.gradient_deviations, strict=True)]
        steepness, direction = math.hypot(*drawn), float(rng.uniform(-math.pi, math.pi))
        return steepness * math.cos(direction), steepness * math.sin(direction)

    def draw(self, rng: np.random.Generator) -> Soil:
        """A soil of this ground."""
        drawn = {name: size * _cut(rng) for name, size in self.spread.items()}
        strength, stiffness = (math.exp(drawn.get(name, 0.0)) for name in ("soil_strength", "soil_stiffness"))
        soil = self.soil
        ratio = min(max(soil.exit_angle_ratio + drawn.get("exit_angle_ratio", 0.0), 0.0), 1.0)
        return replace(
            soil,
            cohesion=soil.cohesion * strength,
            friction_angle=math.atan(strength * math.tan(soil.friction_angle)),
            cohesive_modulus=soil.cohesive_modulus * stiffness,
            frictional_modulus=soil.frictional_modulus * stiffness,
            shear_modulus=soil.shear_modulus * math.exp(drawn.get("shear_modulus", 0.0)),
            exit_angle_ratio=ratio,
        )


@dataclass(frozen=True)
class CalibratedDraws:
    """What a calibration says about a robot and its grounds, and how much both differ between drives.

    Attributes:
        robot: calibrated.
        spread: deviations between drives by field: of the logarithm, or of a difference where a drivetrain may have
            none of it.
        grounds: to draw from, each as likely.
    """

    robot: Robot
    spread: Mapping[str, float]
    grounds: tuple[GroundDraws, ...]

    def on(self, ground: str) -> CalibratedDraws:
        """The same on one of its grounds; InputError for an unknown one."""
        if not ground:
            return self
        names = [item.name for item in self.grounds]
        if ground not in names:
            raise unknown_name("ground", ground, names)
        return replace(self, grounds=(self.grounds[names.index(ground)],))

    def draw_robot(self, rng: np.random.Generator) -> Robot:
        """A robot as it is on one day."""
        drawn = {name: size * _cut(rng) for name, size in self.spread.items()}
        known = {item.name: item.metadata for item in fields(Drivetrain)}
        drivetrain = replace(
            self.robot.drivetrain,
            **{
                name: _changed(getattr(self.robot.drivetrain, name), name, drawn[name], known[name])
                for name in drawn.keys() & known.keys()
            },
        )
        own = drawn.keys() & {item.name for item in fields(Robot)}
        factors = {name: getattr(self.robot, name) * math.exp(drawn[name]) for name in own}
        width, radius = (math.exp(drawn.get(name, 0.0)) for name in ("half_width", "outer_radius"))
        wheels = tuple(
            replace(wheel, half_width=wheel.half_width * width, major_radius=wheel.major_radius * radius)
            for wheel in self.robot.wheels
        )
        return replace(self.robot, wheels=wheels, drivetrain=drivetrain, **factors)

    @property
    def slopes(self) -> bool:
        """Whether one of the grounds does."""
        return any(ground.slopes for ground in self.grounds)

    def draw_ground(self, rng: np.random.Generator) -> GroundDraws:
        """One of the grounds."""
        return self.grounds[int(rng.integers(len(self.grounds)))]

    def draw_soil(self, rng: np.random.Generator) -> Soil:
        """A soil of one of the grounds."""
        return self.draw_ground(rng).draw(rng)


def _cut(rng: np.random.Generator) -> float:
    return float(np.clip(rng.standard_normal(), -MOST_DEVIATIONS, MOST_DEVIATIONS))


def _changed(value: float, name: str, change: float, bounds: Mapping[str, float]) -> float:
    """A drivetrain's number after a change, inside its bounds."""
    changed = value + change if name in _ADDED else value * math.exp(change)
    return float(min(max(changed, bounds["low"]), bounds["high"]))


def load_draws(folder: str | Path, ground: str = "") -> CalibratedDraws:
    """Draws of the folder that ``ddagr calibrate`` wrote.

    Args:
        folder: of the calibration.
        ground: one of its grounds; all of them when it is "".

    Raises:
        InputError: no such folder, or an unknown ground.
    """
    path = Path(folder).expanduser() / NAME
    if not path.is_file():
        raise InputError(f"{folder} holds no {NAME}: give a folder that `ddagr calibrate` wrote.")
    return load_config(path, CalibratedDraws).on(ground)
