"""Bundles: an adapted controller with all that it knows, as a folder that `ddagr adapt` writes and others load."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

from ddagr_gym.config import dump_config, load_config
from ddagr_gym.control.constant_speeds import ConstantSpeeds
from ddagr_gym.control.path_tracker import PathTracker
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.adapted_controller import AdaptedController, AdaptedSettings
from ddagr_gym.evaluation.adapted_tracker import adapted_tracker
from ddagr_gym.evaluation.calibration import calibrate_constant_speeds
from ddagr_gym.evaluation.known_physics import KnownPhysics, known_physics
from ddagr_gym.files import write_text
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.physics.effects import Effect, load_effects, save_effects
from ddagr_gym.presets import get_robot, get_soil

CONTROLLER, ROBOT, SOIL, EFFECTS = "controller.yaml", "robot.yaml", "soil.yaml", "effects.yaml"
"""Files of a bundle."""


@dataclass(frozen=True, eq=False)
class Bundle:
    """An adapted controller and what it knows.

    Attributes:
        settings: gains and feed-forward.
        robot: corrected.
        soil: corrected.
        effects: named, at their estimated sizes.
    """

    settings: AdaptedSettings
    robot: Robot
    soil: Soil
    effects: tuple[Effect, ...] = ()
    _constants: dict[tuple[float, float], ConstantSpeeds] = field(default_factory=dict, repr=False)

    @property
    def adapted_from(self) -> str:
        """Name of the nominal controller: B6 or B4."""
        return "B4" if self.settings.tracker is None else "B6"

    @property
    def known(self) -> KnownPhysics:
        """What the effects mean for the controller."""
        return known_physics(self.robot, self.effects)

    @property
    def used(self) -> tuple[str, ...]:
        """Names of effects that filter and controller know themselves."""
        return self.known.used

    def controller(self, turn: RowTurn) -> AdaptedController | PathTracker:
        """Controller of a commanded turn; InputError where the robot cannot turn so on this soil."""
        known, settings = self.known, self.settings
        constants = self.constants(turn)
        ratio = constants.track_ratio(turn, known.robot)
        if settings.tracker is None:
            return AdaptedController(settings, known, settings.sensors, ratio, constants.lead)
        return adapted_tracker(
            settings.tracker, known, settings.sensors, settings.soil_prior, ratio, constants.lead, settings.row_heading
        )

    def constants(self, turn: RowTurn) -> ConstantSpeeds:
        """Constant speeds of the robot as it is known, which serve where the estimated soil has no solution."""
        return self._steady(self.known.robot, turn)

    def _steady(self, robot: Robot, turn: RowTurn) -> ConstantSpeeds:
        key = (turn.radius, turn.speed)
        if key not in self._constants:
            plain = RowTurn(radius=turn.radius, speed=turn.speed)
            self._constants[key] = calibrate_constant_speeds(robot, self.soil, plain)
        return self._constants[key]

    def with_settings(self, settings: AdaptedSettings) -> Bundle:
        """The same with other gains and feed-forward."""
        return Bundle(settings, self.robot, self.soil, self.effects, self._constants)

    def save(self, folder: Path, source: str = "") -> None:
        """Write the bundle's files into a folder."""
        head = f"# {source}\n" if source else ""
        for name, content in ((CONTROLLER, self.settings), (ROBOT, self.robot), (SOIL, self.soil)):
            write_text(folder / name, head + dump_config(content))
        save_effects(folder / EFFECTS, self.effects, source=source)


def is_bundle(name: str | Path) -> bool:
    """Whether a controller's name is the folder of a bundle."""
    return (Path(name).expanduser() / CONTROLLER).is_file()


def load_bundle(folder: str | Path) -> Bundle:
    """Bundle of a folder; InputError where a file is missing or wrong."""
    return _load(str(Path(folder).expanduser().resolve()), bundle_version(folder))


def bundle_version(folder: str | Path) -> str:
    """Hash of a bundle's files; InputError where one is missing."""
    digest = hashlib.sha256()
    for name in (CONTROLLER, ROBOT, SOIL, EFFECTS):
        path = Path(folder).expanduser() / name
        if not path.is_file():
            raise InputError(f"{folder} holds no {name}: give a folder that `ddagr adapt` wrote.")
        digest.update(path.read_bytes())
    return digest.hexdigest()


@lru_cache(maxsize=8)
def _load(folder: str, version: str) -> Bundle:
    place = Path(folder)
    return Bundle(
        load_config(place / CONTROLLER, AdaptedSettings),
        get_robot(str(place / ROBOT)),
        get_soil(str(place / SOIL)),
        load_effects(place / EFFECTS),
    )
