"""How the scenario sets S0 to S8, V (validation) and T (transfer) were drawn (theory: control, section 5).

Sets are frozen once by ``ddagr freeze-scenarios`` and then read, never drawn again. V alone serves tuning and
selection; the others are opened only after the claims of ``configs/evaluation/claims.yaml`` are written.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ddagr_gym.envs.options import make_settings
from ddagr_gym.envs.settings import Episode, Randomisation, TurnSettings
from ddagr_gym.evaluation.scenarios import GroundRecipe, Scenario, build_field
from ddagr_gym.physics.soil_laws import LAW, NOMINAL_LAW

_ROOT_SEED = 20_261_120


@dataclass(frozen=True)
class SetPlan:
    """Plan of one set.

    Attributes:
        description: one line.
        count: scenarios in it.
        draw: (rng, number) -> episode without grid, and the recipe of its grid.
        same_as: set whose scenarios these are, on the ground of another law.
        law: name of the soil's law.
    """

    description: str
    count: int
    draw: Callable[[np.random.Generator, int], tuple[Episode, GroundRecipe]]
    same_as: str | None = None
    law: str = NOMINAL_LAW


def _settings(soil: str, **changes: object) -> TurnSettings:
    spread = Randomisation(soil_variation=0.0)  # the grid comes from the recipe
    return make_settings(soil=soil, randomisation=spread, **changes)  # type: ignore[arg-type]


def _varied(rng: np.random.Generator) -> GroundRecipe:
    return GroundRecipe("random", int(rng.integers(2**31)), Randomisation().soil_variation)


def _nominal(rng: np.random.Generator, number: int) -> tuple[Episode, GroundRecipe]:
    side = ("left", "right")[number % 2]
    settings = make_settings(soil="thesis_a1", randomisation=False, side=side)
    return settings.draw(rng), GroundRecipe()


def _on(soil: str) -> Callable[[np.random.Generator, int], tuple[Episode, GroundRecipe]]:
    def draw(rng: np.random.Generator, number: int) -> tuple[Episode, GroundRecipe]:
        return _settings(soil).draw(rng), _varied(rng)

    return draw


def _changing(rng: np.random.Generator, number: int) -> tuple[Episode, GroundRecipe]:
    """A soil step that the turn crosses at 30 and 150 degrees, or a patch at 45 to 135 degrees; weaker or stiffer."""
    episode = _settings("thesis_a1_range").draw(rng)
    turn = episode.turn
    angle = math.radians(float(rng.uniform(45.0, 135.0)))
    factor = float(rng.uniform(0.6, 0.8) if rng.integers(2) else rng.uniform(1.25, 1.6))
    x, y = turn.radius * math.sin(angle), turn.sign * turn.radius * (1.0 - math.cos(angle))
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


def _mirrored(rng: np.random.Generator, number: int) -> tuple[Episode, GroundRecipe]:
    """Pairs: every odd scenario is the even one before it, mirrored; the sensors' noise is drawn anew."""
    twin = np.random.default_rng([_ROOT_SEED, 7, number // 2])
    episode = _settings("thesis_a1_range", side="left").draw(twin)
    if number % 2:
        turn, imu = replace(episode.turn, side="right"), episode.sensors.imu
        along, across = imu.accelerometer_bias
        imu = replace(imu, gyro_bias=-imu.gyro_bias, accelerometer_bias=(along, -across))
        episode = replace(
            episode,
            turn=turn,
            sensors=replace(episode.sensors, imu=imu),
            lateral_offset=-episode.lateral_offset,
            heading_offset=-episode.heading_offset,
        )
    return episode, GroundRecipe()


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
    "S7": SetPlan("mirrored pairs", 100, _mirrored),
    "S8": SetPlan("other radii and speeds", 100, _other_geometry),
    "V": SetPlan("validation, in range: for tuning and selection only", 100, _on("thesis_a1_range")),
    "T": SetPlan("transfer: the first hundred of S1 on another soil law", 100, _on("thesis_a1_range"), "S1", LAW),
}
"""The sets by name."""


def draw_set(name: str) -> list[tuple[int, Episode, GroundRecipe]]:
    """Noise seed, episode and ground recipe of each scenario of a set, from seeds of the set's own."""
    plan = PLANS[name]
    number_of_set = list(PLANS).index(plan.same_as or name)
    drawn = []
    for number in range(plan.count):
        rng = np.random.default_rng([_ROOT_SEED, number_of_set, number])
        episode, recipe = plan.draw(rng, number)
        drawn.append((int(rng.integers(2**31)), replace(episode, field=None), recipe))
    return drawn


def as_scenario(name: str, number: int, seed: int, episode: Episode, recipe: GroundRecipe) -> Scenario:
    """A drawn scenario with its grid, before it is frozen."""
    soil = episode.soils
    assert not isinstance(soil, tuple)
    return Scenario(
        name, number, seed, replace(episode, field=build_field(recipe, soil, episode.turn)), PLANS[name].law
    )
