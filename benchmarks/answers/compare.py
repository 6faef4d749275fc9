"""Compare two files of answers: the same names, completeness and numbers?

    python -m benchmarks.answers.compare BEFORE.json AFTER.json

Both files come from ``run_diagnoses``, made on one machine: other processors round differently. Numbers may differ by
``--tolerance``, relative. What a run took and which version made it are not compared. Exit code 1 where a case differs.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

IGNORED = frozenset({"seconds", "version", "commit", "arguments", "options", "data"})
"""Entries of an answer that say how it was made."""

NEGLIGIBLE = 1e-9
"""Absolute difference that never counts: shares and probabilities that are zero but for rounding."""

SHOWN = 8
"""Differences printed for a case."""


def differences(before: Any, after: Any, tolerance: float, place: str = "") -> Iterator[str]:
    """Places at which two answers differ, with both values.

    Args:
        before: entry of the first file.
        after: entry of the second one.
        tolerance: relative, of numbers.
        place: of the entry in the answer.
    """
    if isinstance(before, dict) and isinstance(after, dict):
        for name in sorted((before.keys() | after.keys()) - IGNORED):
            yield from differences(before.get(name), after.get(name), tolerance, f"{place}/{name}")
    elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for number, pair in enumerate(zip(before, after, strict=True)):
            yield from differences(*pair, tolerance, f"{place}[{number}]")
    elif not _same(before, after, tolerance):
        yield f"{place}: {before!r} -> {after!r}"


def _same(before: Any, after: Any, tolerance: float) -> bool:
    numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in (before, after))
    if numbers:
        return math.isclose(before, after, rel_tol=tolerance, abs_tol=NEGLIGIBLE)
    return bool(before == after)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before", type=Path)
    parser.add_argument("after", type=Path)
    parser.add_argument("--tolerance", type=float, default=1e-6, help="relative difference of numbers that is allowed")
    arguments = parser.parse_args()
    before, after = (json.loads(path.read_text()) for path in (arguments.before, arguments.after))
    different = 0
    for name in sorted(before.keys() | after.keys()):
        found = [f"is in one file only: {name}"]
        if name in before and name in after:
            found = list(differences(before[name], after[name], arguments.tolerance))
        different += bool(found)
        print(f"{name}: {f'{len(found)} differences' if found else 'the same'}")
        print("".join(f"  {line}\n" for line in found[:SHOWN]), end="")
    print(f"{different} of {len(before.keys() | after.keys())} cases differ")
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
