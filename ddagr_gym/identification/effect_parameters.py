"""The fields of assumed effects as parameters of a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.problem import Point, Problem
from ddagr_gym.identification.size_prior import size_scale
from ddagr_gym.identification.window_model import Reference
from ddagr_gym.physics.effects import Effect

Array = NDArray[np.float64]

_KEPT = frozenset(
    {
        ("payload", "x"), ("payload", "y"), ("payload", "height"), ("lateral_bulldozing", "density"),
        ("soil_patch", "edge"), ("towed_drag", "hitch_distance"), ("encoder_scale", "loop"),
        ("lateral_bulldozing", "angle"), ("lateral_bulldozing", "way"), ("motor_lag", "turning"),
        ("command_deadband", "turning"),
    }
)  # fmt: skip
"""Shapes that a diagnosis leaves at their defaults: free, they let one effect stand for another (a payload that is not
at the centre is a centre of mass offset too), and drives hardly show them."""

_NEVER = 1e5
"""Onset [s] at which an effect holds always, or never."""


@dataclass(frozen=True)
class EffectParameter:
    """One moving field of an assumed effect.

    Attributes:
        effect: its place among the assumed effects.
        field: name of the field.
        step: for finite differences, in its unit.
        low: bound.
        high: bound.
        neutral: value without effect; of a shape its default, which costs nothing.
        scale: standard deviation about neutral before any data, infinite for a shape.
    """

    effect: int
    field: str
    step: float
    low: float
    high: float
    neutral: float
    scale: float


def effect_parameters(effects: Sequence[Effect], fixed: frozenset[str] = frozenset()) -> tuple[EffectParameter, ...]:
    """Fields of effects that a fit moves: all with a step, but none of a categorical effect, no flags and nothing that
    is idle where an effect stands.

    Args:
        effects: assumed.
        fixed: names of fields to leave alone.
    """
    found = []
    for number, effect in enumerate(effects):
        if effect.categorical or effect.name == "sensor_hold":
            continue
        for name in (*effect.size_names(), *effect.shape_names()):
            data = effect.parameter(name).metadata
            at_neutral = not effect.differentiable and getattr(effect, name) == data["neutral"]
            if (effect.name, name) in _KEPT or name in effect.idle_shapes:
                continue
            if data["step"] == 0.0 or name in fixed or abs(getattr(effect, name)) > _NEVER or at_neutral:
                continue
            of_size = data["neutral"] is not None and effect.differentiable
            scale = size_scale(effect, name) if of_size else np.inf
            neutral = data["neutral"] if of_size else 0.0
            found.append(EffectParameter(number, name, data["step"], data["low"], data["high"], neutral, scale))
    return tuple(found)


def at_kept_shapes(effect: Effect) -> Effect:
    """An effect with the shapes that fits leave alone at their defaults."""
    kept = {name: effect.parameter(name).default for kind, name in _KEPT if kind == effect.name}
    return effect.with_values(**kept) if kept else effect


def moved(effects: tuple[Effect, ...], parameters: Sequence[EffectParameter], values: Array) -> tuple[Effect, ...]:
    """Effects with parameters at values, clipped to their bounds."""
    changed = list(effects)
    for parameter, value in zip(parameters, values, strict=True):
        inside = float(min(max(value, parameter.low), parameter.high))
        changed[parameter.effect] = changed[parameter.effect].with_values(**{parameter.field: inside})
    return tuple(changed)


def read(effects: Sequence[Effect], parameters: Sequence[EffectParameter]) -> Array:
    """Values of parameters of effects."""
    return np.array([getattr(effects[p.effect], p.field) for p in parameters], dtype=np.float64)


def effect_columns(
    problem: Problem, point: Point, parameters: Sequence[EffectParameter], reference: Reference | None = None
) -> Array:
    """Weighted sensitivity to effect parameters, (W, M, E).

    Args:
        problem: what is fitted.
        point: where the model stands.
        parameters: of its effects.
        reference: of :meth:`Problem.reference`; simulated when it is None.
    """
    columns = np.empty((*problem.blocked.mask.shape, len(parameters)))
    if not parameters:
        return columns
    values = read(point.effects, parameters)
    reference = problem.reference(point) if reference is None else reference
    steps = [
        p.step if p.low <= value + p.step <= p.high else -p.step for p, value in zip(parameters, values, strict=True)
    ]
    beside = [moved(point.effects, parameters, tried) for tried in values + np.diag(steps)]
    changes = problem.changes([(None, replace(point, effects=effects)) for effects in beside], reference)
    for k, (change, step) in enumerate(zip(changes, steps, strict=True)):
        columns[..., k] = change / step
    return columns
