"""``ddagr train``: learn to turn."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal

import tyro

from ddagr_gym.errors import InputError

EXAMPLES = (
    "ddagr train ppo --config ppo_ekf --seed 0 --output runs",
    "ddagr train ppo --config ppo_raw --set steps=200000 ppo.learning_rate=3e-4",
    "ddagr train ppo --config ppo_ekf --set task.effects=[diagnosis/effects.yaml]",
    "ddagr train ppo --config ppo_ekf --set task.calibration=calibration",
    "ddagr train all --output runs",
)


@dataclass(frozen=True)
class Arguments:
    """Train a policy by reinforcement learning, or all published ones; resumes.

    Needs the checkout, where agents/ and configs/training/ are.

    Attributes:
        what: algorithm of one training, or "all" for every published policy with its record and model card.
        config: name of a file in configs/training, or a YAML file.
        seed: of the training.
        output: folder for checkpoints, TensorBoard, results and policies.
        set: changes of the configuration, as ppo.learning_rate=3e-4.
        publish: with "all", replace the policies in agents/policies by the result.
    """

    what: tyro.conf.Positional[Literal["ppo", "sac", "all"]]
    config: str = "ppo_ekf"
    seed: int = 0
    output: Path = Path("ddagr_training")
    set: tuple[str, ...] = ()
    publish: bool = False


def run(arguments: Arguments) -> None:
    """Train and print what came of it."""
    if arguments.seed < 0:
        raise InputError(f"--seed {arguments.seed}: give 0 or more.")
    if arguments.what == "all":
        _agents("train_all").train_all(arguments.output, write=arguments.publish)
        return
    result = _agents("main").train_one(
        arguments.what, arguments.config, arguments.seed, arguments.output, arguments.set
    )
    described = _agents("run").describe(result["validation"])
    print(f"After {result['steps']} control steps, on the validation set: {described}.")
    print(f"Policy, checkpoint and TensorBoard are in {arguments.output.resolve()}")


def _agents(module: str) -> Any:
    """A module of the checkout's folder agents.

    Raises:
        InputError: it is not on the path: only ``./ddagr`` and an editable install put the checkout there.
    """
    # Other packages own the name `agents` too: only the folder beside this package holds the training.
    folder = Path(__file__).resolve().parents[2] / "agents"
    found = find_spec("agents")
    if found is None or found.origin is None or Path(found.origin).resolve().parent != folder:
        raise InputError("training needs the folder agents/ of the source: clone the repository and run ./ddagr train.")
    return importlib.import_module(f"agents.{module}")
