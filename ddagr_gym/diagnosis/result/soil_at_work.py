"""What the soils of a finding do under a wheel, with the doubt that their strength and stiffness share.

Strength and stiffness that trade against each other give the same forces. Every resampling of a fit is a soil; a wheel
at the working point of the drives is set on each, by the same functions as in the simulator, and the quantiles of what
it does are the intervals. What the drives leave open of the two sizes cancels there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.soil_at_work import (
    NET_PULL,
    SIDE_FORCE,
    SINKAGE,
    TRACTION,
    SoilAtWork,
    SoilQuantity,
    WorkingPoint,
)
from ddagr_gym.diagnosis.result.factor_sizes import factors
from ddagr_gym.diagnosis.result.uncertainty import Resampled, intervals
from ddagr_gym.identification.effect_parameters import moved
from ddagr_gym.identification.fitted_values import soil_with_values
from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.identification.problem import Problem
from ddagr_gym.parameters import Soil, TorusWheel
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.wheel_forces import equilibrium_sinkage, wheel_force

Array = NDArray[np.float64]

UNITS = {TRACTION: "N", NET_PULL: "N", SIDE_FORCE: "N", SINKAGE: "m"}
"""Quantities in their order."""

NOMINAL = "the nominal soil"
"""What a soil is held against that is the same all along."""

ABSENT = "in the rest of them"
"""The same where an effect without an onset of its own is present in a part of the drives."""

MOVING = 0.05
"""Speed of rim or hub from which a wheel counts as moving [m/s] (ours)."""

MOST_SLIP = 0.9
"""Slip ratio up to which a wheel has a working point (ours): at 1 it spins on the spot."""

FORM_OF_CHANGE = 0.1
"""Half the width that the interval of a change has in any case, of a force or a sinkage over the other (chosen on 16
development drives: intervals without it held 12 of 16 changes of traction, most misses by a few hundredths)."""

FORM_OF_VALUE = 0.6
"""The same of a force or a sinkage by itself, as a share of its value (chosen on the same drives): with another soil
law the same motion comes of up to 1.7 times the force."""

TOGETHER = 0.5
"""Correlation of two sizes from which they depend on each other (ours)."""

KNOWN = 1.5
"""Highest over lowest of an interval up to which a factor is known by itself (ours)."""

_FOURS = (layout.WHEEL_V_X, layout.WHEEL_V_Y, layout.WHEEL_OMEGA, layout.SLIP_RATIO, layout.LOAD)
_RECORDED = tuple(first + wheel for first in _FOURS for wheel in range(4))


def soil_at_work(problem: Problem, soil: Soil, fitted: Fitted, number: int, draws: Resampled) -> SoilAtWork | None:
    """What the soils of an effect do at the working point of the drives.

    Args:
        problem: what was fitted.
        soil: nominal.
        fitted: with the effect.
        number: of the effect among those of the fit.
        draws: of all parameters.

    Returns:
        None for an effect on anything else, and for drives in which no wheel rolls.
    """
    effect = fitted.point.effects[number]
    point = working_point(problem, fitted) if effect.soils else None
    if point is None:
        return None
    first, second = _places(effect, effect.name in problem.spells)
    wheel = problem.robot.wheels[0]
    values = np.array([wheel_at(wheel, item, point) for item in _soils(problem, soil, fitted.point.values, effect)])
    drawn = np.array(
        [
            [wheel_at(wheel, item, point) for item in _soils(problem, soil, nuisances, moved_effect)]
            for nuisances, moved_effect in _models(problem, fitted, number, draws)
        ]
    )
    quantities = tuple(_quantity(name, values[:, k], drawn[:, :, k]) for k, name in enumerate(UNITS))
    correlation, apart = _told_apart(fitted.point.effects, number, draws)
    return SoilAtWork(first, second, point, quantities, correlation, apart)


def working_point(problem: Problem, fitted: Fitted) -> WorkingPoint | None:
    """Medians over wheels and samples of the half with most slip; None where no wheel rolls. One simulation."""
    point = fitted.point
    _, record = problem.model.predict_recorded(point.values, point.states, _RECORDED, point.effects)
    v_x, v_y, omega, slip, load = np.abs(record.reshape(-1, len(_FOURS), 4)).transpose(1, 0, 2).reshape(len(_FOURS), -1)
    radius = problem.robot.wheels[0].outer_radius
    rolls = (np.maximum(v_x, radius * omega) > MOVING) & (slip < MOST_SLIP) & (load > 0.0)
    if not rolls.any():
        return None
    chosen = rolls & (slip >= np.median(slip[rolls]))
    angle = np.arctan2(v_y, v_x)
    speed, share, slide, weight = (float(np.median(item[chosen])) for item in (v_x, slip, angle, load))
    return WorkingPoint(speed, share, slide, weight)


def _places(effect: Effect, in_part: bool) -> tuple[str, str]:
    """Where the two soils are, in words."""
    first, *others = effect.soils
    return first, (others[0] if others else ABSENT if in_part else NOMINAL)


def _soils(problem: Problem, soil: Soil, values: Array, effect: Effect) -> list[Soil]:
    """The two soils of a model: the fitted one with the effect's factors, and what that is held against."""
    named = {p.name: float(v) for p, v in zip(problem.nuisances.parameters, values, strict=True)}
    factored = list(effect.soils.values())
    found = [_scaled(problem, soil, named, *item) for item in factored]
    if len(found) > 1:
        return found
    return [*found, _scaled(problem, soil, named, 1.0, 1.0) if effect.name in problem.spells else soil]


def _scaled(problem: Problem, soil: Soil, named: Mapping[str, float], strength: float, stiffness: float) -> Soil:
    """The fitted soil with factors on strength and stiffness, which are those of the nuisances."""
    changed = {
        **named,
        "soil_strength": named.get("soil_strength", 0.0) + math.log(strength),
        "soil_stiffness": named.get("soil_stiffness", 0.0) + math.log(stiffness),
    }
    return soil_with_values(soil, changed, held=True)


def _models(problem: Problem, fitted: Fitted, number: int, draws: Resampled) -> list[tuple[Array, Effect]]:
    """Values of all nuisances, and the effect, of every resampling."""
    free = np.flatnonzero(problem.free)
    found = []
    for nuisances, effects in zip(draws.nuisances, draws.effects, strict=True):
        values = fitted.point.values.copy()
        values[free] = nuisances
        found.append((values, moved(fitted.point.effects, draws.parameters, effects)[number]))
    return found


def wheel_at(wheel: TorusWheel, soil: Soil, point: WorkingPoint) -> list[float]:
    """What a driven wheel does at a working point on a soil, in the order of UNITS."""
    v_x, v_y = point.speed, point.speed * math.tan(point.slip_angle)
    omega = v_x / (wheel.outer_radius * (1.0 - point.slip))
    sinkage, _ = equilibrium_sinkage(wheel, soil, v_x, v_y, omega, 0.0, point.load)
    found = wheel_force(wheel, soil, v_x, v_y, omega, 0.0, sinkage)
    traction = -float(found.axle_torque) / wheel.outer_radius
    return [traction, float(found.force[0]), abs(float(found.force[1])), float(sinkage)]


def _quantity(name: str, value: Array, drawn: Array) -> SoilQuantity:
    """A quantity of both soils, from its values (2,) at the fit and in the resamplings (DRAWS, 2)."""
    first, second = (
        widened(intervals(drawn[:, k : k + 1])[0], float(value[k]), FORM_OF_VALUE * abs(float(value[k])), 0.0)
        for k in range(2)
    )
    if name == NET_PULL:
        return SoilQuantity(name, UNITS[name], float(value[0]), first, float(value[1]), second, None, None)
    change = float(value[0] / value[1]) - 1.0
    between = widened(intervals((drawn[:, :1] / drawn[:, 1:]) - 1.0)[0], change, FORM_OF_CHANGE, -1.0)
    return SoilQuantity(name, UNITS[name], float(value[0]), first, float(value[1]), second, change, between)


def widened(interval: tuple[float, float], value: float, form: float, least: float) -> tuple[float, float]:
    """An interval with a further half width in quadrature, holding its value, not below the least that exists."""
    middle, half = 0.5 * (interval[0] + interval[1]), 0.5 * (interval[1] - interval[0])
    wide = math.hypot(half, form)
    return min(max(middle - wide, min(least, interval[0])), value), max(middle + wide, value)


def _told_apart(effects: Sequence[Effect], number: int, draws: Resampled) -> tuple[float, bool]:
    """Correlation of the logarithms of an effect's sizes of soil, and whether they are known by themselves."""
    chosen = factors(effects, draws.parameters)
    own = [k for k, p in enumerate(draws.parameters) if p.effect == number and chosen[k]]
    if len(own) < 2:
        return 0.0, True
    sizes = np.log(draws.effects[:, own])
    spans = [high / low for low, high in intervals(draws.effects[:, own])]
    correlation = float(np.corrcoef(sizes.T)[0, 1])
    return correlation, abs(correlation) < TOGETHER or max(spans) <= KNOWN
