"""``python -m benchmarks.drivetrain [--recordings FOLDER] [--output FILE] [--figures FOLDER]``.

It takes half an hour on a busy machine with two cores.

With ``--only-figures`` the figures are drawn from the file that is there.
"""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path

from benchmarks.drivetrain.figures import draw_figures
from benchmarks.drivetrain.study import run_study
from ddagr_gym import __version__
from ddagr_gym.commands.output import write_text

REPOSITORY = Path(__file__).resolve().parents[2]


def main(arguments: list[str] | None = None) -> None:
    """Run the study, write its file and draw its figures."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.drivetrain", description=__doc__)
    parser.add_argument("--recordings", default="", help="folder with open/ and concealed/")
    parser.add_argument("--output", type=Path, default=REPOSITORY / "benchmarks" / "results" / "drivetrain_study.json")
    parser.add_argument("--figures", type=Path, default=REPOSITORY / "docs" / "theory" / "figures")
    parser.add_argument("--only-figures", action="store_true", help="draw from the file that is there")
    options = parser.parse_args(arguments)
    if not options.only_figures:
        folder = options.recordings or os.environ.get("DDAGR_RECORDINGS") or REPOSITORY.parent / "shared" / "recordings"
        document = {"version": __version__, **run_study(Path(folder), lambda line: print(line, flush=True))}
        write_text(options.output, json.dumps(document, indent=1) + "\n")
    draw_figures(json.loads(options.output.read_text(encoding="utf-8")), options.figures)


if __name__ == "__main__":
    main()
