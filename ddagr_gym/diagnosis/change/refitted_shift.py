"""Sizes of an effect as a refit with it finds them, against ordinary drives.

A change of many deviations lies where losses are linear: a first step from the fit without the effect goes part of the
way only.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.change.between_drives import degrees_of_freedom
from ddagr_gym.diagnosis.change.contrasts import contrast_sizes
from ddagr_gym.diagnosis.change.drive_scan import elsewhere, named_in
from ddagr_gym.diagnosis.change.ordinary import Scores
from ddagr_gym.diagnosis.change.shifts import Shift, probability_of
from ddagr_gym.diagnosis.change.sizes import Sizes, sizes_of
from ddagr_gym.diagnosis.search.candidates import moved_field
from ddagr_gym.physics.effects import Effect

Array = NDArray[np.float64]

_NOTHING = 1e-9
"""Multiples of probes, and shares of a bound, that are none."""


def refitted_shift(
    shift: Shift, effect: Effect, keys: Mapping[str, str], scores: Scores, stretched: bool = False
) -> Shift | None:
    """The shift of an effect as a refit with it finds it.

    The size is that of the refit and one step further without the prior of likely sizes. None where its probes are not
    sizes of their own, and where the refit ran to the bound of what exists: that it found no end says no size. What was
    against the rest of a drive, and is not known there beside the refit, is nothing that ordinary drives do not show.

    Args:
        shift: before the refit, with what ordinary drives show.
        effect: as it was fitted.
        keys: of the columns of its fields, by field.
        scores: of the drive at the refit.
        stretched: whether sizes in ordinary drives, which are first steps too, are taken to scatter more by as much as
            the refit goes farther than the first step, and known no better than few drives tell.
    """
    names, away = _fields_of_its_own(shift)
    if not names or not set(names) <= keys.keys() or any(_at_bound(effect, name) for name in names):
        return None
    further = further_sizes(scores, [keys[name] for name in names], shift.apart)
    if further is None:
        return replace(shift, probability=1.0) if shift.apart else None
    size = _multiples(effect, names, away) + further.value / away
    value = size - shift.mean
    farther = _farther(shift, size) if stretched else 1.0
    between = farther**2 * shift.between
    covariance = further.within / np.outer(away, away) + between
    degrees = shift.few
    if not (stretched or shift.apart):
        degrees = degrees_of_freedom(covariance, between, shift.drives, further.windows)
    probability = probability_of(True, value, covariance, degrees)
    return replace(shift, value=value, covariance=covariance, degrees=degrees, probability=probability)


def further_sizes(scores: Scores, keys: Sequence[str], apart: bool) -> Sizes | None:
    """How much further a drive moves sizes of a named effect; None where it shows nothing of them.

    Args:
        scores: at the fit with the effect.
        keys: (k,) of the columns of the sizes.
        apart: whether they are taken against those in the rest of the drive, as far as these have columns.
    """
    others, nothing = [key for key in named_in(scores.keys) if key not in keys], np.zeros(len(keys))
    if not apart or not set(elsewhere(keys)) <= set(scores.keys):
        return sizes_of(scores, keys, nothing, others)
    found = contrast_sizes(scores, keys, nothing, [*others, *(key for key in elsewhere(others) if key in scores.keys)])
    return None if found is None else found.sizes


def times_farther(shift: Shift, effect: Effect) -> float:
    """How many times as far as its first step an effect goes in a refit: at least 1, and 1 where that has no meaning.

    Args:
        shift: before the refit.
        effect: as it was fitted.
    """
    names, away = _fields_of_its_own(shift)
    return _farther(shift, _multiples(effect, names, away)) if names else 1.0


def _fields_of_its_own(shift: Shift) -> tuple[list[str], Array]:
    """(k,) field that each probe moves, and by how much; none where the probes are not sizes of their own."""
    candidate = shift.compared.candidate
    moved = [moved_field(probe) for probe in candidate.probes] if candidate.has_sizes else []
    names = [name for name, _, _ in moved]
    alone = not candidate.is_direction and len(set(names)) == len(names)
    return (names if alone else []), np.array([step for _, _, step in moved])


def _at_bound(effect: Effect, name: str) -> bool:
    """Whether a field stands at the bound of what exists, but for a bound at which it is neutral."""
    data, value = effect.parameter(name).metadata, float(getattr(effect, name))
    bounds = [bound for bound in (data["low"], data["high"]) if bound != data["neutral"]]
    return any(math.isclose(value, bound, rel_tol=_NOTHING) for bound in bounds)


def _multiples(effect: Effect, names: Sequence[str], away: Array) -> Array:
    """(k,) sizes of an effect as multiples of probes that move these fields so far."""
    here = [float(getattr(effect, name)) - effect.parameter(name).metadata["neutral"] for name in names]
    return np.asarray(here) / away


def _farther(shift: Shift, size: Array) -> float:
    """How many times as far as the first step sizes are, at least 1."""
    first = float(np.linalg.norm(shift.value + shift.mean))
    return max(1.0, float(np.linalg.norm(size)) / max(first, _NOTHING))
