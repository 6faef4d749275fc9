"""What ``ddagr train`` runs: one training, or all that are published."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from agents.run import MakeModel, train
from agents.settings import TrainingSettings
from agents.train_ppo import make_ppo
from agents.train_sac import make_sac
from ddagr_gym.config import dump_config, find_config, load_config, parse_config
from ddagr_gym.errors import InputError

ALGORITHMS: dict[str, MakeModel] = {"ppo": make_ppo, "sac": make_sac}


def load_settings(config: str, overrides: Sequence[str] = ()) -> TrainingSettings:
    """Settings of a name in configs/training or of a YAML file, with ``dotted.name=value`` overrides.

    Raises:
        InputError: unknown name, or content that does not fit.
    """
    file = find_config("training", config)
    settings = load_config(file, TrainingSettings)
    if not overrides:
        return settings
    content = yaml.safe_load(dump_config(settings))
    for override in overrides:
        _set(content, override)
    return parse_config(yaml.safe_dump(content), TrainingSettings, source=f"{file.name} with {', '.join(overrides)}")


def _set(content: dict[str, Any], override: str) -> None:
    path, sign, value = override.partition("=")
    if not sign:
        raise InputError(f"override {override!r}: write it as ppo.learning_rate=3e-4.")
    *parents, last = path.split(".")
    place = content
    for name in parents:
        inner = place.get(name)
        if not isinstance(inner, dict):
            raise InputError(f"override {override!r}: there is no group {name!r} in the settings.")
        place = inner
    try:
        place[last] = yaml.safe_load(value)
    except yaml.YAMLError:
        raise InputError(f"override {override!r}: {value!r} is no value.") from None


def train_one(algorithm: str, config: str, seed: int, output: Path, overrides: Sequence[str] = ()) -> dict[str, Any]:
    """One training of one seed, into ``output/<config>/seed_<seed>``.

    Raises:
        InputError: settings that are not valid, or of the other algorithm.
    """
    settings = load_settings(config, overrides)
    if settings.algorithm != algorithm:
        raise InputError(
            f"{config!r} is a configuration of {settings.algorithm}: use `ddagr train {settings.algorithm}`."
        )
    return train(ALGORITHMS[algorithm], settings, seed, training_folder(output, config, seed))


def training_folder(output: Path, config: str, seed: int) -> Path:
    """Where a training's files go."""
    return output / Path(config).stem / f"seed_{seed}"
