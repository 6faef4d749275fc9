"""How the scenario sets S0 to S8, V (validation) and T (transfer) were drawn (theory: control, section 5).

Sets are frozen once by ``ddagr freeze-scenarios`` and then read, never drawn again. V alone serves tuning and
selection; the others are opened only after the claims of ``configs/evaluation/claims.yaml`` are written. S1b to S8b and
Tb are a second drawing of S1 to S8 and T, made once much had been learnt from the first. The sets named ``on_`` and
:mod:`a plant <benchmarks.plants>` are the first sixty turns of S1b, on each plant. S1c to S8c, Tc and the same names
with ``_c`` at their end are a third drawing, made once the networks that correct the inertial filter had been trained;
S1d to S8d, Td and ``_d`` are a fourth, opened once the network of B6_pose_wide had been trained.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.plants import DEVELOPMENT_PLANTS, FURTHER_PLANTS, Plant, unchanged
from ddagr_gym.envs.options import make_settings
from ddagr_gym.envs.settings import Episode, Randomisation, TurnSettings
from ddagr_gym.evaluation.scenarios import GroundRecipe, Scenario, build_field
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.soil_laws import LAW, NOMINAL_LAW

_ROOT_SEED, _SECOND_SEED, _THIRD_SEED, _FOURTH_SEED = 20_261_120, 20_261_125, 20_261_127, 20_261_128
_ON_PLANT = 1
"""Last part of the seed of what a plant changes."""

_AS_DRAWN = Plant("as drawn", unchanged)

Draw = Callable[[np.random.Generator, int], tuple[Episode, GroundRecipe]]


@dataclass(frozen=True)
class SetPlan:
    """Plan of one set.

    Attributes:
        description: one line.
        count: scenarios in it.
        draw: (rng, number) -> episode without grid, and the recipe of its grid.
        same_as: set whose first scenarios these are, on the ground of another law or on a plant.
        law: name of the soil's law.
        root_seed: of the drawing.
        plant: how robot and ground are changed.
    """

    description: str
    count: int
    draw: Draw
    same_as: str | None = None
    law: str = NOMINAL_LAW
    root_seed: int = _ROOT_SEED
    plant: Plant = _AS_DRAWN


def _settings(soil: str, **changes: object) -> TurnSettings:
    spread = Randomisation(soil_variation=0.0)  # the grid comes from the recipe
    return make_settings(soil=soil, randomisation=spread, **changes)  # type: ignore[arg-type]


def _varied(rng: np.random.Generator) -> GroundRecipe:
    return GroundRecipe("random", int(rng.integers(2**31)), Randomisation().soil_variation)


def _nominal(rng: np.random.Generator, number: int) -> tuple[Episode, GroundRecipe]:
    side = ("left", "right")[number % 2]
    settings = make_settings(soil="thesis_a1", randomisation=False, side=side)
    return settings.draw(rng), GroundRecipe()


def _on(soil: str) -> Draw:
    def draw(rng: np.random.Generator, number: int) -> tuple[Episode, GroundRecipe]:
        return _settings(soil).draw(rng), _varied(rng)

    return draw


def _changing(rng: np.random.Generator, number: int) -> tuple[Episode, GroundRecipe]:
    """A soil step that the turn crosses at 30 and 150 degrees, or a patch at 45 to 135 degrees; weaker or stiffer."""
    episode = _settings("thesis_a1_range").draw(rng)
    turn = episode.turn
    angle = math.radians(float(rng.uniform(45.0, 135.0)))
    factor = float(rng.uniform(0.6, 0.8) if rng.integers(2) else rng.uniform(1.25, 1.6))
    x, y = turn.place_on_turn(angle).tolist()
    recipe = replace(_varied(rng), strength=factor, stiffness=factor)
    if rng.integers(2):
        return episode, replace(recipe, kind="step", x=0.5 * turn.radius)
    return episode, replace(recipe, kind="patch", x=x, y=y, radius=float(rng.uniform(0.3, 0.7)))


def _stressed(rng: np.random.Generator, number: int) -> tuple[Episode, GroundRecipe]:
    """Sensors at their data sheets' limits: biases, scales and noise several times the usual."""
    episode = _settings("thesis_a1_range").draw(rng)
    imu = episode.sensors.imu
    imu = replace(
        imu,
        gyro_bias=float(rng.normal(0.0, 8e-3)),
        gyro_scale=float(rng.uniform(0.97, 1.03)),
        gyro_noise=4.0 * imu.gyro_noise,
        accelerometer_noise=4.0 * imu.accelerometer_noise,
        accelerometer_bias=(float(rng.normal(0.0, 0.25)), float(rng.normal(0.0, 0.25))),
    )
    scale = (float(rng.uniform(0.98, 1.02)), float(rng.uniform(0.98, 1.02)))
    encoder = replace(episode.sensors.encoder, scale=scale)
    return replace(episode, sensors=replace(episode.sensors, imu=imu, encoder=encoder)), _varied(rng)


def _slow_motors(rng: np.random.Generator, number: int) -> tuple[Episode, GroundRecipe]:
    """The thesis's retuned motors, 1.4 1/s, and dead time."""
    episode = _settings("thesis_a1_range").draw(rng)
    robot = replace(episode.robot, motor_rate=1.4)
    return replace(episode, robot=robot, command_delay=float(rng.uniform(0.05, 0.25))), _varied(rng)


def _mirrored(root_seed: int) -> Draw:
    """Pairs: every odd scenario is the even one before it, mirrored; the sensors' noise is drawn anew."""

    def draw(rng: np.random.Generator, number: int) -> tuple[Episode, GroundRecipe]:
        twin = np.random.default_rng([root_seed, 7, number // 2])
        episode = _settings("thesis_a1_range", side="left").draw(twin)
        return (_mirror_image(episode) if number % 2 else episode), GroundRecipe()

    return draw


def _mirror_image(episode: Episode) -> Episode:
    imu = episode.sensors.imu
    along, across = imu.accelerometer_bias
    imu = replace(imu, gyro_bias=-imu.gyro_bias, accelerometer_bias=(along, -across))
    return replace(
        episode,
        turn=replace(episode.turn, side="right"),
        sensors=replace(episode.sensors, imu=imu),
        lateral_offset=-episode.lateral_offset,
        heading_offset=-episode.heading_offset,
    )


def _other_geometry(rng: np.random.Generator, number: int) -> tuple[Episode, GroundRecipe]:
    """Radii 0.65 to 1.2 m and speeds that fit into 25 s."""
    radius = float(rng.uniform(0.65, 1.2))
    least = (0.5 + math.pi * radius + 0.5) / 22.0
    speed = float(rng.uniform(max(least, 0.15), 0.30))
    return _settings("thesis_a1_range", radius=radius, speed=speed).draw(rng), _varied(rng)


PLANS = {
    "S0": SetPlan("nominal: thesis Table A.1, no randomisation, both sides", 10, _nominal),
    "S1": SetPlan("in range: thesis_a1_range with the default randomisation", 200, _on("thesis_a1_range")),
    "S2": SetPlan("weaker soils than the training range", 100, _on("weaker")),
    "S3": SetPlan("stiffer soils than the training range", 100, _on("stiffer")),
    "S4": SetPlan("a soil step or patch in mid-turn", 100, _changing),
    "S5": SetPlan("sensor stress: biases, scales and noise at the data sheets' limits", 100, _stressed),
    "S6": SetPlan("motor rate 1.4 1/s and dead time 0.05 to 0.25 s", 100, _slow_motors),
    "S7": SetPlan("mirrored pairs", 100, _mirrored(_ROOT_SEED)),
    "S8": SetPlan("other radii and speeds", 100, _other_geometry),
    "V": SetPlan("validation, in range: for tuning and selection only", 100, _on("thesis_a1_range")),
    "T": SetPlan("transfer: the first hundred of S1 on another soil law", 100, _on("thesis_a1_range"), "S1", LAW),
}
"""The sets of the first drawing by name."""

PLANT_COUNT = 60
"""Scenarios on each plant."""


def _again(name: str, drawing: str, ordinal: str, root_seed: int) -> SetPlan:
    """Plan of a set of the first drawing, drawn again."""
    plan = PLANS[name]
    return replace(
        plan,
        description=f"{ordinal} drawing, {plan.description}",
        draw=_mirrored(root_seed) if name == "S7" else plan.draw,
        same_as=None if plan.same_as is None else f"{plan.same_as}{drawing}",
        root_seed=root_seed,
    )


def _on_plant(plant: Plant, in_range: str) -> SetPlan:
    title = f"the first {PLANT_COUNT} of {in_range} on a plant: {plant.title}"
    plan = PLANS[in_range]
    return SetPlan(title, PLANT_COUNT, plan.draw, in_range, plant.law, plan.root_seed, plant)


_OTHER_PLANTS = {name: plant for name, plant in (DEVELOPMENT_PLANTS | FURTHER_PLANTS).items() if name != "level"}


def _drawn_again(letter: str, ordinal: str, root_seed: int, ending: str) -> tuple[tuple[str, ...], dict[str, Plant]]:
    """Names of the sets of another drawing, and plants by the names of their sets; all their plans enter PLANS.

    Args:
        letter: that ends the names of the sets.
        ordinal: of the drawing.
        root_seed: of the drawing.
        ending: of the names of the sets on plants.
    """
    names = (*(f"S{number}{letter}" for number in range(1, 9)), f"T{letter}")
    plants = {f"on_{name}{ending}": plant for name, plant in _OTHER_PLANTS.items()}
    PLANS.update({name: _again(name.removesuffix(letter), letter, ordinal, root_seed) for name in names})
    PLANS.update({name: _on_plant(plant, f"S1{letter}") for name, plant in plants.items()})
    return names, plants


SECOND, ON_PLANTS = _drawn_again("b", "second", _SECOND_SEED, "")
THIRD, ON_PLANTS_AGAIN = _drawn_again("c", "third", _THIRD_SEED, "_c")
FOURTH, ON_PLANTS_FOURTH = _drawn_again("d", "fourth", _FOURTH_SEED, "_d")
"""Names of the further drawings, and plants by the names of their sets; a set's draws depend on its place in PLANS."""

ALL_ON_PLANTS = ON_PLANTS | ON_PLANTS_AGAIN | ON_PLANTS_FOURTH
"""Plants by the names of their sets."""


def draw_set(name: str) -> list[tuple[int, Episode, GroundRecipe]]:
    """Noise seed, episode and ground recipe of each scenario of a set, from seeds of the set's own."""
    return [(seed, episode, recipe) for seed, episode, recipe, _ in _drawn(name)]


def draw_effects(name: str) -> list[tuple[Effect, ...]]:
    """Effects of each scenario of a set, without those of its soil's law."""
    return [effects for *_, effects in _drawn(name)]


def _drawn(name: str) -> Iterator[tuple[int, Episode, GroundRecipe, tuple[Effect, ...]]]:
    plan, names = PLANS[name], list(PLANS)
    for number in range(plan.count):
        rng = np.random.default_rng([plan.root_seed, names.index(plan.same_as or name), number])
        of_plant = np.random.default_rng([plan.root_seed, names.index(name), number, _ON_PLANT])
        episode, recipe = plan.draw(rng, number)
        changed, effects = plan.plant.change(episode, of_plant)
        yield int(rng.integers(2**31)), replace(changed, field=None), recipe, effects


def as_scenario(name: str, number: int, seed: int, episode: Episode, recipe: GroundRecipe) -> Scenario:
    """A drawn scenario with its grid, before it is frozen."""
    soil = episode.soils
    assert not isinstance(soil, tuple)
    return Scenario(
        name, number, seed, replace(episode, field=build_field(recipe, soil, episode.turn)), PLANS[name].law
    )
