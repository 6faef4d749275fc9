"""Plants that the controllers were not made for: changes of robot and ground about a drawn turn.

Shared by the development plants (:mod:`benchmarks.row_turn_plants`) and the frozen sets
(:mod:`benchmarks.scenario_sets`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ddagr_gym.envs.settings import Episode
from ddagr_gym.parameters import Drivetrain
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.lateral_bulldozing import LateralBulldozing
from ddagr_gym.physics.effects.multipass import Multipass
from ddagr_gym.physics.effects.payload import Payload
from ddagr_gym.physics.effects.slip_sinkage import SlipSinkage
from ddagr_gym.physics.effects.slope import Slope
from ddagr_gym.physics.effects.soil_change import SoilChange
from ddagr_gym.physics.effects.soil_patch import SoilPatch
from ddagr_gym.physics.effects.soil_split import SoilSplit
from ddagr_gym.physics.soil_laws import NOMINAL_LAW, ground_effects

Changed = tuple[Episode, tuple[Effect, ...]]
Maker = Callable[[Episode, np.random.Generator], Changed]


@dataclass(frozen=True)
class Plant:
    """A robot and ground that differ from the nominal ones.

    Attributes:
        title: in tables and pictures.
        change: (episode, rng) -> the episode and the effects in which it is driven.
        law: name of the soil's law.
    """

    title: str
    change: Maker
    law: str = NOMINAL_LAW

    def drawn(self, episode: Episode, rng: np.random.Generator) -> Changed:
        """The changed episode, and all effects in which it is driven, those of the law among them."""
        changed, effects = self.change(episode, rng)
        return changed, (*ground_effects(self.law), *effects)


def unchanged(episode: Episode, rng: np.random.Generator) -> Changed:
    """As drawn."""
    return episode, ()


def always(*effects: Effect) -> Maker:
    """The same effects in every turn."""
    return lambda episode, rng: (episode, effects)


def slope(degrees: float) -> Maker:
    """Ground that slopes by an angle, in any direction."""

    def change(episode: Episode, rng: np.random.Generator) -> Changed:
        return episode, (Slope(math.radians(degrees), float(rng.uniform(-math.pi, math.pi))),)

    return change


def weaker(episode: Episode, rng: np.random.Generator) -> Changed:
    """Strength x 0.7 from half of the turn on."""
    turn = episode.turn
    half = (turn.run_in + 0.5 * turn.turn_length) / turn.speed
    return episode, (SoilChange(0.7, 1.0, half),)


def late(episode: Episode, rng: np.random.Generator) -> Changed:
    """Commands 0.1 s later than drawn."""
    return replace(episode, command_delay=episode.command_delay + 0.1), ()


def heavy(episode: Episode, rng: np.random.Generator) -> Changed:
    """Mass 15 % above what was drawn."""
    return replace(episode, robot=replace(episode.robot, mass=1.15 * episode.robot.mass)), ()


def slow(episode: Episode, rng: np.random.Generator) -> Changed:
    """Motors half as fast as drawn."""
    return replace(episode, robot=replace(episode.robot, motor_rate=0.5 * episode.robot.motor_rate)), ()


WEAK_MOTORS = Drivetrain(
    load_compliance=0.2, integral_rate=30.0, integral_limit=12.0, acceleration_limit=12.0, no_load_speed=4.0
)
"""A bank of 5 kg m^2 with 60 N m at standstill and none at 4 rad/s: little more than the task's turns need, by turns on
development seeds (at 40 N m nobody turns, at 80 N m the limit is not felt)."""


def weak_motors(episode: Episode, rng: np.random.Generator) -> Changed:
    """Banks that the ground slows down, with a limited torque."""
    return replace(episode, robot=replace(episode.robot, drivetrain=WEAK_MOTORS)), ()


def loaded(episode: Episode, rng: np.random.Generator) -> Changed:
    """40 kg at a place on the platform."""
    x, y = (float(value) for value in rng.uniform((-0.2, -0.15), (0.2, 0.15)))
    return episode, (Payload(40.0, x, y),)


def split(episode: Episode, rng: np.random.Generator) -> Changed:
    """Soil of one side stronger by a fifth than that of the other."""
    strength = 1.2 if rng.integers(2) else 1.0 / 1.2
    return episode, (SoilSplit(strength),)


def patch(episode: Episode, rng: np.random.Generator) -> Changed:
    """A patch of strength x 0.55 on the turn, between 45 and 135 degrees of it."""
    turn = episode.turn
    angle = math.radians(float(rng.uniform(45.0, 135.0)))
    x, y = turn.place_on_turn(angle).tolist()
    return episode, (SoilPatch(0.55, centre_x=x, centre_y=y, radius=float(rng.uniform(0.3, 0.7)), edge=0.1),)


DEVELOPMENT_PLANTS = {
    "level": Plant("as modelled", unchanged),
    "slope_3": Plant("slope of 3 degrees", slope(3.0)),
    "slope_5": Plant("slope of 5 degrees", slope(5.0)),
    "weaker": Plant("strength x 0.7 from half of the turn on", weaker),
    "lateral_0.8": Plant("lateral forces x 0.8", unchanged, "lateral_0.8"),
    "lateral_1.2": Plant("lateral forces x 1.2", unchanged, "lateral_1.2"),
    "late": Plant("commands 0.1 s late", late),
    "heavy": Plant("mass + 15 %", heavy),
}
"""Plants by name on which controllers and filters were developed."""

FURTHER_PLANTS = {
    "ruts": Plant("rear wheels in ruts 30 % stiffer", always(Multipass(0.3))),
    "slip_sinkage": Plant("wheels dig in as they slip", always(SlipSinkage(0.3))),
    "bulldozing": Plant("soil pushed aside by the wheels' sides", always(LateralBulldozing(1.0))),
    "payload": Plant("40 kg on the platform", loaded),
    "slow": Plant("motors twice as slow", slow),
    "weak_motors": Plant("motors that feel the ground, torque limited", weak_motors),
    "split": Plant("soil of one side stronger by a fifth", split),
    "patch": Plant("a patch of strength x 0.55 on the turn", patch),
}
"""Plants that are driven frozen only."""
