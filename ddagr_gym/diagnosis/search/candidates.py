"""Which probes of the library are tried together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ddagr_gym.identification.size_prior import size_scale
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.base import DriveExtent


@dataclass(frozen=True, eq=False)
class Candidate:
    """Probes of one effect that are tried together.

    Attributes:
        name: of the effect.
        columns: (k,) their places among all probes.
        probes: (k,) the effects themselves.
        one_sided: (k,) whether only positive multiples exist.
        scales: (k,) standard deviation of each multiple before any data, see
            :mod:`ddagr_gym.identification.size_prior`.
        whole: multiple of the only probe at which a categorical effect has its full size; None for others.
    """

    name: str
    columns: tuple[int, ...]
    probes: tuple[Effect, ...]
    one_sided: tuple[bool, ...]
    scales: tuple[float, ...]
    whole: float | None = None

    @property
    def is_direction(self) -> bool:
        """Whether its probes point along the axes of the world."""
        return len(self.probes) > 1 and "direction" in self.probes[0].shape_names()

    @property
    def is_band(self) -> bool:
        """Whether its probes are bands of ground."""
        return bool(self.probes[0].as_mapping()["parameters"].get("half_length", 0.0) > 0.0)

    @property
    def has_sizes(self) -> bool:
        """Whether its multiples are sizes; a flip or a limit keeps the size of its probe whatever its multiple."""
        return self.whole is None and self.probes[0].differentiable

    @property
    def is_limit(self) -> bool:
        """Whether it keeps the size of its probe whatever its multiple, and is no flip."""
        return self.whole is None and not self.probes[0].differentiable


def candidates_of(kind: type[Effect], extent: DriveExtent, first: int) -> list[Candidate]:
    """Candidates of one kind: up to two probes span it; more are grouped by their shapes (place, onset).

    Probes of an effect without a derivative (limits) are candidates of their own.

    Args:
        kind: the effect.
        extent: of the drives.
        first: place of its first probe among all.
    """
    probes = kind.probes(extent)
    if kind.categorical:
        return [
            Candidate(kind.name, (first + k,), (probe,), (True,), (np.inf,), _whole(probe))
            for k, probe in enumerate(probes)
        ]
    if not kind.differentiable:
        groups = [[k] for k in range(len(probes))]
    elif len(probes) <= 2:
        groups = [list(range(len(probes)))]
    else:
        by_shape: dict[tuple[float, ...], list[int]] = {}
        for k, probe in enumerate(probes):
            by_shape.setdefault(tuple(getattr(probe, name) for name in kind.shape_names()), []).append(k)
        groups = list(by_shape.values())
    return [
        Candidate(
            kind.name,
            tuple(first + k for k in group),
            tuple(probes[k] for k in group),
            tuple(_one_sided(probes[k]) for k in group),
            tuple(_scale(probes[k]) for k in group),
        )
        for group in groups
    ]


def moved_field(probe: Effect) -> tuple[str, Mapping[str, Any], float]:
    """Field that a probe moves from neutral, its metadata, and by how much.

    Raises:
        ValueError: it moves none.
    """
    for name in probe.size_names():
        data = probe.parameter(name).metadata
        away = float(getattr(probe, name) - data["neutral"])
        if away != 0.0:
            return name, data, away
    raise ValueError(f"the probe {probe!r} is neutral")


def _one_sided(probe: Effect) -> bool:
    """Whether neutral lies at a bound of the size that the probe moves."""
    _, data, _ = moved_field(probe)
    return bool(data["neutral"] in (data["low"], data["high"]) or not probe.differentiable)


def _scale(probe: Effect) -> float:
    """Standard deviation of a probe's multiple; infinite for an effect without a derivative."""
    name, _, away = moved_field(probe)
    return float(size_scale(probe, name) / abs(away)) if probe.differentiable else np.inf


def _whole(probe: Effect) -> float:
    """Multiple that takes a categorical probe to its bound."""
    _, data, away = moved_field(probe)
    return float((data["high"] - data["neutral"]) / away)
