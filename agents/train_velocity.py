"""Train the learned estimators of the body's velocity, and publish them.

    python -m agents.train_velocity --output runs/velocity [--estimators correction,alone,features] [--publish]

Drives the turns (see ``agents/velocity_drives.py``) and trains a network for each estimator on the same turns. An
interrupted run goes on where it was: turns are kept in parts of 50, trainings after every pass. With --publish the
networks, records, pictures and cards go to agents/estimators. Same settings, same numbers.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from agents.velocity_card import publish_estimator
from agents.velocity_drives import Plan, make_drives
from agents.velocity_training import VARIANTS, VelocitySettings, VelocityTraining
from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.estimation.learned_network import save_network

PUBLISHED = Path(__file__).parent / "estimators"


def train_estimators(names: Sequence[str], settings: VelocitySettings, output: Path, published: Path | None) -> None:
    """Train every named estimator into a folder of its own in ``output``, and write what is published of it.

    Args:
        names: of VARIANTS.
        settings: of all.
        output: folder of turns and trainings.
        published: folder of the published estimators; None to publish nothing.
    """
    drives = make_drives(settings.turns + settings.validation, settings.root_seed, output / "drives")
    learnt, judged = drives.part(slice(settings.turns)), drives.part(slice(settings.turns, None))
    for name in names:
        training = VelocityTraining(name, settings, learnt, judged, output / name)
        network = training.run()
        save_network(network, output / name / "network.npz")
        print(f"{name}: {training.course[-1]}, calibration {network.description.calibration}")
        if published is not None:
            publish_estimator(training, network, Plan(), published / name)


def main(words: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, required=True, help="folder of turns and trainings")
    parser.add_argument("--estimators", default=",".join(VARIANTS), help="names, separated by commas")
    parser.add_argument("--publish", action="store_true", help="write to agents/estimators")
    for name in ("turns", "validation", "epochs", "units", "seed"):
        parser.add_argument(
            f"--{name}", type=int, default=getattr(VelocitySettings(), name), help="default %(default)s"
        )
    given = parser.parse_args(words)
    names = [name.strip() for name in given.estimators.split(",") if name.strip()]
    chosen = {name: getattr(given, name) for name in ("turns", "validation", "epochs", "units", "seed")}
    try:
        for name in names:
            if name not in VARIANTS:
                raise unknown_name("estimator", name, VARIANTS)
        train_estimators(
            names, replace(VelocitySettings(), **chosen), given.output, PUBLISHED if given.publish else None
        )
    except InputError as error:
        parser.error(str(error))
    except KeyboardInterrupt:
        print(f"interrupted; the same command goes on from {given.output}.")
        return 130
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
