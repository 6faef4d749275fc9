"""Names of several drives, each its own."""

from __future__ import annotations

import itertools
import os
import re
from collections import Counter
from collections.abc import Collection, Sequence
from pathlib import Path

from ddagr_gym.api.inputs import Source


def names_apart(names: Sequence[str], sources: Sequence[Source]) -> list[str]:
    """Names of which those that are alike have as many folders as tell them apart, and what is there again a number.

    Args:
        names: of the drives.
        sources: of each, a path or the recording itself.
    """
    often = Counter(names)
    places = [
        Path(os.path.abspath(item)) if often[name] > 1 and isinstance(item, str | os.PathLike) else None
        for name, item in zip(names, sources, strict=True)
    ]
    alike: dict[str, set[Path]] = {}
    for place in places:
        if place is not None:
            alike.setdefault(place.name, set()).add(place)
    apart = {place: name for found in alike.values() for place, name in _with_folders(found).items()}
    return numbered([name if place is None else apart[place] for name, place in zip(names, places, strict=True)])


def without_number(name: str) -> str:
    """Name of a drive without the number that :func:`names_apart` gave it."""
    return re.sub(r" \(\d+\)$", "", name)


def _with_folders(paths: Collection[Path]) -> dict[Path, str]:
    """Whole paths shortened to as many folders as tell them apart."""
    kept = next(n for n in itertools.count(1) if len({path.parts[-n:] for path in paths}) == len(paths))
    return {path: Path(*path.parts[-kept:]).as_posix() for path in paths}


def numbered(names: Sequence[str], form: str = "{} ({})") -> list[str]:
    """Names of which one that is there again has a number, by which it is like no other.

    Args:
        names: of anything.
        form: of a name and its number.
    """
    taken, found = set(names), list[str]()
    for name in names:
        if name in found:
            name = next(new for n in itertools.count(2) if (new := form.format(name, n)) not in taken)
            taken.add(name)
        found.append(name)
    return found
