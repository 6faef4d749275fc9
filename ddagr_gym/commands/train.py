"""``ddagr train``: learn to turn."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from ddagr_gym.commands.output import format_table
from ddagr_gym.errors import InputError, at_least
from ddagr_gym.extras import need

EXAMPLES = (
    "ddagr train ppo --config ppo_ekf --seed 0 --output runs",
    "ddagr train ppo --config ppo_raw --set steps=200000 ppo.learning_rate=3e-4",
    "ddagr train ppo --config ppo_ekf --set task.effects=[diagnosis/effects.yaml]",
    "ddagr train ppo --config ppo_ekf --set task.calibration=calibration",
    "ddagr train all --output runs",
    "ddagr train --sweep sweep.yaml --output sweep",
    "ddagr train --sweep sweep.yaml --output sweep --cluster local --workers 4",
)


@dataclass(frozen=True)
class Arguments:
    """Train a policy by reinforcement learning, all published ones, or a sweep; resumes.

    Needs the checkout, where agents/ and configs/training/ are.

    Attributes:
        what: algorithm of one training, or "all" for every published policy with its record and model card; left out
            with a sweep.
        config: name of a file in configs/training, or a YAML file.
        seed: random seed of the training.
        output: folder for checkpoints, TensorBoard, results and policies.
        set: changes of the configuration, as ppo.learning_rate=3e-4.
        publish: with "all", replace the policies in agents/policies by the result.
        sweep: YAML file with configurations and the number of seeds; the output folder gets their trainings, sweep.csv
            and sweep.png.
        workers: for a sweep: trainings at a time, or processors of a local cluster.
        cluster: for a sweep: a Ray cluster to train on with Ray Tune: "local" starts one here, an address
            (ray://HOST:PORT) takes one that runs, whose nodes see the output folder.
    """

    what: tyro.conf.Positional[Literal["ppo", "sac", "all"] | None] = None
    config: str = "ppo_ekf"
    seed: int = 0
    output: Annotated[Path, tyro.conf.arg(aliases=("-o",))] = Path("ddagr_training")
    set: tuple[str, ...] = ()
    publish: bool = False
    sweep: Path | None = None
    workers: int = 2
    cluster: str = ""


def run(arguments: Arguments) -> None:
    """Train and print what came of it."""
    if arguments.seed < 0:
        raise InputError(f"--seed {arguments.seed}: give 0 or more.")
    if arguments.sweep is not None:
        _sweep(arguments, arguments.sweep)
        return
    if arguments.cluster:
        raise InputError("--cluster is for a sweep: leave it out, or give --sweep FILE.")
    if arguments.what is None:
        raise InputError("nothing is named to train: give ppo, sac, all or --sweep FILE.")
    if arguments.what == "all":
        _agents("train_all").train_all(arguments.output, write=arguments.publish)
        return
    result = _agents("main").train_one(
        arguments.what, arguments.config, arguments.seed, arguments.output, arguments.set
    )
    described = _agents("run").describe(result["validation"])
    print(f"After {result['steps']} control steps, on the validation set: {described}.")
    print(f"Policy, checkpoint and TensorBoard are in {arguments.output.resolve()}")


def _sweep(arguments: Arguments, file: Path) -> None:
    """Train a sweep, and print its table."""
    usual = Arguments(output=arguments.output)
    given = [
        name
        for name in ("what", "config", "seed", "set", "publish")
        if getattr(arguments, name) != getattr(usual, name)
    ]
    if given:
        raise InputError(f"{given[0]} is given with --sweep, whose file says what is trained: leave it out.")
    at_least(**{"--workers": (arguments.workers, 1)})
    need("matplotlib", *(("ray",) if arguments.cluster else ()))
    module = _agents("sweep")
    try:
        rows = module.run_sweep(file, arguments.output, arguments.workers, arguments.cluster)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"the same command goes on in {arguments.output}") from None
    print(format_table(_SHOWN, [["" if row[name] is None else row[name] for name in _SHOWN] for row in rows]))
    print(f"\n{module.TABLE}, {module.FIGURE} and the trainings are in {arguments.output.resolve()}")


_SHOWN = ("configuration", "seed", "ended", "steps", "radius_error_median", "success_rate", "mean_return")
"""Columns of the table that are printed."""


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
