"""Rates over several sealed sets together: a target that one set meets or misses by a case says little by itself.

    python -m benchmarks.concealed_sets RESULTS/concealed_{fifth,sixth,seventh,eighth,ninth,tenth}.json \\
        RESULTS/concealed.json

with benchmarks/results for RESULTS.

The sets were answered by different versions of the diagnosis, which ``about`` names. From the seventh set on a single
effect counts as detectable by the sizes that show before anything is named, whatever was named then.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.concealed_figure import WORDS
from benchmarks.score_concealed import TARGETS, against_targets, figure_line, share
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

RESULT = Path(__file__).resolve().parent / "results" / "concealed_sets.json"

RATES = tuple(name for name in TARGETS if name != "gain_share")
"""Figures that count cases; a mean over cases cannot be put together from its value."""


def pooled(sets: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Rates over all cases of several scored sets, against the same targets.

    Args:
        sets: as :mod:`benchmarks.score_concealed` writes them.
    """
    found: dict[str, Any] = {}
    for name in RATES:
        counts = [entry[name]["count"] for entry in sets]
        hits = sum(round(entry[name]["value"] * entry[name]["count"]) for entry in sets if entry[name]["count"])
        found[name] = share([number < hits for number in range(sum(counts))])
    targets = against_targets({**found, "gain_share": {"value": None}})
    commits = [entry["about"]["commits"] for entry in sets]
    each = [{name: entry[name] for name in RATES} for entry in sets]
    return {**found, "targets": {name: targets[name] for name in RATES}, "sets": each, "about": {"commits": commits}}


def known(result: Mapping[str, Any]) -> list[str]:
    """Rates of which there are cases."""
    return [name for name in RATES if result[name]["count"]]


def draw(result: Mapping[str, Any], path: Path) -> None:
    """Write the picture as PNG, all or nothing.

    Args:
        result: of :func:`pooled`.
        path: where.
    """
    with house_style():
        from matplotlib.figure import Figure

        names = known(result)
        figure = Figure(figsize=(8.0, 0.9 + 0.62 * len(names)), layout="constrained")
        panel = figure.subplots()
        for y, name in enumerate(names):
            aim = result["targets"][name]
            panel.barh(y, aim["most"] - aim["least"], left=aim["least"], height=0.66, color=palette.SKY_BLUE, alpha=0.3)
            rows = [(entry[name], palette.GREY, 2.5) for entry in result["sets"] if entry[name]["count"]]
            rows.append((result[name], palette.GREEN if aim["met"] else palette.VERMILLION, 6.0))
            for number, (entry, colour, size) in enumerate(rows):
                at = y + 0.66 * ((number + 0.5) / len(rows) - 0.5)
                panel.plot(entry["interval"], [at, at], color=colour, lw=1.4)
                panel.plot(entry["value"], at, "o", color=colour, ms=size)
        words = [f"{WORDS[name]}\n{100.0 * result[name]['value']:.0f} % of {result[name]['count']}" for name in names]
        panel.set_yticks(range(len(names)), words)
        panel.set_ylim(len(names) - 0.4, -0.6)
        panel.set_xlim(-0.02, 1.02)
        panel.set_xlabel("share, 95 % interval; small: each set in its order, large: together; blue: the aim")
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=110))


def main(words: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("scores", type=Path, nargs="+", help="scores of sealed sets, in their order")
    parser.add_argument("--output", type=Path, default=RESULT)
    arguments = parser.parse_args(words)
    missing = [path for path in arguments.scores if not path.is_file()]
    if missing:
        print(f"error: {missing[0]} is no file: score a set with benchmarks.score_concealed first.", file=sys.stderr)
        return 2
    result = pooled([json.loads(path.read_text()) for path in arguments.scores])
    write_atomically(arguments.output, lambda to: to.write_text(json.dumps(result, indent=1) + "\n"))
    draw(result, arguments.output.with_suffix(".png"))
    for name in known(result):
        met = "met" if result["targets"][name]["met"] else "missed"
        print(f"{figure_line(name, result[name])}  {met}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
