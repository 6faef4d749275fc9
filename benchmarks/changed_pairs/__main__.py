"""What ``ddagr diagnose --before`` says of simulated pairs of drives in which the generator changed something.

    python -m benchmarks.changed_pairs --seed 1 [--limit N] [--kinds single ...]      to develop on
    python -m benchmarks.changed_pairs --draw SECRET                                 a sealed set: its seed, drawn
    python -m benchmarks.changed_pairs --secret SECRET                               answers to it, and their score

Every pair has three drives of 60 s before and one after, of a DDAGR (``--robot``: a Warthog, a Husky) on one field of a
simulator that shares no code with the package and is of another structure (``benchmarks/concealed/README.md``): the
drive after is on another patch of the field, on another day, with other commands. The ground is said to be the same;
the nominal is the data sheet on the thesis's soil. The diagnosis gets the recordings alone.

``--draw`` writes the seed to SECRET, which lies outside the checkout, and its hash to
``benchmarks/results/changed_pairs_commitment.json``, which is committed before the answers are made; ``--secret``
refuses a seed of another hash. Written are the answers' score and a picture (``benchmarks/results/changed_pairs.json``,
``.png``; ``changed_pairs_warthog.json`` of a Warthog); a run goes on after the answers in the folder of parts. Fifty
seconds of a core a pair, 208 pairs in a set.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.changed_pairs.answers import CHECKOUT, RESULT, answers_to, draw_secret, result_of, secret_seed
from benchmarks.changed_pairs.drives import label_of
from benchmarks.changed_pairs.figure import draw
from benchmarks.changed_pairs.plan import plan
from benchmarks.changed_pairs.robots import ROBOTS
from benchmarks.changed_pairs.score import TARGETS, score
from benchmarks.commits import commit_of
from benchmarks.score_concealed import against_targets
from ddagr_gym.errors import InputError
from ddagr_gym.files import write_json


def main(words: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code."""
    given = _parser().parse_args(words)
    try:
        if given.draw is not None:
            draw_secret(given.draw)
            return 0
        seed = given.seed if given.secret is None else secret_seed(given.secret)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    pairs = [p for p in plan(seed, given.robot) if not given.kinds or p.kind in given.kinds][: given.limit]
    answers = answers_to(pairs, seed, given.parts, given.workers, given.cluster)
    if given.answers is not None:
        write_json(given.answers, answers)
    labels = {pair.name: label_of(pair, seed) for pair in pairs}
    figures = score(labels, answers)
    about = {
        "command": "python -m benchmarks.changed_pairs",
        "set": f"development, seed {seed}" if given.secret is None else "sealed",
        "robot": given.robot,
        "seed": seed,
        "commit": commit_of(CHECKOUT),
        "pairs": dict(Counter(pair.kind for pair in pairs)),
    }
    output = given.output or result_of(given.robot)
    write_json(output, {"about": about, "targets": against_targets(figures, TARGETS), **figures})
    draw(figures, output.with_suffix(".png"))
    _print(figures)
    return 0


def _print(figures: dict[str, Any]) -> None:
    aims = against_targets(figures, TARGETS)
    for name, entry in figures.items():
        if isinstance(entry, dict) and entry.get("count"):
            aim = aims.get(name)
            said = (
                "" if aim is None else f", aim {aim['least']:g} to {aim['most']:g}: {'met' if aim['met'] else 'missed'}"
            )
            low, high = entry["interval"]
            print(f"{name}: {entry['value']:.3f} ({low:.3f} to {high:.3f}) of {entry['count']}{said}")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    seed = parser.add_mutually_exclusive_group()
    seed.add_argument("--seed", type=int, default=1, help="of a set to develop on")
    seed.add_argument("--draw", type=Path, help="new file for the seed of a sealed set")
    seed.add_argument("--secret", type=Path, help="file of that seed")
    parser.add_argument("--robot", choices=list(ROBOTS), default="ddagr", help="that drives")
    parser.add_argument("--limit", type=int, help="only the first pairs")
    parser.add_argument("--kinds", nargs="+", help="only pairs of these kinds")
    parser.add_argument("--parts", type=Path, default=RESULT.with_suffix(".parts"), help="folder of finished answers")
    parser.add_argument("--answers", type=Path, help="JSON of all answers, word by word")
    parser.add_argument("--output", type=Path, help="JSON; the picture has the same name")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--cluster", default="", help="a Ray cluster: local, or its address")
    return parser


if __name__ == "__main__":
    sys.exit(main())
