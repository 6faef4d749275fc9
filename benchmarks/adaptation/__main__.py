"""What `ddagr adapt` wins back in a truth that only its recordings tell of.

    python -m benchmarks.adaptation [--controller B4] [--field 3] [--truths slope,delay,...] [--turns 12] [--work DIR]

For each truth: three recorded drives of half a minute, the diagnosis, the adaptation, and turns driven in that truth
by three controllers: the nominal one (B6 or B4 with the data sheet), the one adapted to recordings, and one that went
through the same adaptation with the true effect in the library's terms in place of the diagnosis (robot and soil of
the data sheet). All see the same places and noise. Sizes were fixed before the first run. Where a diagnosis says
"unknown", the adapted controller is the nominal one. About 25 minutes of one core; what the folder of work holds is not
made again.
A field is a soil with its places and its sensors' noise. What B6 is given was chosen on field 1, the range of its
gains on field 2; field 3 was first driven when that was settled.
Writes ``benchmarks/results/adaptation.json`` (B4 on field 3), ``adaptation_b6.json`` (B6 on field 3),
``adaptation_b6_first_field.json`` or ``adaptation_b6_second_field.json``, and a picture beside it.

The rule for the controller that `ddagr adapt` adapts by default, written before B4 was driven on field 3: the one that
makes more of the turns there once adapted, all truths together; within 2 % of them, the one with the smaller median
radius error.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

from benchmarks.adaptation.figure import draw
from benchmarks.adaptation.study import run
from benchmarks.adaptation.truths import TRUTHS
from benchmarks.adaptation.won_back import result_of, table
from ddagr_gym.adaptation.run import ADAPTABLE
from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.files import write_json
from ddagr_gym.progress import LinePrinter

_RESULTS = Path(__file__).resolve().parents[1] / "results"
RESULTS = {
    ("B4", 3): _RESULTS / "adaptation.json",
    ("B6", 3): _RESULTS / "adaptation_b6.json",
    ("B6", 1): _RESULTS / "adaptation_b6_first_field.json",
    ("B6", 2): _RESULTS / "adaptation_b6_second_field.json",
}
"""By controller and field."""


def main(words: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--controller", default="B4", choices=ADAPTABLE, help="that is adapted")
    parser.add_argument("--field", type=int, default=3, help="soil with its places and its sensors' noise")
    parser.add_argument("--truths", default=",".join(TRUTHS), help="names, separated by commas")
    parser.add_argument("--turns", type=int, default=12, help="turns of each controller in each truth")
    parser.add_argument("--work", type=Path, default=Path("adaptation_work"), help="folder of what is finished")
    parser.add_argument("--output", type=Path, help="JSON file; the picture lies beside it")
    given = parser.parse_args(words)
    names = [name.strip() for name in given.truths.split(",") if name.strip()]
    try:
        _check(names, given.turns)
        output = _output(given.output, given.controller, given.field)
    except InputError as error:
        parser.error(str(error))
    try:
        found = run(names, given.field, given.controller, given.work, given.turns, LinePrinter("adaptation: "))
    except KeyboardInterrupt:
        print(f"interrupted; the same command goes on from {given.work}.")
        return 130
    result = result_of(found)
    write_json(output, result)
    draw(result, output.with_suffix(".png"))
    print(table(result))
    print(json.dumps(result["won_back"], indent=1))
    return 0


def _output(given: Path | None, controller: str, field: int) -> Path:
    if given is None and (controller, field) not in RESULTS:
        raise InputError(f"no published file is of {controller} on field {field}: name one with --output.")
    return given or RESULTS[controller, field]


def _check(names: Sequence[str], turns: int) -> None:
    for name in names:
        if name not in TRUTHS:
            raise unknown_name("truth", name, TRUTHS)
    if not names:
        raise InputError(f"no truth is named: give some of {', '.join(TRUTHS)}.")
    if turns < 4:
        raise InputError(f"turns is {turns}: give at least 4, two to either side.")


if __name__ == "__main__":
    raise SystemExit(main())
