"""Keyword arguments of ``gym.make`` turned into settings."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from gymnasium import spaces

from ddagr_gym.config import config_from
from ddagr_gym.envs.calibrated_draws import EFFECTS, load_draws
from ddagr_gym.envs.settings import Randomisation, RewardWeights, TurnSettings
from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.parameters import Numerics, Robot, Sensors, Soil
from ddagr_gym.physics.effects import Effect, load_effects
from ddagr_gym.physics.soil_draws import SoilDistribution, distribution_names, get_distribution
from ddagr_gym.presets import get_robot, get_soil, is_file, soil_names

DEFAULT_SOIL = "thesis_a1_range"
DEFAULT_REWARD = RewardWeights()
INFO_LEVELS = ("small", "full")

Effects = str | Path | Effect | Iterable[str | Effect | Mapping[str, Any]]
Fields = Mapping[str, Any]
"""An object's fields by name, nested: what Gymnasium's ``EnvSpec.to_json`` keeps of it."""

Given = TypeVar("Given")


def _of_fields(given: Given | Fields, kind: type[Given], name: str, others: str = "") -> Given:
    """The argument ``name`` as it is, or from its fields; ``others`` says what else it may be."""
    if isinstance(given, Mapping):
        return config_from(dict(given), kind, source=name)
    if not isinstance(given, kind):
        raise InputError(f"{name} is {given!r}: give {others}a {kind.__name__}, or its fields by name.")
    return given


def find_soil(soil: str | Path | Soil | SoilDistribution | Fields) -> Soil | SoilDistribution:
    """Soil or distribution by name, from a YAML file or from its fields; objects pass through.

    Raises:
        InputError: unknown name, with the closest ones; a file or an object that is neither.
    """
    if isinstance(soil, Path):
        soil = str(soil)
    if isinstance(soil, Mapping):
        kind: type[Soil | SoilDistribution] = SoilDistribution if "reference_pressure" in soil else Soil
        return _of_fields(soil, kind, "soil")
    if isinstance(soil, SoilDistribution):
        return soil
    if not isinstance(soil, str):
        return _of_fields(soil, Soil, "soil", "a name, a file, ")
    if is_file(soil):
        return _soil_of_file(soil)
    if soil in distribution_names():
        return get_distribution(soil)
    if soil in soil_names():
        return get_soil(soil)
    raise unknown_name("soil", soil, [*distribution_names(), *soil_names()])


def _soil_of_file(path: str) -> Soil | SoilDistribution:
    try:
        return get_soil(path)
    except InputError as no_soil:
        try:
            return get_distribution(path)
        except InputError as no_distribution:
            raise InputError(f"{path} is no soil ({no_soil}) and no distribution ({no_distribution})") from None


def make_settings(
    *,
    robot: str | Path | Robot | Fields = "ddagr",
    soil: str | Path | Soil | SoilDistribution | Fields = DEFAULT_SOIL,
    radius: float | tuple[float, float] | list[float] = 0.80,
    side: str = "random",
    run_in: float = 0.5,
    run_out: float = 0.5,
    speed: float | tuple[float, float] | list[float] = 0.20,
    sensors: Sensors | Fields = Sensors(),
    randomisation: bool | Randomisation | Fields = True,
    reward: RewardWeights | Fields = DEFAULT_REWARD,
    effects: Effects = (),
    numerics: Numerics | Fields = Numerics(),
    ekf_features: bool = False,
    filter: str = "flat",
    calibration: str | Path | None = None,
    ground: str = "",
    path_features: bool = False,
) -> TurnSettings:
    """Settings from what ``gym.make("DDAGR-Turn-v0", ...)`` takes; see :class:`ddagr_gym.envs.TurnEnv`.

    With a ``calibration``, the folder that ``ddagr calibrate`` wrote, every episode draws a robot and a soil of one of
    its grounds (or of ``ground``) from the scatter between its drives. They stand in place of ``robot``, ``soil`` and
    the default randomisation's spread of mass, inertia, motor rate and delay; its sensors' effects are added. A ground
    that sloped slopes as steeply, and the rows lie in any direction on it; ``filter="inertial"`` knows slopes.

    Every object may be given by its fields, and (low, high) as a list, so that an environment can be made again from
    JSON. Effects need their names: as texts, as a file or as the entries of one.

    Raises:
        InputError: any value that is not valid, in one sentence.
    """
    calibrated = None
    if calibration is not None:
        if robot != "ddagr" or soil != DEFAULT_SOIL:
            raise InputError(f"a calibration and a robot or soil are given: {calibration} has both, leave them out.")
        calibrated = load_draws(calibration, ground)
        robot, soil = calibrated.robot, calibrated.grounds[0].soil
        effects = (*load_effects(Path(calibration) / EFFECTS), *load_effects(effects))
        if randomisation is True:
            randomisation = Randomisation(mass=0.0, yaw_inertia=0.0, motor_rate=0.0, command_delay=0.0)
    elif ground:
        raise InputError(f"the ground is {ground!r} and there is no calibration: give its folder as calibration=.")
    if isinstance(randomisation, bool | np.bool_):
        randomisation = Randomisation() if randomisation else Randomisation.none()
    if isinstance(robot, str | Path):
        robot = get_robot(str(robot))
    return TurnSettings(
        robot=_of_fields(robot, Robot, "robot", "a name, a file, "),
        soil=find_soil(soil),
        radius=_range(radius),
        side=side,
        run_in=run_in,
        run_out=run_out,
        speed=_range(speed),
        sensors=_of_fields(sensors, Sensors, "sensors"),
        randomisation=_of_fields(randomisation, Randomisation, "randomisation", "True, False, "),
        reward=_of_fields(reward, RewardWeights, "reward"),
        effects=load_effects(effects),
        numerics=_of_fields(numerics, Numerics, "numerics"),
        ekf_features=ekf_features,
        filter=filter,
        calibrated=calibrated,
        path_features=path_features,
    )


def settings_from(arguments: Mapping[str, Any]) -> TurnSettings:
    """:func:`make_settings` of what ``gym.make`` was given.

    Raises:
        InputError: as there, and for an argument that is unknown, with the closest ones.
    """
    known = inspect.signature(make_settings).parameters
    for name in arguments:
        if name not in known:
            raise unknown_name("argument of the environment", name, known)
    return make_settings(**arguments)


def _range(value: Any) -> Any:
    """Python's numbers for numpy's, and (low, high) as a tuple, for which JSON has a list."""
    plain = value.tolist() if isinstance(value, np.ndarray | np.number) else value
    return tuple(plain) if isinstance(plain, list) else plain


def check_info_level(level: str) -> str:
    """``level`` if it is one of INFO_LEVELS, else an InputError."""
    if level not in INFO_LEVELS:
        raise unknown_name("info_level", level, INFO_LEVELS)
    return level


def check_mode(mode: str | None, allowed: Iterable[str | None]) -> str | None:
    """``mode`` if it is None or allowed, else an InputError."""
    if mode is not None and mode not in allowed:
        raise InputError(f"render_mode is {mode!r}: give {' or '.join(map(repr, (None, *allowed)))}.")
    return mode


def action_space() -> spaces.Box:
    """Right and left bank speed command over the robot's maximum_wheel_speed."""
    return spaces.Box(-1.0, 1.0, (2,), np.float32)
