"""Frozen scenario sets: what every controller drives, the same soils and the same noise (control.md, "Protocol").

A set is a JSON file of episodes with their seeds, and a SHA-256 over everything that the simulator will see, soil grids
included. Grids are rebuilt from their own seed; a set whose hash no longer agrees is refused, not driven.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ddagr_gym.config import configs_dir
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.envs.settings import Episode
from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.files import atomic_path
from ddagr_gym.parameters import Robot, Sensors, Soil
from ddagr_gym.physics.terrain import SoilField
from ddagr_gym.presets import get_robot

FORMAT = 1

SENSOR_FIELDS = ("gyro_bias", "gyro_scale", "gyro_noise", "accelerometer_noise", "accelerometer_bias")
"""Fields of the IMU that scenarios may change."""
ROBOT_FIELDS = ("mass", "yaw_inertia", "motor_rate")
"""Fields of the robot that scenarios may change."""


@dataclass(frozen=True)
class Scenario:
    """One frozen episode.

    Attributes:
        set_name: of its set.
        number: in the set, from 0.
        seed: of the sensor noise.
        episode: what is driven.
        feasible: whether the controller with the true state makes this turn.
    """

    set_name: str
    number: int
    seed: int
    episode: Episode
    feasible: bool = True


@dataclass(frozen=True)
class GroundRecipe:
    """How a scenario's soil grid is rebuilt.

    Attributes:
        kind: "uniform", "random" (variation about the soil), "step" or "patch" of other strength.
        seed: of the random field.
        variation: relative scatter of strength [-].
        correlation_length: of the random field [m].
        strength: factor on cohesion and tan(phi) beyond the step or in the patch [-].
        stiffness: factor on the moduli there [-].
        x: where the step lies, or the patch's centre [m].
        y: the patch's centre [m].
        radius: of the patch [m].
    """

    kind: str = "uniform"
    seed: int = 0
    variation: float = 0.0
    correlation_length: float = 0.5
    strength: float = 1.0
    stiffness: float = 1.0
    x: float = 0.0
    y: float = 0.0
    radius: float = 0.0


def build_field(recipe: GroundRecipe, soil: Soil, turn: RowTurn) -> SoilField | None:
    """Soil grid of a recipe over the room that the turn needs."""
    from ddagr_gym.physics.soil_draws import soil_field

    if recipe.kind == "uniform":
        return None
    reach = 2.0 * turn.radius + 0.8
    extent = (-turn.run_in - 0.5, turn.radius + 1.0, -reach, reach)
    rng = np.random.default_rng(recipe.seed)
    field = soil_field(soil, rng, recipe.variation, recipe.correlation_length, extent)
    return field if recipe.kind == "random" else _with_change(field, recipe)


def _with_change(field: SoilField, recipe: GroundRecipe) -> SoilField:
    nx, ny = field.values.shape[:2]
    x = field.origin[0] + field.spacing[0] * np.arange(nx)[:, None]
    y = field.origin[1] + field.spacing[1] * np.arange(ny)[None, :]
    if recipe.kind == "step":
        inside = np.broadcast_to(x >= recipe.x, (nx, ny))
    elif recipe.kind == "patch":
        inside = np.hypot(x - recipe.x, y - recipe.y) <= recipe.radius
    else:
        raise unknown_name("ground", recipe.kind, ("uniform", "random", "step", "patch"))
    values = field.values.copy()
    values[inside, 0:2] *= recipe.strength
    values[inside, 3:5] *= recipe.stiffness
    return SoilField(field.origin, field.spacing, values)


def _fingerprint(scenarios: list[Scenario]) -> str:
    digest = hashlib.sha256()
    for scenario in scenarios:
        field = scenario.episode.field
        digest.update(json.dumps(_to_json(scenario, GroundRecipe()), sort_keys=True).encode())
        if field is not None:
            # to nine digits: the last bits of exp and fft differ between machines
            digest.update(np.array([f"{v:.9e}" for v in field.values[:, :, :5].ravel()]).tobytes())
    return digest.hexdigest()


def _to_json(scenario: Scenario, recipe: GroundRecipe) -> dict[str, Any]:
    episode, robot, imu = scenario.episode, scenario.episode.robot, scenario.episode.sensors.imu
    named = {"name": robot.name} | {key: getattr(robot, key) for key in ROBOT_FIELDS}
    return {
        "seed": scenario.seed,
        "feasible": scenario.feasible,
        "turn": asdict(episode.turn),
        "robot": named,
        "soil": asdict(episode.soils),  # type: ignore[arg-type]
        "imu": {name: getattr(imu, name) for name in SENSOR_FIELDS},
        "encoder_scale": list(episode.sensors.encoder.scale),
        "command_delay": episode.command_delay,
        "lateral_offset": episode.lateral_offset,
        "heading_offset": episode.heading_offset,
        "ground": asdict(recipe),
    }


def _from_json(set_name: str, number: int, item: Mapping[str, Any]) -> Scenario:
    given = dict(item["robot"])
    robot: Robot = replace(get_robot(given.pop("name")), **given)
    soil, turn, recipe = Soil(**item["soil"]), RowTurn(**item["turn"]), GroundRecipe(**item["ground"])
    imu: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in item["imu"].items()
    }
    nominal = Sensors()
    sensors = replace(
        nominal,
        imu=replace(nominal.imu, **imu),
        encoder=replace(nominal.encoder, scale=tuple(item["encoder_scale"])),
    )
    episode = Episode(
        turn=turn,
        robot=robot,
        soils=soil,
        sensors=sensors,
        command_delay=item["command_delay"],
        lateral_offset=item["lateral_offset"],
        heading_offset=item["heading_offset"],
        field=build_field(recipe, soil, turn),
    )
    return Scenario(set_name, number, item["seed"], episode, item["feasible"])


def scenario_folder() -> Path:
    """Folder of the frozen sets."""
    return configs_dir() / "evaluation" / "scenarios"


def scenario_names() -> tuple[str, ...]:
    """Names of the frozen sets."""
    return tuple(sorted(path.stem for path in scenario_folder().glob("*.json")))


def load_scenarios(name: str) -> list[Scenario]:
    """A frozen set by name.

    Raises:
        InputError: unknown name, another format, or a hash that does not agree.
    """
    if name not in scenario_names():
        raise unknown_name("scenario set", name, scenario_names())
    content = json.loads((scenario_folder() / f"{name}.json").read_text(encoding="utf-8"))
    if content.get("format") != FORMAT:
        raise InputError(f"scenario set {name!r} has format {content.get('format')!r}: this version reads {FORMAT}.")
    scenarios = [_from_json(name, number, item) for number, item in enumerate(content["scenarios"])]
    if _fingerprint(scenarios) != content["sha256"]:
        raise InputError(f"scenario set {name!r} is not what its hash says: restore its file, or freeze it anew.")
    return scenarios


def save_scenarios(
    name: str, description: str, drawn: list[tuple[int, Episode, GroundRecipe, bool]], path: Path | None = None
) -> Path:
    """Freeze a set: (noise seed, episode without grid, recipe of the grid, feasible) each.

    Returns:
        The file.
    """
    items = [
        _to_json(Scenario(name, n, seed, episode, feasible), recipe)
        for n, (seed, episode, recipe, feasible) in enumerate(drawn)
    ]
    scenarios = [_from_json(name, number, item) for number, item in enumerate(json.loads(json.dumps(items)))]
    content = {"format": FORMAT, "name": name, "description": description, "sha256": _fingerprint(scenarios)}
    target = scenario_folder() / f"{name}.json" if path is None else path
    with atomic_path(target) as temporary:
        temporary.write_text(json.dumps({**content, "scenarios": items}, indent=0), encoding="utf-8")
    return target
