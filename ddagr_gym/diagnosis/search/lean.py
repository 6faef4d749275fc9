"""What a robot that leans reads beyond what the simulator knows of it.

Wheels that sink unevenly tilt a robot, and its accelerometer reads a part of gravity that other names would explain as
a bias or a tilted sensor. The simulator's robot feels a share of that (theory: wheel model, eq. (35a)), which is
fitted, and nothing of a patch. What is left is counted against further effects.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.search.candidates import Candidate
from ddagr_gym.diagnosis.search.gains import best_multiples
from ddagr_gym.diagnosis.search.inner_products import InnerProducts, Reduced
from ddagr_gym.diagnosis.search.sensor_effects import acts_on_readings_only
from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.identification.problem import Problem
from ddagr_gym.parameters import Robot
from ddagr_gym.physics import layout
from ddagr_gym.sensors.imu import gravity_of_lean

Array = NDArray[np.float64]

_MINOR, _MAJOR = layout.WHEEL, layout.WHEEL + 8
_BY_WHEEL = (_MINOR, _MAJOR, layout.SINKAGE, layout.FELT_DEPTH)
_ENTRIES = [*(first + wheel for first in _BY_WHEEL for wheel in range(4)), layout.SINKAGE_TILT]


def lean_column(problem: Problem, fitted: Fitted) -> Array | None:
    """Weighted change of the block means by the lean that the effects of a model add and the simulator does not feel.

    (W, M); None where they add none.

    Args:
        problem: what was fitted.
        fitted: the model.
    """
    if all(acts_on_readings_only(effect) for effect in fitted.point.effects):
        return None
    leaning = fitted.prediction.copy()
    added = _hub_heights(problem, fitted, True) - _hub_heights(problem, fitted, False)
    leaning[..., :2] += gravity_read(problem.robot, added)
    return problem.blocked.change(leaning, fitted.prediction)


def gravity_read(robot: Robot, heights: Array) -> Array:
    """(..., 2) specific force [m/s^2] along x and y of a robot whose hubs stand at heights (..., 4) [m].

    A small-angle tilt of the plane of the four hubs: nose up reads forwards, left side up to the left.

    Args:
        robot: with the distances of its wheels.
        heights: of the hubs, in the order of the wheels.
    """
    gravity = gravity_of_lean(*np.moveaxis(heights, -1, 0), robot.half_wheelbase, robot.half_track)
    return np.stack(gravity, axis=-1)


def _hub_heights(problem: Problem, fitted: Fitted, with_effects: bool) -> Array:
    """(W, T, 4) heights of the hubs above the untouched ground [m], less the share of sinkage that is felt already."""
    point = fitted.point if with_effects else replace(fitted.point, effects=())
    record = problem.model.predict_recorded(point.values, point.states, _ENTRIES, point.effects)[1]
    minor, major, sinkage, felt_depth = np.split(record[..., :-1], len(_BY_WHEEL), axis=-1)
    return np.asarray(minor + major - sinkage * (1.0 - record[..., -1:] * felt_depth))


def imitated_gains(products: InnerProducts, candidates: Sequence[Candidate]) -> dict[str, float]:
    """What each effect would gain by readings that differ by the last column alone, times the dispersion.

    Args:
        products: of the candidates' columns and, behind them, that column.
        candidates: of the library.
    """
    reduced = products.reduced()
    others = Reduced(reduced.information[:-1, -1], reduced.information[:-1, :-1], reduced.nuisance[:, :-1])
    found: dict[str, float] = {}
    for candidate in candidates:
        gain, _ = best_multiples(others, candidate)
        found[candidate.name] = max(found.get(candidate.name, 0.0), gain)
    return found
