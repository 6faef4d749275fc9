"""What drives say of every effect, as JSON has it, and how probable that is of an ordinary drive."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.pair_scatter import rounded
from ddagr_gym.diagnosis.change.between_drives import Away
from ddagr_gym.diagnosis.change.drive_scan import Compared
from ddagr_gym.diagnosis.change.ordinary import Comparison, Scores
from ddagr_gym.diagnosis.change.shifts import Pull, probability_of
from ddagr_gym.diagnosis.change.sizes import Sizes, sizes_of
from ddagr_gym.diagnosis.result.detectable import least_multiple

Array = NDArray[np.float64]

DIGITS = 4
"""Of the sizes that are written."""


def written_effects(compared: Iterable[Compared], drives: Sequence[Scores]) -> list[dict[str, Any]]:
    """Sizes of every candidate in several drives, in least sizes that matter; none of which one drive shows nothing.

    Args:
        compared: candidates.
        drives: scores, those of the drive that is compared first.
    """
    effects = []
    for item in compared:
        found = [sizes_of(drive, item.keys, item.ridge) for drive in drives]
        sizes = [one for one in found if one is not None]
        if len(sizes) == len(found):
            least = np.array([least_multiple(item.candidate, k) for k in range(len(item.keys))])
            written = [_written(one, least) for one in sizes]
            effects.append({"effect": item.name, "has_sizes": item.candidate.has_sizes, "drives": written})
    return effects


def _written(sizes: Sizes, least: Array) -> dict[str, Any]:
    square = np.outer(least, least)
    return {
        "value": rounded(sizes.value / least, DIGITS),
        "within": [rounded(row, DIGITS) for row in sizes.within / square],
        "between": [rounded(row, DIGITS) for row in sizes.between / square],
        "windows": sizes.windows,
    }


def written_sizes(mapping: Mapping[str, Any], windows: float = 0.0) -> Sizes:
    """Sizes of a drive that were written.

    Args:
        mapping: one of the drives of :func:`written_effects`.
        windows: how many are taken to tell the covariance within the drive.
    """
    return Sizes(*(np.array(mapping[name]) for name in ("value", "within", "between")), windows)


def probabilities(
    scan: Mapping[str, Any], away: Callable[[Mapping[str, Any]], Away], against: Comparison
) -> dict[str, float]:
    """Of an ordinary drive to show as much: of each effect's worst candidate, and of each parameter.

    Args:
        scan: with the ``effects`` of :func:`written_effects`, and by how far each drive ``moved`` every parameter.
        away: the sizes of one of the effects against those of ordinary drives.
        against: by how far these move parameters.
    """
    found: dict[str, float] = {}
    for item in scan["effects"]:
        sizes = away(item)
        own = probability_of(item["has_sizes"], sizes.value, sizes.covariance, sizes.degrees)
        found[item["effect"]] = min(own, found.get(item["effect"], 1.0))
    for name, moved in scan["moved"][0].items():
        found[name] = Pull(name, moved / against.usual_move(name), against.move_degrees).probability
    return found
