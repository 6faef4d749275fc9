"""Effects that are present in a part of the drives only, in the scan of the library at a fit.

A column c of a probe is that of an effect which holds all along. Of one that begins at a time the windows before have
none of it, of one that ends the windows after. Inner products by window give the gain of every candidate for every time
between windows without another simulation.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.mid_drive.change_in_time import FEWEST_ASIDE
from ddagr_gym.diagnosis.search.candidates import Candidate
from ddagr_gym.diagnosis.search.gains import best_multiples
from ddagr_gym.diagnosis.search.inner_products import InnerProducts, Reduced
from ddagr_gym.identification.least_squares import explained_by
from ddagr_gym.identification.spells import Spell
from ddagr_gym.identification.windows import WindowSet

Array = NDArray[np.float64]


LEAST_EVIDENCE = 8.0
"""Fall of the cost over the dispersion that a part of the drives must explain more than all of them (ours)."""

ALIKE = 0.6
"""Share of the largest gain in a part of the drives from which another effect is tried in one too (ours: refits differ
from first steps by a fifth)."""

_FIRST_STEP = 0.5
"""Share of a refit's gain that a scan finds at least (ours)."""


def spells_that_hold(
    spells: Mapping[str, Spell], names: Container[str], fall: float, dispersion: float
) -> dict[str, Spell]:
    """Parts of the drives that a second naming keeps; none where it does not explain enough more than the first.

    Args:
        spells: that it was made with, by effect.
        names: of its effects.
        fall: of the cost from the first naming to the second.
        dispersion: of the second.
    """
    if not fall > LEAST_EVIDENCE * dispersion:
        return {}
    return {name: spell for name, spell in spells.items() if name in names}


@dataclass(frozen=True)
class SpellGain:
    """What an effect explains that is present in a part of the drives.

    Attributes:
        name: of the effect.
        spell: the part.
        gain: fall of the cost over the dispersion.
        constant: that of the same effect all along the drives.
    """

    name: str
    spell: Spell
    gain: float
    constant: float


def spell_gains(
    products: InnerProducts,
    candidates: Sequence[tuple[Candidate, Sequence[int]]],
    windows: WindowSet,
    dispersion: float,
) -> list[SpellGain]:
    """The best part of the drives for each effect, the largest gain first.

    Args:
        products: by window, of residual, nuisances and columns.
        candidates: with the places of their probes among the columns.
        windows: of the products.
        dispersion: variance of the weighted residuals.
    """
    constant = _gains(products, candidates, np.ones(windows.count, dtype=bool), dispersion)
    best: dict[str, SpellGain] = {}
    for spell in _spells(windows):
        for name, gain in _gains(products, candidates, spell.in_windows(windows), dispersion).items():
            if name not in best or gain > best[name].gain:
                best[name] = SpellGain(name, spell, gain, constant[name])
    return sorted(best.values(), key=lambda item: -item.gain)


def parts_tried(windows: WindowSet) -> int:
    """Number of parts of drives in which an effect is tried; at least 1."""
    return max(sum(1 for _ in _spells(windows)), 1)


def _spells(windows: WindowSet) -> Iterator[Spell]:
    """Parts from or up to the start of each window, enough windows on both sides."""
    for number in np.unique(windows.recording):
        start = np.sort(windows.time[windows.recording == number])
        for time in start[FEWEST_ASIDE : len(start) - FEWEST_ASIDE + 1].tolist():
            yield Spell(int(number), time)
            yield Spell(int(number), time, ends=True)


def _gains(
    products: InnerProducts,
    candidates: Sequence[tuple[Candidate, Sequence[int]]],
    present: NDArray[np.bool_],
    dispersion: float,
) -> dict[str, float]:
    """Gain of the best candidate of each effect that is present in some windows."""
    reduced = _reduced(products, present)
    found: dict[str, float] = {}
    for candidate, columns in candidates:
        index = np.asarray(columns)
        own = Reduced(
            reduced.gradient[index], reduced.information[np.ix_(index, index)], reduced.nuisance[:, [0, *(1 + index)]]
        )
        gain = best_multiples(own, _alone(candidate), dispersion)[0]
        found[candidate.name] = max(found.get(candidate.name, 0.0), gain)
    return found


def _alone(candidate: Candidate) -> Candidate:
    """The candidate with its probes as the only columns."""
    return replace(candidate, columns=tuple(range(len(candidate.probes))))


def _reduced(products: InnerProducts, present: NDArray[np.bool_]) -> Reduced:
    """As :meth:`InnerProducts.reduced`, with columns that are nothing in the other windows."""
    p, normals = products.nuisances, products.normals
    whole, part = normals[:, : 1 + p, : 1 + p].sum(axis=0), normals[present].sum(axis=0)
    right = np.concatenate([whole[1:, :1], part[1 : 1 + p, 1 + p :]], axis=1)
    right[:, 0] -= products.precision * products.values
    answer = explained_by(whole[1:, 1:], products.precision, right, products.ridge)
    cross = part[1 + p :, 1 : 1 + p]
    return Reduced(part[1 + p :, 0] - cross @ answer[:, 0], part[1 + p :, 1 + p :] - cross @ answer[:, 1:], answer)


def best_spells(
    products: InnerProducts,
    candidates: Sequence[tuple[Candidate, Sequence[int]]],
    windows: WindowSet,
    dispersion: float,
    explained: float,
) -> dict[str, Spell]:
    """The effects that explain most where they are in a part of the drives, about alike; empty where none is to try.

    That something began is known before what it was: an effect that may begin at any time is freer than one that may
    not.

    Args:
        products: see :func:`spell_gains`, and the next ones.
        candidates: see there.
        windows: see there.
        dispersion: see there.
        explained: fall of the cost over the dispersion by the names that were found.
    """
    found = [item for item in spell_gains(products, candidates, windows, dispersion) if _is_worth(item, explained)]
    return {item.name: item.spell for item in found if item.gain >= ALIKE * found[0].gain}


def _is_worth(found: SpellGain, explained: float) -> bool:
    """Whether a search with an effect in a part of the drives may beat one without, which alone decides."""
    return found.gain > found.constant + LEAST_EVIDENCE and found.gain > _FIRST_STEP * explained
