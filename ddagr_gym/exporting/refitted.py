"""Robot and soil of a diagnosis, drawn anew: as sure as they were refitted, and together as they were."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.drivetrain import PART_TITLES
from ddagr_gym.diagnosis.answer.nuisance_spread import NuisanceSpread
from ddagr_gym.diagnosis.answer.verdict import SCHEMA, Diagnosis
from ddagr_gym.diagnosis.result.files import validate
from ddagr_gym.errors import InputError
from ddagr_gym.files import read_json
from ddagr_gym.identification.fitted_values import with_values
from ddagr_gym.identification.parameters import robot_parameters
from ddagr_gym.parameters import Drivetrain, Robot, Soil
from ddagr_gym.physics.effects.draws import DEVIATIONS_OF_AN_INTERVAL

Array = NDArray[np.float64]
Interval = tuple[float, float]

_IN_DRIVETRAIN = {item.name: item.metadata for item in fields(Drivetrain)}
"""Bounds of the drivetrain's fields."""

_TRIES = 100
"""Draws until one makes a valid robot and soil (ours)."""


@dataclass(frozen=True, eq=False)
class RefittedDraws:
    """Draws of a refitted robot and soil.

    Attributes:
        robot: refitted.
        soil: refitted.
        names: of the refitted values that belong to both.
        deviations: (P,) standard deviations of these.
        root: (P, P) of their correlation, root times its transpose.
        parts: intervals of parts of the drivetrain that were named, by field of robot or drivetrain.
        most: standard deviations at which draws are cut off.
    """

    robot: Robot
    soil: Soil
    names: tuple[str, ...]
    deviations: Array
    root: Array
    parts: Mapping[str, Interval]
    most: float

    def draw(self, rng: np.random.Generator) -> tuple[Robot, Soil]:
        """A robot and a soil.

        Raises:
            InputError: hardly any draw is valid.
        """
        for _ in range(_TRIES):
            try:
                return self._drawn(rng)
            except (InputError, OverflowError) as error:
                reason = str(error).rstrip(".")
        raise InputError(f"{_TRIES} draws of the diagnosis's robot and soil are all invalid ({reason}): diagnose anew.")

    def _drawn(self, rng: np.random.Generator) -> tuple[Robot, Soil]:
        offsets = self.deviations * np.clip(self.root @ rng.standard_normal(len(self.names)), -self.most, self.most)
        bounds = {item.name: (item.low, item.high) for item in robot_parameters(self.robot)}
        inside = {
            name: float(np.clip(offset, *bounds.get(name, (-math.inf, math.inf))))
            for name, offset in zip(self.names, offsets, strict=True)
        }
        robot, soil = with_values(self.robot, self.soil, inside)
        return self._with_parts(robot, rng), soil

    def _with_parts(self, robot: Robot, rng: np.random.Generator) -> Robot:
        """The robot with parts of its drivetrain that no refit moved, drawn from their intervals."""
        drivetrain: dict[str, Any] = {}
        own: dict[str, Any] = {}
        for name, interval in self.parts.items():
            z = float(np.clip(rng.standard_normal(), -self.most, self.most))
            if name in _IN_DRIVETRAIN:
                drawn = _drawn_from(interval, float(getattr(robot.drivetrain, name)), z)
                bounds = _IN_DRIVETRAIN[name]
                drivetrain[name] = min(max(drawn, bounds["low"]), bounds["high"])
            else:
                own[name] = _drawn_from(interval, float(getattr(robot, name)), z)
        return replace(robot, drivetrain=replace(robot.drivetrain, **drivetrain), **own)


def read_answer(path: Path) -> Diagnosis | None:
    """The answer of a ``diagnosis.json``; None for one of another version.

    Raises:
        InputError: no JSON mapping, or a wrong entry.
    """
    fault, remedy = "cannot be read as a diagnosis", "make it with `ddagr diagnose`"
    content = read_json(path, fault, remedy)
    if not isinstance(content, dict):
        raise InputError(f"{path} {fault} (it holds no mapping): {remedy}.")
    return validate(content, str(path)) if content.get("schema") == SCHEMA else None


def refitted_draws(answer: Diagnosis, robot: Robot, soil: Soil, most: float) -> RefittedDraws | None:
    """Draws of a diagnosis's robot and soil; None where its answer does not say how sure they are.

    Args:
        answer: of the diagnosis.
        robot: refitted.
        soil: refitted.
        most: standard deviations at which draws are cut off.

    Raises:
        InputError: the answer's correlation or intervals do not fit its names.
    """
    spread = answer.nuisance_spread
    if spread is None:
        return None
    missing = [name for name in spread.shared if name not in spread.intervals]
    if missing:
        raise InputError(f"the diagnosis's nuisance_spread has no interval of {missing[0]!r}: diagnose anew.")
    ends = np.array([spread.intervals[name] for name in spread.shared], dtype=np.float64).reshape(-1, 2)
    deviations = (ends[:, 1] - ends[:, 0]) / DEVIATIONS_OF_AN_INTERVAL
    if not (np.isfinite(deviations).all() and (deviations >= 0.0).all()):
        raise InputError("the diagnosis's nuisance_spread has an interval without low and high: diagnose anew.")
    parts = {name: interval for name, interval in _parts(answer).items() if name not in spread.shared}
    return RefittedDraws(robot, soil, spread.shared, deviations, _root(spread), parts, most)


def _parts(answer: Diagnosis) -> dict[str, Interval]:
    """Intervals of the named parts of the drivetrain, by field."""
    fitted = {*_IN_DRIVETRAIN, *(item.name for item in fields(Robot))}
    return {
        name: estimate.interval
        for finding in answer.findings
        if finding.name in PART_TITLES
        for name, estimate in finding.parameters.items()
        if estimate.interval is not None and name in fitted
    }


def _root(spread: NuisanceSpread) -> Array:
    """(P, P) root of a correlation; what rounding made negative is nothing."""
    count, rows = len(spread.shared), spread.correlation
    if [len(row) for row in rows] != [count] * count or not all(math.isfinite(item) for row in rows for item in row):
        raise InputError(f"the diagnosis's nuisance_spread needs {count} rows of {count} correlations: diagnose anew.")
    values, vectors = np.linalg.eigh(np.array(rows, dtype=np.float64).reshape(count, count))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def _drawn_from(interval: Interval, value: float, deviations: float) -> float:
    """A value so many deviations from another, as a factor where the interval has no zero in it."""
    low, high = interval
    if low > 0.0 and value > 0.0:
        return value * math.exp(deviations * math.log(high / low) / DEVIATIONS_OF_AN_INTERVAL)
    return value + deviations * (high - low) / DEVIATIONS_OF_AN_INTERVAL
