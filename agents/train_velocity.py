"""Train the learned estimators of the body's velocity and place, and publish them.

    python -m agents.train_velocity --output runs/velocity [--estimators correction,alone,features] [--publish]
    python -m agents.train_velocity --output runs/pose --estimators pose --workers 16 --device cuda [--publish]
    python -m agents.train_velocity --output runs/pose_wide --estimators pose_wide --workers 2 [--publish]

Drives the turns (see ``agents/velocity_drives.py``) and trains a network for each estimator; those of the first line
learn from the same turns. The one of the second line learns from 15 540 turns, for which a GPU takes two minutes and a
CPU core some hours. That of the third line learns on from it, within the hour on two cores. An interrupted run goes on
where it was: turns are kept in parts of 50, trainings after every pass. With --publish
the networks, records, pictures and cards go to agents/estimators. Same settings, same numbers on the same device.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import torch

from agents.velocity_card import publish_estimator
from agents.velocity_drives import NOMINAL, WIDE, Drives, Plan, joined_drives, make_drives
from agents.velocity_training import VARIANTS, VelocitySettings, VelocityTraining
from ddagr_gym.errors import InputError, at_least, unknown_name
from ddagr_gym.estimation.learned_network import save_network

PUBLISHED = Path(__file__).parent / "estimators"
QUICK = ("correction", "alone", "features")
"""Estimators that a CPU core trains in minutes."""
CHANGEABLE = ("turns", "near", "wide", "validation", "epochs", "units", "layers", "batch", "seed")
"""Settings with an option of their own."""


def learnt_and_judged(settings: VelocitySettings, output: Path, workers: int) -> tuple[Drives, Drives]:
    """Turns that a training learns from, and those that judge it.

    Args:
        settings: of the training.
        output: folder of the turns.
        workers: processes that drive.
    """
    seed = settings.root_seed
    drives = make_drives(settings.turns + settings.validation, seed, output / f"drives_{seed}", workers=workers)
    learnt, judged = [drives.part(slice(settings.turns))], [drives.part(slice(settings.turns, None))]
    if settings.near:
        learnt.append(make_drives(settings.near, seed + 1, output / f"drives_{seed + 1}", NOMINAL, workers))
    if settings.wide:
        count = settings.wide + settings.validation
        wide = make_drives(count, seed + 2, output / f"drives_{seed + 2}", WIDE, workers)
        learnt.append(wide.part(slice(settings.wide)))
        judged.append(wide.part(slice(settings.wide, None)))
    return joined_drives(learnt), joined_drives(judged)


def train_estimators(
    chosen: Mapping[str, VelocitySettings], output: Path, published: Path | None, workers: int = 1, device: str = "cpu"
) -> None:
    """Train every chosen estimator into a folder of its own in ``output``, and write what is published of it.

    Args:
        chosen: settings by name, of VARIANTS.
        output: folder of turns and trainings.
        published: folder of the published estimators; None to publish nothing.
        workers: processes that drive.
        device: of torch.
    """
    drives: dict[VelocitySettings, tuple[Drives, Drives]] = {}
    for name, settings in chosen.items():
        if settings not in drives:
            drives = {settings: learnt_and_judged(settings, output, workers)}  # the others' turns are not kept
        training = VelocityTraining(name, settings, *drives[settings], output / name, device)
        network = training.run()
        save_network(network, output / name / "network.npz")
        print(f"{name}: {training.course[-1]}, calibration {network.description.calibration}")
        if published is not None:
            publish_estimator(training, network, Plan(), published / name)


def main(words: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, required=True, help="folder of turns and trainings")
    parser.add_argument("--estimators", default=",".join(QUICK), help=f"of {', '.join(VARIANTS)}, separated by commas")
    parser.add_argument("--publish", action="store_true", help="write to agents/estimators")
    parser.add_argument("--workers", type=int, default=1, help="processes that drive, default %(default)s")
    parser.add_argument("--device", choices=("cpu", "cuda"), default="cpu", help="of torch, default %(default)s")
    for name in CHANGEABLE:
        parser.add_argument(f"--{name}", type=int, help="default: the estimator's own")
    given = parser.parse_args(words)
    names = [name.strip() for name in given.estimators.split(",") if name.strip()]
    changes = {name: getattr(given, name) for name in CHANGEABLE if getattr(given, name) is not None}
    try:
        for name in names:
            if name not in VARIANTS:
                raise unknown_name("estimator", name, VARIANTS)
        at_least(workers=(given.workers, 1))
        if given.device == "cuda" and not torch.cuda.is_available():
            raise InputError("torch finds no GPU: leave --device out.")
        chosen = {name: replace(VARIANTS[name].settings, **changes) for name in names}
        train_estimators(chosen, given.output, PUBLISHED if given.publish else None, given.workers, given.device)
    except InputError as error:
        parser.error(str(error))
    except KeyboardInterrupt:
        print(f"interrupted; the same command goes on from {given.output}.")
        return 130
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
