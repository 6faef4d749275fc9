"""One scan of the library on a drive: what each effect would change, and what the drive says of its size.

As the scan of a diagnosis (:mod:`ddagr_gym.diagnosis.search.scan`), but only of probes that mean the same in every
drive, so that drives can be compared.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.change.ordinary import Scores
from ddagr_gym.diagnosis.search.candidates import Candidate, candidates_of, moved_field
from ddagr_gym.diagnosis.search.inner_products import InnerProducts
from ddagr_gym.diagnosis.search.scan import drive_extent, probe_columns
from ddagr_gym.diagnosis.search.sensor_effects import record_drives
from ddagr_gym.identification.effect_parameters import EffectParameter, effect_columns, effect_parameters
from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.identification.least_squares import beside_residual
from ddagr_gym.identification.problem import Problem
from ddagr_gym.physics.effects import DriveExtent, Effect
from ddagr_gym.physics.effects.command_delay import CommandDelay
from ddagr_gym.physics.effects.registry import effect_kinds

Array = NDArray[np.float64]

NOT_COMPARED: Mapping[str, str] = {
    "sensor_hold": "repeated readings are seen in the values themselves, and no size of them is compared",
    "soil_patch": "a place of one drive has no counterpart in others: tried only where a changed soil explains much",
}
"""Effects that have no size which two drives share."""

NAMED = "named "
"""Begins the keys of the fitted parameters of named effects."""

ELSEWHERE = "elsewhere "
"""Begins the keys of what an effect that is present in a part of the drives would do in the rest of them."""

FEWEST_IN_PIECE = 5
"""Windows of a piece of a drive, whose scatter is known from them (ours)."""


def named_in(keys: Sequence[str]) -> list[str]:
    """Those of the parameters of named effects among the keys of columns."""
    return [key for key in keys if key.startswith(NAMED)]


def elsewhere(keys: Sequence[str]) -> tuple[str, ...]:
    """Keys of the same columns in the rest of the drives."""
    return tuple(f"{ELSEWHERE}{key}" for key in keys)


@dataclass(frozen=True, eq=False)
class Compared:
    """A candidate of the library whose probes mean the same in every drive.

    Attributes:
        candidate: the probes.
        keys: (k,) of them.
    """

    candidate: Candidate
    keys: tuple[str, ...]

    @property
    def name(self) -> str:
        """Of the effect."""
        return self.candidate.name

    @property
    def elsewhere(self) -> tuple[str, ...]:
        """(k,) keys of the same in the rest of the drives."""
        return elsewhere(self.keys)

    @property
    def ridge(self) -> Array:
        """(k,) information on the probes' multiples before any data: none exists beyond the reach of its size."""
        return np.array([_least_information(probe) for probe in self.candidate.probes])


def _least_information(probe: Effect) -> float:
    if not probe.differentiable:
        return 0.0
    name, _, away = moved_field(probe)
    return float((away / probe.reach(name)) ** 2)


def _of_any_drive(kind: type[Effect]) -> list[Effect]:
    """Probes that every drive has: those of two drives that differ in all respects."""
    one = DriveExtent()
    other = DriveExtent(0.717 * one.duration, (-9.0, -1.0), (-8.0, -2.0), 0.7, 1.3, 0.3, 170.0)
    return [probe for probe in kind.probes(one) if probe in kind.probes(other)]


def _compared(candidate: Candidate, number: int, usual: Sequence[Effect]) -> Compared | None:
    """A candidate with its keys; None for one whose probes belong to the drive: to a time of it, or to its speeds."""
    if candidate.has_sizes and not all(probe in usual for probe in candidate.probes):
        return None
    keys = tuple(f"{candidate.name} {number + k}" for k in range(len(candidate.probes)))
    return Compared(candidate, keys)


def library(problem: Problem, fitted: Fitted) -> tuple[Compared, ...]:
    """Candidates of all effects that are compared, but for those that the fit has.

    Args:
        problem: what was fitted.
        fitted: with or without effects.
    """
    extent = drive_extent(problem, fitted.prediction)
    assumed = {effect.name for effect in fitted.point.effects}
    apart = problem.blocked.windows.frames_apart
    found: list[Compared] = []
    for name, kind in effect_kinds().items():
        if name in NOT_COMPARED or name in assumed or (kind.needs_one_frame and apart):
            continue
        number, usual = 0, _of_any_drive(kind)
        for candidate in candidates_of(kind, extent, 0):
            item = _compared(candidate, number, usual)
            number += len(candidate.probes)
            found += [] if item is None else [item]
    return tuple(found)


@dataclass(frozen=True, eq=False)
class Priors:
    """Of what may differ between drives, other than those of a fit.

    Attributes:
        deviations: (P,) standard deviations.
        middle: (P,) from where the fit's priors have theirs.
    """

    deviations: Array
    middle: Array


@dataclass(frozen=True, eq=False)
class DriveScan:
    """Scan of drives at a fit.

    Attributes:
        compared: candidates.
        keys: (K,) of the columns: parameters of the fit's effects, probes, then those of both elsewhere, where an
            effect is present in a part of the drives.
        products: inner products by window of residual, what may differ between drives, and these columns.
        free: (P,) indices of the fit's parameters among those of the problem.
    """

    compared: tuple[Compared, ...]
    keys: tuple[str, ...]
    products: InnerProducts
    free: NDArray[np.int64]

    def pieces(self, most: int) -> tuple[DriveScan, ...]:
        """The same of parts of equal length, at most so many, of :data:`FEWEST_IN_PIECE` windows at least."""
        count = len(self.products.normals)
        ends = np.linspace(0, count, min(most, max(count // FEWEST_IN_PIECE, 1)) + 1).round().astype(np.int64)
        products = self.products
        return tuple(
            replace(self, products=InnerProducts(products.normals[a:b], products.precision, products.values))
            for a, b in pairwise(ends.tolist())
        )

    def parted(self, present: NDArray[np.bool_]) -> DriveScan:
        """The same with every candidate in some windows, and elsewhere in the others.

        Args:
            present: (W,) windows in which it is.
        """
        first = 1 + self.products.nuisances
        probes = [first + k for item in self.compared for k in map(self.keys.index, item.keys)]
        chosen = [*range(first + len(self.keys)), *probes]
        acts = np.ones((len(present), len(chosen)))
        acts[:, probes] = present[:, None]
        acts[:, first + len(self.keys) :] = ~present[:, None]
        normals = self.products.normals[:, chosen][:, :, chosen] * acts[:, :, None] * acts[:, None, :]
        keys = (*self.keys, *(key for item in self.compared for key in item.elsewhere))
        return replace(self, keys=keys, products=replace(self.products, normals=normals))

    def scores(self, priors: Priors | None = None) -> Scores:
        """Gradient and information of the columns, with their covariances.

        Args:
            priors: of what may differ between drives; those of the fit by default.
        """
        products = self.products
        if priors is not None:
            products = InnerProducts(products.normals, priors.deviations**-2.0, products.values - priors.middle)
        reduced = products.reduced()
        answer = reduced.nuisance[:, 1:]
        # columns without what parameters explain of them
        left = np.concatenate([-answer, np.eye(answer.shape[1])])
        gradients = products.normals[:, 0, 1:] @ left
        informations = left.T @ products.normals[:, 1:, 1:] @ left
        # a parameter that is off by d moves the gradient by answer' precision d
        moved = answer * np.sqrt(products.precision)[:, None]
        between = moved.T @ moved
        within = scattered(gradients)
        return Scores(self.keys, reduced.gradient, reduced.information, within, between, gradients, informations)


def scattered(gradients: Array) -> Array:
    """(K, K) covariance of a sum of gradients (W, K) by the scatter of the windows."""
    count = len(gradients)
    away = gradients - gradients.mean(axis=0)
    return np.asarray(away.T @ away * count / (count - 1))


def with_dead_time_of_robot(
    problem: Problem, fitted: Fitted, probes: Sequence[Effect], columns: Sequence[Array]
) -> list[Array]:
    """Columns of probes, those of later commands by the robot's own dead time where the fit may move it.

    A dead time as an effect and that of the robot are one quantity, but its derivative jumps where it ends at a sample.
    By different finite differences a scan would tell one from the other, and know what nobody can.

    Args:
        problem: what was fitted.
        fitted: the model.
        probes: effects at a size.
        columns: (W, M) change of the block means by each.
    """
    parameters, free = problem.nuisances.parameters, problem.open_at(fitted.point).tolist()
    own = [k for k in free if parameters[k].name == CommandDelay.name]
    found = {(probe.delay, probe.imbalance): k for k, probe in enumerate(probes) if isinstance(probe, CommandDelay)}
    made = list(columns)
    for (delay, imbalance), k in found.items() if own else ():
        # a bank alone: both, and half of what it differs by from the other one
        apart = columns[k] - columns[found[delay, -imbalance]]
        made[k] = delay * fitted.by_parameter[..., own[0]] + 0.5 * apart
    return made


def scan_drive(problem: Problem, fitted: Fitted) -> DriveScan:
    """Scan the library at a fit; parameters of its effects are columns of their own.

    Args:
        problem: what was fitted.
        fitted: with or without effects.
    """
    compared = library(problem, fitted)
    drives = record_drives(problem, fitted.point)
    named = effect_parameters(fitted.point.effects)
    probes = [probe for item in compared for probe in item.candidate.probes]
    present = {effect.name for effect in fitted.point.effects}
    everywhere = problem.during({name: spell for name, spell in problem.spells.items() if name in present})
    columns = list(probe_columns(everywhere, fitted, probes, drives))
    columns = with_dead_time_of_robot(problem, fitted, probes, columns)
    by_effect = effect_columns(problem, fitted.point, named)
    by_key = dict(zip((key for item in compared for key in item.keys), columns, strict=True))
    by_key |= _in_parts(problem, compared, by_key) | _named_elsewhere(problem, fitted, named)
    free = problem.open_at(fitted.point)
    residual = problem.residual(fitted.point, fitted.prediction)
    raw = beside_residual(residual, fitted.by_parameter[..., free], by_effect, np.stack([*by_key.values()], axis=2))
    projected = fitted.elimination.project(raw)
    products = InnerProducts(
        np.matmul(projected.transpose(0, 2, 1), projected), problem.prior[free] ** -2.0, fitted.point.values[free]
    )
    keys = (*(f"{NAMED}{k}" for k in range(len(named))), *by_key)
    return DriveScan(compared, keys, products, free)


def _in_parts(problem: Problem, compared: Sequence[Compared], columns: Mapping[str, Array]) -> dict[str, Array]:
    """Columns of what is sought in a part of the drives: there, and elsewhere."""
    found: dict[str, Array] = {}
    for item in (item for item in compared if item.name in problem.spells):
        present = problem.present(item.name)[:, None]
        found |= {key: np.where(present, columns[key], 0.0) for key in item.keys}
        pairs = zip(item.elsewhere, item.keys, strict=True)
        found |= {away: np.where(present, 0.0, columns[key]) for away, key in pairs}
    return found


def _named_elsewhere(problem: Problem, fitted: Fitted, named: Sequence[EffectParameter]) -> dict[str, Array]:
    """Columns of the sizes of named effects, by unit, in the windows in which these are absent."""
    found: dict[str, Array] = {}
    for k, item in enumerate(named):
        effects = fitted.point.effects
        effect = effects[item.effect]
        if effect.name not in problem.spells:
            continue
        probe = _of_one_size(effect, item.field, drive_extent(problem, fitted.prediction))
        if probe is None:
            continue
        spell = problem.spells[effect.name]
        rest = problem.during({**problem.spells, effect.name: replace(spell, ends=not spell.ends)})
        # where an effect is absent, the model with it is the one without
        beside = replace(fitted.point, effects=(*effects[: item.effect], *effects[item.effect + 1 :]))
        (column,) = probe_columns(rest, replace(fitted, point=beside), [probe])
        found[f"{ELSEWHERE}{NAMED}{k}"] = column / moved_field(probe)[2]
    return found


def _of_one_size(effect: Effect, field: str, extent: DriveExtent) -> Effect | None:
    """An effect with one of its sizes, as large as the library tries it; None for a field that is no such size."""
    if not effect.differentiable:
        return None
    tried = {name: away for name, _, away in map(moved_field, effect.probes(extent))}
    if field not in tried:
        return None
    sizes = {name: float(effect.parameter(name).metadata["neutral"]) for name in effect.size_names()}
    return effect.with_values(**{**sizes, field: sizes[field] + tried[field]})
