"""Sizes of all effects in one drive, in a form that is the same in every drive of a robot.

A comparison looks at several forms of an effect; the first of them is the usual one and is followed over time. Effects
without a size (signs, limits) are there or not and have no series.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.drive_series import PARAMETER, SizePoint
from ddagr_gym.diagnosis.change.model import Model
from ddagr_gym.diagnosis.change.ordinary import Comparison
from ddagr_gym.diagnosis.change.shifts import Shift
from ddagr_gym.diagnosis.change.sizes import sizes_of
from ddagr_gym.diagnosis.search.candidates import Candidate, moved_field
from ddagr_gym.identification.problem import Problem

Array = NDArray[np.float64]


def size_points(problem: Problem, model: Model, ordinary: Comparison) -> tuple[SizePoint, ...]:
    """Shifts of all sizes and parameters of a drive.

    Args:
        problem: of the drive.
        model: of it without effects.
        ordinary: what it was compared with.
    """
    effects = (point for shift in _usual(model) for point in _points_of(shift, ordinary))
    return (*effects, *_parameters(problem, model, ordinary))


def _usual(model: Model) -> Iterator[Shift]:
    """The usual form of every effect that has sizes."""
    known = {shift.compared.keys: shift for shift in model.shifts}
    seen: set[str] = set()
    for item in model.scan.compared:
        if item.keys in known and item.name not in seen and item.candidate.has_sizes:
            seen.add(item.name)
            yield known[item.keys]


def _points_of(shift: Shift, ordinary: Comparison) -> Iterator[SizePoint]:
    compared = shift.compared
    found = [sizes_of(drive, compared.keys, compared.ridge) for drive in ordinary.drives]
    known = [item for item in found if item is not None]
    within = np.mean([np.diag(item.within) for item in known], axis=0)
    own, shared = _parted(shift, within, len(known))
    for k, (label, unit, away) in enumerate(_labels(compared.candidate)):
        others = tuple(float(item.value[k] - shift.mean[k]) * away for item in known)
        scale = abs(away)
        yield SizePoint(
            shift.compared.name, label, unit, float(shift.value[k]) * away, float(own[k]) * scale,
            float(shared[k]) * scale, shift.degrees, others,
        )  # fmt: skip


def _parted(shift: Shift, within: Array, drives: int) -> tuple[Array, Array]:
    """Deviations of a shift that are the drive's own, and those of the mean of n ordinary drives.

    The covariance between drives of a shift is T + (T + V_m)/n with the scatter T of ordinary drives and the mean V_m
    of their covariances, so that (T + V_m)/n = (between + V_m)/(n + 1).
    """
    between = np.diag(shift.between)
    shared = np.minimum((between + within) / (drives + 1.0), between)
    own = np.diag(shift.covariance) - shared
    return np.sqrt(np.maximum(own, 0.0)), np.sqrt(shared)


def _labels(candidate: Candidate) -> list[tuple[str, str, float]]:
    """Name, unit and step of each size of a candidate; probes that move one size of two forms are numbered."""
    moved = [moved_field(probe) for probe in candidate.probes]
    names = [name.replace("_", " ") for name, _, _ in moved]
    marks = ("along x", "along y") if candidate.is_direction else tuple(f"form {k + 1}" for k in range(len(names)))
    labels = _told_apart(names, marks)
    return [(label, str(data["unit"]), away) for label, (_, data, away) in zip(labels, moved, strict=True)]


def _told_apart(names: Sequence[str], marks: Sequence[str]) -> list[str]:
    return [
        name if names.count(name) == 1 else f"{name}, {mark}"
        for name, mark in zip(names, marks, strict=False)
    ]  # fmt: skip


def _parameters(problem: Problem, model: Model, ordinary: Comparison) -> Iterator[SizePoint]:
    """Parameters of robot, ground and sensors from their calibrated values."""
    pulls = {pull.name: pull for pull in model.pulls}
    values = model.fitted.point.values.tolist()
    for parameter, value in zip(problem.nuisances.parameters, values, strict=True):
        pull = pulls.get(parameter.name)
        if pull is None:
            continue
        deviation = parameter.prior * ordinary.usual_move(parameter.name)
        # that of the only recording needs no number
        label = parameter.name.removesuffix("_1").replace("_", " ")
        yield SizePoint(PARAMETER, label, parameter.unit, float(value), deviation, 0.0, pull.degrees, ())
