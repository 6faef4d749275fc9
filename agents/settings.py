"""What a training run is: everything that its YAML file in configs/training says, strictly read."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from ddagr_gym.envs.calibrated_draws import EFFECTS, load_draws
from ddagr_gym.envs.settings import Randomisation, RewardWeights
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import FilterModel, InertialModel
from ddagr_gym.parameters import Drivetrain, Sensors
from ddagr_gym.physics.effects import load_effects
from ddagr_gym.policies.design import PolicyDesign
from ddagr_gym.presets import get_robot
from ddagr_gym.validated import Validated, bounded

ROBOT = "ddagr"
"""Robot of the published policies."""


@dataclass(frozen=True)
class TaskSettings(Validated):
    """The turns that are trained on.

    Attributes:
        robot: its data sheet: name or YAML file, such as `ddagr diagnose` and `ddagr adapt` write.
        soil: distribution that each episode draws from, or a single soil by name or YAML file.
        radius: R*, lowest and highest [m].
        speed: reference speed, lowest and highest [m/s].
        randomisation: what differs from episode to episode besides the soil.
        reward: weights of the terms.
        effects: missing physics, name=size or the path of an effects file such as `ddagr diagnose` writes.
        calibration: folder that `ddagr calibrate` wrote: its robot and soils, drawn as they differ between drives, in
            place of ``robot`` and ``soil``; "" for these.
        ground: one of its grounds; "" for all of them.
    """

    robot: str = ROBOT
    soil: str = "thesis_a1_range"
    radius: tuple[float, float] = (0.65, 1.20)
    speed: tuple[float, float] = (0.16, 0.30)
    randomisation: Randomisation = field(default_factory=Randomisation)
    reward: RewardWeights = field(default_factory=RewardWeights)
    effects: tuple[str, ...] = ()
    calibration: str = ""
    ground: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.calibration and self.robot != ROBOT:
            raise InputError(
                f"task.robot is {self.robot!r} beside task.calibration, which has a robot of its own: leave one of the "
                "two out."
            )

    def environment(self, design: PolicyDesign) -> dict[str, Any]:
        """Keyword arguments of the environment."""
        return {
            **self._robot_and_soil(),
            "radius": self.radius,
            "speed": self.speed,
            "reward": self.reward,
            "effects": self.effects,
            **design.environment,
        }

    def _robot_and_soil(self) -> dict[str, Any]:
        if not self.calibration:
            return {"robot": self.robot, "soil": self.soil, "randomisation": self.randomisation}
        # a calibration has a spread of its own in place of the default one
        chosen = True if self.randomisation == Randomisation() else self.randomisation
        return {"calibration": self.calibration, "ground": self.ground, "randomisation": chosen}


@dataclass(frozen=True)
class PpoSettings(Validated):
    """Proximal policy optimisation (Schulman et al. 2017), as Stable-Baselines3 names its parts.

    Attributes:
        rollout: control steps per environment between updates.
        batch: samples per gradient step.
        epochs: passes over a rollout.
        learning_rate: at the start; falls linearly to a twentieth.
        discount: per control step [-].
        trace: lambda of the generalised advantage [-].
        clip: of the probability ratio [-].
        entropy: weight of the entropy bonus [-].
        initial_deviation: of the outputs [-].
        hidden: units of the two layers of policy and value.
    """

    rollout: int = 64
    batch: int = 1024
    epochs: int = 5
    learning_rate: float = bounded("-", 0.0, 1.0, default=1e-3, open_low=True)
    discount: float = bounded("-", 0.0, 1.0, default=0.98)
    trace: float = bounded("-", 0.0, 1.0, default=0.9)
    clip: float = bounded("-", 0.0, 1.0, default=0.2, open_low=True)
    entropy: float = bounded("-", 0.0, 1.0, default=0.0)
    initial_deviation: float = bounded("-", 0.0, 2.0, default=0.2, open_low=True)
    hidden: tuple[int, ...] = (64, 64)


@dataclass(frozen=True)
class SacSettings(Validated):
    """Soft actor-critic (Haarnoja et al. 2018), as Stable-Baselines3 names its parts.

    Attributes:
        buffer: transitions kept.
        batch: samples per gradient step.
        start: control steps with random outputs before learning.
        learning_rate: of actor and critics.
        discount: per control step [-].
        smoothing: of the target critics [-].
        gradient_steps: per step of the whole batch of environments.
        hidden: units of the layers of actor and critics.
    """

    buffer: int = 200_000
    batch: int = 256
    start: int = 2_000
    learning_rate: float = bounded("-", 0.0, 1.0, default=1e-3, open_low=True)
    discount: float = bounded("-", 0.0, 1.0, default=0.98)
    smoothing: float = bounded("-", 0.0, 1.0, default=0.01, open_low=True)
    gradient_steps: int = 8
    hidden: tuple[int, ...] = (64, 64)


@dataclass(frozen=True)
class TrainingSettings:
    """One training arm.

    Attributes:
        description: one line.
        algorithm: "ppo" or "sac".
        seeds: how many training seeds, from 0.
        steps: control steps of one training, all environments together.
        environments: in the batch.
        validation_interval: control steps between drives of the validation set.
        design: what the policy sees and does.
        task: what it is trained on.
        ppo: of the algorithm.
        sac: of the algorithm.
    """

    description: str
    algorithm: Literal["ppo", "sac"] = "ppo"
    seeds: int = 1
    steps: int = 1_000_000
    environments: int = 128
    validation_interval: int = 250_000
    design: PolicyDesign = field(default_factory=PolicyDesign)
    task: TaskSettings = field(default_factory=TaskSettings)
    ppo: PpoSettings = field(default_factory=PpoSettings)
    sac: SacSettings = field(default_factory=SacSettings)

    def __post_init__(self) -> None:
        for name in ("seeds", "steps", "environments", "validation_interval"):
            if getattr(self, name) < 1:
                raise InputError(f"TrainingSettings.{name} is {getattr(self, name)}: give at least 1.")

    def digest(self) -> str:
        """SHA-256 over everything that decides the result of a seed."""
        content = asdict(self)
        for name in ("description", "seeds", "validation_interval"):
            del content[name]
        robot = get_robot(content["task"].pop("robot"))
        # the policy is fitted to this filter: with another one it has to be trained anew
        content["filter"] = asdict(FilterModel.of(robot, Sensors()))
        if content["filter"]["robot"]["drivetrain"] == asdict(Drivetrain()):
            # one without parts is no part: digests of before robots had one stay as they were
            del content["filter"]["robot"]["drivetrain"]
        if self.design.tracker is None:
            # likewise before policies had one
            del content["design"]["tracker"]
        else:
            content["inertial"] = asdict(InertialModel.of(robot, Sensors()).knowledge)
            if content["inertial"]["learns_vibration"]:
                # before there was a choice it always did
                del content["inertial"]["learns_vibration"]
        if not self.task.randomisation.slope:
            del content["task"]["randomisation"]["slope"]
        for name in ("side_slip_lead", "sinkage_tilt"):
            if not content["filter"]["robot"][name]:
                del content["filter"]["robot"][name]
        calibration, ground = (content["task"].pop(name) for name in ("calibration", "ground"))
        if calibration:
            # what a calibration says counts, not its path
            content["calibration"] = asdict(load_draws(calibration, ground))
            content["sensors"] = [effect.as_mapping() for effect in load_effects(Path(calibration) / EFFECTS)]
        if self.task.effects:
            # what a file of effects says counts, not its path
            content["effects"] = [effect.as_mapping() for effect in load_effects(self.task.effects)]
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
