"""The simulations of a scan: what a small size of each effect of the library changes in the readings.

One simulation per probe gives a column of sensitivities; per window all inner products of residual, nuisances and
probes are kept (:class:`~ddagr_gym.diagnosis.search.inner_products.Terms`), from which
:mod:`~ddagr_gym.diagnosis.search.gains` says what each effect would explain.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.search.candidates import Candidate, candidates_of
from ddagr_gym.diagnosis.search.inner_products import InnerProducts, Terms
from ddagr_gym.diagnosis.search.lean import imitated_gains, lean_column
from ddagr_gym.diagnosis.search.overlap import overlaps
from ddagr_gym.diagnosis.search.sensor_effects import Drives, acts_on_readings_only, record_drives
from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.identification.least_squares import beside_residual
from ddagr_gym.identification.nuisances import absorbed_sizes
from ddagr_gym.identification.problem import Problem
from ddagr_gym.identification.side_by_side import side_by_side
from ddagr_gym.parameters import STANDARD_GRAVITY, Robot
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.base import DriveExtent
from ddagr_gym.physics.effects.registry import absolute_effect_kinds
from ddagr_gym.physics.effects.soil_patch import from_middle_line

Array = NDArray[np.float64]

_NEAR_PATCH = 1.5
"""Distance of wheels from the body's path that may still touch a patch [m], about a robot's half diagonal and more."""

_BEFORE_ONSET = 3.0
"""Time before an onset in which it already shows [s]: six widths of the smoothed step."""


def drive_extent(problem: Problem, prediction: Array) -> DriveExtent:
    """What the windows cover."""
    windows = problem.blocked.windows
    x, y = prediction[..., 5], prediction[..., 6]
    commands = windows.commands[:, windows.history : windows.history + windows.samples]
    change = np.abs(np.diff(prediction[..., 3:5], axis=1)).max() / windows.period
    return DriveExtent(
        float((windows.time + windows.duration).max()),
        (float(x.min()), float(x.max())),
        (float(y.min()), float(y.max())),
        float(np.abs(commands).max()),
        float(change),
        0.5 * float(np.abs(commands[..., 0] - commands[..., 1]).max()),
        _traction(problem.robot),
    )


def _traction(robot: Robot) -> float:
    """Torque of half the robot's weight at the rim [N m]."""
    return 0.5 * robot.mass * STANDARD_GRAVITY * robot.outer_radius


def touched(probe: Effect, problem: Problem, prediction: Array) -> NDArray[np.bool_]:
    """(W,) windows whose readings a probe can change: others need no simulation."""
    windows = problem.blocked.windows
    result = np.ones(windows.count, dtype=bool)
    names = probe.shape_names()
    if {"centre_x", "centre_y", "radius", "edge"} <= set(names):
        place = probe.as_mapping()["parameters"]
        x, y = prediction[..., 5] - place["centre_x"], prediction[..., 6] - place["centre_y"]
        distance = from_middle_line(x, y, place.get("half_length", 0.0), place.get("bearing", 0.0))
        result &= distance.min(axis=1) < place["radius"] + _NEAR_PATCH + 4.0 * place["edge"]
    if "onset" in names:
        result &= windows.time + windows.duration > probe.as_mapping()["parameters"]["onset"] - _BEFORE_ONSET
    return result


def probe_columns(
    problem: Problem, fitted: Fitted, probes: Sequence[Effect], drives: Drives | None = None
) -> Iterator[Array]:
    """Weighted change of the block means by each probe at the fitted model, (W, M).

    Args:
        problem: what was fitted.
        fitted: the model.
        probes: effects at a size.
        drives: simulation of the fitted model, with which an effect on readings needs none of its own.
    """

    def column(probe: Effect, threads: int) -> Array:
        return _probe_column(problem, fitted, probe, drives, threads)

    return side_by_side(column, probes, problem.model.threads)


def _probe_column(problem: Problem, fitted: Fitted, probe: Effect, drives: Drives | None, threads: int) -> Array:
    if drives is not None and acts_on_readings_only(probe):
        column = problem.blocked.change(drives.readings(probe), fitted.prediction)
        return np.where(problem.present(probe.name)[:, None], column, 0.0)
    chosen = touched(probe, problem, fitted.prediction) & problem.present(probe.name)
    column = np.zeros(problem.blocked.mask.shape)
    if not chosen.any():
        return column
    part = problem if chosen.all() else problem.subset(chosen)
    point = replace(fitted.point, states=fitted.point.states[chosen], effects=(*fitted.point.effects, probe))
    prediction = part.on_threads(threads).predict(point)
    column[chosen] = part.blocked.change(prediction, fitted.prediction[chosen])
    return column


def scan(
    problem: Problem,
    fitted: Fitted,
    kinds: Mapping[str, type[Effect]] | None = None,
    progress: Callable[[str], None] = lambda name: None,
) -> Terms:
    """Terms of all effects of the library at a fitted model.

    Args:
        problem: what was fitted.
        fitted: the fit, with or without effects.
        kinds: effects to try, by default all that need no drives from before, and no common frame of the poses where
            there is none; those assumed already are left out.
        progress: called with the name of each effect when it is done.
    """
    extent = drive_extent(problem, fitted.prediction)
    assumed = {effect.name for effect in fitted.point.effects}
    candidates: list[Candidate] = []
    probes: list[Effect] = []
    ends: dict[str, int] = {}
    drives = record_drives(problem, fitted.point)
    tried = absolute_effect_kinds(problem.blocked.windows.frames_apart) if kinds is None else kinds
    for name, kind in tried.items():
        # repeated readings are found in the values themselves (ddagr_gym.diagnosis.preprocessing.repeated_readings)
        if name in assumed or name == "sensor_hold":
            continue
        for candidate in candidates_of(kind, extent, len(probes)):
            candidates.append(candidate)
            probes += candidate.probes
        ends[name] = len(probes)
    made, columns = probe_columns(problem, fitted, probes, drives), list[Array]()
    for name, end in ends.items():
        columns += islice(made, end - len(columns))
        progress(name)
    lean = lean_column(problem, fitted)
    columns += [] if lean is None else [lean]
    free = problem.open_at(fitted.point)
    residual = problem.residual(fitted.point, fitted.prediction)
    raw = beside_residual(residual, fitted.by_parameter[..., free], np.stack(columns, axis=2))
    projected = fitted.elimination.project(raw)
    overlap = overlaps(problem, fitted, candidates, projected[..., 1 + len(free) :])
    windows = problem.blocked.windows
    normals = np.matmul(projected.transpose(0, 2, 1), projected)
    precision, values = 1.0 / problem.prior[free] ** 2, fitted.point.values[free]
    imitated = {} if lean is None else imitated_gains(InnerProducts(normals, precision, values), candidates)
    return Terms(
        normals if lean is None else normals[:, :-1, :-1],
        precision,
        values,
        tuple(candidates),
        windows.recording,
        windows.time,
        tuple(p.recording for p in problem.nuisances.parameters if p.heading and p.recording is not None),
        overlap,
        absorbed_sizes(problem.nuisances.parameters, fitted.point.values),
        imitated,
    )
