"""Frozen scenario sets: what every controller drives, the same soils and the same noise (theory: control, section 5).

A set is a compressed JSON file of episodes with their noise seeds, and a SHA-256 over all of them. Soil grids are
rebuilt from their own seed and checked against a sum that the file holds. A set that no longer agrees is refused, not
driven. Whether a scenario's turn can be made at all is no part of it: the upper bounds say so when they drive it
(:mod:`ddagr_gym.evaluation.campaign`).
"""

from __future__ import annotations

import gzip
import hashlib
import io
import json
import math
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from ddagr_gym.config import configs_dir
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.envs.settings import Episode
from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.files import MAXIMUM_JSON, atomic_path, parse_json, read_bytes
from ddagr_gym.parameters import Drivetrain, Robot, Sensors, Soil
from ddagr_gym.physics.effects import Effect, build_effect, effect_kind
from ddagr_gym.physics.soil_laws import NOMINAL_LAW
from ddagr_gym.physics.terrain import SoilField
from ddagr_gym.presets import get_robot

FORMAT = 1
"""Of the files; another number is refused."""
SUFFIX = ".json.gz"

_GRID_TOLERANCE = 1e-9
"""Relative; the last bits of exp and fft differ between machines."""

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
        law: name of the soil's law, see :mod:`ddagr_gym.physics.soil_laws`.
        effects: what else the turn is driven in, of the library.
    """

    set_name: str
    number: int
    seed: int
    episode: Episode
    law: str = NOMINAL_LAW
    effects: tuple[Effect, ...] = ()


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


def _fingerprint(law: str, items: Sequence[Mapping[str, Any]]) -> str:
    """SHA-256 over a law and scenarios as a file has them."""
    return hashlib.sha256(json.dumps([law, *items], sort_keys=True).encode()).hexdigest()


def _grid_sum(field: SoilField | None) -> float:
    """Weighted sum over a grid's nodes, each with another weight, as a checksum; 0 without a grid."""
    if field is None:
        return 0.0
    values = field.values.ravel()
    return float(np.log1p(np.abs(values)) @ np.cos(np.arange(values.size)) + np.log1p(np.abs(values)).sum())


def _to_json(seed: int, episode: Episode, recipe: GroundRecipe, effects: Sequence[Effect] = ()) -> dict[str, Any]:
    robot, imu, soil = episode.robot, episode.sensors.imu, episode.soils
    assert not isinstance(soil, tuple)  # the plans draw one soil for all wheels
    named: dict[str, Any] = {"name": robot.name} | {key: getattr(robot, key) for key in ROBOT_FIELDS}
    if robot.drivetrain != get_robot(robot.name).drivetrain:
        named["drivetrain"] = asdict(robot.drivetrain)
    added = {"effects": [effect.as_mapping() for effect in effects]} if effects else {}
    return added | {
        "seed": seed,
        "turn": asdict(episode.turn),
        "robot": named,
        "soil": asdict(soil),
        "imu": {name: getattr(imu, name) for name in SENSOR_FIELDS},
        "encoder_scale": list(episode.sensors.encoder.scale),
        "command_delay": episode.command_delay,
        "lateral_offset": episode.lateral_offset,
        "heading_offset": episode.heading_offset,
        "ground": asdict(recipe),
        "grid_sum": _grid_sum(build_field(recipe, soil, episode.turn)),
    }


def _from_json(set_name: str, number: int, item: Mapping[str, Any], law: str) -> Scenario:
    given = dict(item["robot"])
    if "drivetrain" in given:
        given["drivetrain"] = Drivetrain(**given["drivetrain"])
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
    field = build_field(recipe, soil, turn)
    if not math.isclose(_grid_sum(field), item["grid_sum"], rel_tol=_GRID_TOLERANCE, abs_tol=_GRID_TOLERANCE):
        raise InputError(
            f"scenario {number} of set {set_name!r} gets another soil grid than the one that was frozen: use the "
            "version of ddagr-gym and numpy that froze it, or freeze the set anew."
        )
    episode = Episode(
        turn=turn,
        robot=robot,
        soils=soil,
        sensors=sensors,
        command_delay=item["command_delay"],
        lateral_offset=item["lateral_offset"],
        heading_offset=item["heading_offset"],
        field=field,
    )
    effects = tuple(build_effect(effect_kind(one["name"]), one["parameters"]) for one in item.get("effects", ()))
    return Scenario(set_name, number, item["seed"], episode, law, effects)


def scenario_folder() -> Path:
    """Folder of the frozen sets."""
    return configs_dir() / "evaluation" / "scenarios"


def scenario_names() -> tuple[str, ...]:
    """Names of the frozen sets."""
    return tuple(sorted(path.name.removesuffix(SUFFIX) for path in scenario_folder().glob(f"*{SUFFIX}")))


def set_hash(name: str) -> str:
    """SHA-256 of a frozen set, checked against its content; InputError as :func:`load_scenarios`."""
    content = _read(name, scenario_folder() / f"{name}{SUFFIX}")
    return str(content["sha256"])


def set_description(name: str) -> str:
    """What a frozen set holds, in one line; InputError as :func:`load_scenarios`."""
    content = _read(name, scenario_folder() / f"{name}{SUFFIX}")
    return str(content["description"])


def load_scenarios(name: str) -> list[Scenario]:
    """A frozen set by name.

    Raises:
        InputError: unknown name, another format, a hash or a soil grid that does not agree.
    """
    return list(_load(name, scenario_folder()))


@lru_cache(maxsize=4)
def _load(name: str, folder: Path) -> tuple[Scenario, ...]:
    content = _read(name, folder / f"{name}{SUFFIX}")
    law = content["law"]
    return tuple(_from_json(name, number, item, law) for number, item in enumerate(content["scenarios"]))


def _read(name: str, path: Path) -> dict[str, Any]:
    """Content of a set's file, once its hash agrees."""
    if name not in scenario_names():
        raise unknown_name("scenario set", name, scenario_names())
    content = _unpacked(path)
    if content.get("format") != FORMAT:
        raise InputError(f"scenario set {name!r} has format {content.get('format')!r}: this version reads {FORMAT}.")
    absent = [entry for entry in ("description", "law", "scenarios", "sha256") if entry not in content]
    if absent:
        raise _no_set(path, f"it lacks {absent[0]!r}")
    if _fingerprint(content["law"], content["scenarios"]) != content["sha256"]:
        raise InputError(f"scenario set {name!r} is not what its hash says: restore its file, or freeze it anew.")
    return content


def _unpacked(path: Path) -> dict[str, Any]:
    """Mapping of a compressed JSON file."""

    def refusal(reason: str) -> InputError:
        return _no_set(path, reason)

    try:
        with gzip.open(io.BytesIO(read_bytes(path, MAXIMUM_JSON, refusal))) as stream:
            text = stream.read(MAXIMUM_JSON + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise refusal(str(error)) from None
    if len(text) > MAXIMUM_JSON:
        raise refusal(f"it holds more than {MAXIMUM_JSON} bytes")
    content = parse_json(text, refusal)
    if not isinstance(content, dict):
        raise refusal("it holds no mapping")
    return content


def _no_set(path: Path, reason: str) -> InputError:
    return InputError(f"{path} is not a scenario set ({reason}): restore the file, or freeze the set anew.")


def save_scenarios(
    name: str,
    description: str,
    drawn: Sequence[tuple[int, Episode, GroundRecipe]],
    folder: Path | None = None,
    law: str = NOMINAL_LAW,
    effects: Sequence[Sequence[Effect]] | None = None,
) -> Path:
    """Freeze a set: (noise seed, episode without grid, recipe of the grid) each.

    Args:
        name: of the set, and of its file.
        description: one line.
        drawn: the scenarios.
        folder: of the file; that of the shipped sets by default.
        law: name of the soil's law.
        effects: of each scenario; none by default.

    Returns:
        The file.
    """
    added = [()] * len(drawn) if effects is None else effects
    items = json.loads(json.dumps([_to_json(*item, own) for item, own in zip(drawn, added, strict=True)]))
    content = {
        "format": FORMAT,
        "name": name,
        "description": description,
        "law": law,
        "sha256": _fingerprint(law, items),
        "scenarios": items,
    }
    target = (scenario_folder() if folder is None else folder) / f"{name}{SUFFIX}"
    with atomic_path(target) as temporary:
        temporary.write_bytes(gzip.compress(json.dumps(content, separators=(",", ":")).encode(), mtime=0))
    return target
