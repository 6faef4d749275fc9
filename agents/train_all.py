"""Every published training, one after another, and what is published of them. Started again, it goes on.

./ddagr train all --output runs --publish
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from agents.main import ALGORITHMS, load_settings, training_folder
from agents.publish import publish
from agents.run import describe, train

PUBLISHED = (
    "ppo_ekf",
    "ppo_raw",
    "ppo_history",
    "ppo_ekf_fixed",
    "ppo_ekf_absolute",
    "sac_ekf",
    "ppo_path",
    "ppo_path_wide",
    "ppo_path_absolute",
)
"""Configurations in the order in which they are trained; the headline arm first."""


def train_all(output: Path, *, publish_to: Path | None = None, write: bool = False) -> None:
    """Train every seed of every published configuration.

    Args:
        output: folder of the trainings.
        publish_to: folder of the policies; that of the checkout by default.
        write: whether to write there.
    """
    for name in PUBLISHED:
        results = train_seeds(name, output)
        if write:
            publish_arm(name, results, output, publish_to)


def train_seeds(name: str, output: Path) -> list[dict[str, Any]]:
    """Results of all seeds of a configuration, trained where they are not."""
    settings = load_settings(name)
    results = []
    for seed in range(settings.seeds):
        result = train(ALGORITHMS[settings.algorithm], settings, seed, training_folder(output, name, seed))
        found = result["validation"]
        print(f"{Path(name).stem} seed {seed}: {describe(found)}", file=sys.stderr)
        results.append(result)
    return results


def publish_arm(name: str, results: list[dict[str, Any]], output: Path, target: Path | None) -> None:
    """Write the policy that the validation set selects, its record and its card."""
    from ddagr_gym.policies.shipped import policies_dir

    folder = policies_dir() if target is None else target
    publish(Path(name).stem, load_settings(name), results, output, folder / Path(name).stem)
