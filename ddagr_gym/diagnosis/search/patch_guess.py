"""Where the refit of a patch of soil starts: a disc does not turn into a band, nor a band far round, in small steps."""

from __future__ import annotations

from ddagr_gym.diagnosis.search.gains import best_multiples
from ddagr_gym.diagnosis.search.initial_guess import first_guess
from ddagr_gym.diagnosis.search.inner_products import Terms
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.soil_patch import SoilPatch

_BANDS = 2
"""Bands that are refitted, of different bearings (ours: in five development cases, scanned with a probe for each size,
one of the first two ended within a tenth of the best of all four)."""


def patch_guesses(terms: Terms) -> list[Effect]:
    """The disc that a scan gives most gain, and the bands of the bearings that it gives most.

    Args:
        terms: of the scan.
    """
    reduced = terms.reduced()
    best: dict[tuple[float, float], tuple[float, Effect]] = {}
    for candidate in terms.candidates:
        probe = candidate.probes[0]
        if isinstance(probe, SoilPatch):
            gain, multiples = best_multiples(reduced, candidate)
            form = (probe.half_length, probe.bearing)
            if form not in best or gain > best[form][0]:
                best[form] = (gain, first_guess(candidate, multiples.tolist()))
    discs = [item for (half_length, _), item in best.items() if half_length == 0.0]
    bands = [item for (half_length, _), item in best.items() if half_length > 0.0]
    return [effect for _, effect in (*discs, *sorted(bands, key=lambda item: -item[0])[:_BANDS])]
