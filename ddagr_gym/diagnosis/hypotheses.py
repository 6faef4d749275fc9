"""From what the scan found to an effect to start a fit from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.candidates import Candidate
from ddagr_gym.diagnosis.problem import Point, Problem
from ddagr_gym.diagnosis.scores import Gain, Terms, best_multiples, reduce
from ddagr_gym.frames import wrap_angle
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.encoder_scale import EncoderScale
from ddagr_gym.physics.effects.motor_lag import MotorLag
from ddagr_gym.physics.effects.slope import Slope
from ddagr_gym.physics.effects.wheel_radius_mismatch import WheelRadiusMismatch

PULLED = 4.0
"""Standard deviations from the nominal value beyond which a refitted nuisance stands for something missing (ours)."""


def first_guess(candidate: Candidate, multiples: Sequence[float]) -> Effect:
    """Effect that the multiples of a candidate's probes stand for, inside its bounds.

    Probes that move different sizes add up; probes of one size in different directions (slope) or at different
    distances (towed drag) make one effect between them.

    Args:
        candidate: probes of one effect.
        multiples: of each.
    """
    kind = type(candidate.probes[0])
    if candidate.whole is not None or not kind.differentiable:
        return candidate.probes[0] if candidate.whole is None else _whole(candidate)
    if kind.name == "slope":
        return _slope(candidate, multiples)
    values: dict[str, float] = {}
    for name in kind.size_names():
        data = kind.parameter(name).metadata
        total = sum(m * (getattr(p, name) - data["neutral"]) for m, p in zip(multiples, candidate.probes, strict=True))
        values[name] = min(max(data["neutral"] + total, data["low"]), data["high"])
    weight = [abs(m) for m in multiples]
    for name in kind.shape_names():
        shapes = [getattr(p, name) for p in candidate.probes]
        if sum(weight) > 0.0:
            mean = sum(w * s for w, s in zip(weight, shapes, strict=True)) / sum(weight)
            # rounding must not lead out of the probes' range: an onset of "always" lies at its bound
            values[name] = min(max(mean, min(shapes)), max(shapes))
        else:
            values[name] = shapes[0]
    return kind(**values)


def _whole(candidate: Candidate) -> Effect:
    """A categorical probe taken to its bound."""
    probe = candidate.probes[0]
    moved = {}
    for name in probe.size_names():
        data = probe.parameter(name).metadata
        if getattr(probe, name) != data["neutral"]:
            moved[name] = data["high"]
    return probe.with_values(**moved)  # type: ignore[no-any-return]


def _slope(candidate: Candidate, multiples: Sequence[float]) -> Slope:
    """The two components of the gradient as an angle and a direction."""
    parts = [
        (m * p.as_mapping()["parameters"]["angle"], p.as_mapping()["parameters"]["direction"])
        for m, p in zip(multiples, candidate.probes, strict=True)
    ]
    x = sum(angle * math.cos(direction) for angle, direction in parts)
    y = sum(angle * math.sin(direction) for angle, direction in parts)
    high = candidate.probes[0].parameter("angle").metadata["high"]
    return candidate.probes[0].with_values(  # type: ignore[no-any-return]
        angle=min(math.hypot(x, y), high), direction=math.atan2(y, x)
    )


def turned_to_agree(problem: Problem, terms: Terms, gain: Gain, point: Point, share: float = 1.0) -> Point:
    """A point with a slope as its last effect, where recordings without poses are turned so that their slopes agree.

    Each of them shows the slope towards a direction of its own frame, and no small step turns frames that differ by
    more than a right angle.

    Args:
        problem: with the nuisances.
        terms: of the scan that found the slope.
        gain: of the slope.
        point: with the slope as the scan guesses it for one frame.
        share: of the slope that the scan says.
    """
    parameters = enumerate(problem.nuisances.parameters)
    shown = set(terms.recording.tolist())
    turned = {p.recording: k for k, p in parameters if p.heading and p.recording in shown}
    placed = ~np.isin(terms.recording, np.array(terms.turned, dtype=np.int64))
    if point.effects[-1].name != Slope.name or not turned or not placed.any():
        return point
    candidate = terms.candidates[gain.candidate]
    own = {number: _slope_of(terms, candidate, terms.recording == number) for number in turned}
    common = _slope_of(terms, candidate, placed)
    values = point.values.copy()
    for number, slope in own.items():
        values[turned[number]] += wrap_angle(common.direction - slope.direction)
    angle = share * float(np.mean([slope.angle for slope in (common, *own.values())]))
    slope = common.with_values(angle=angle)
    return problem.moved(replace(point, effects=(*point.effects[:-1], slope)), values)


def _slope_of(terms: Terms, candidate: Candidate, chosen: NDArray[np.bool_]) -> Slope:
    """Slope that some of the windows show."""
    _, multiples = best_multiples(reduce(terms, chosen.astype(float)), candidate)
    return _slope(candidate, multiples.tolist())


def looped_encoders(point: Point) -> Point | None:
    """Uneven wheel radii told as encoders of the wrong scale which the speed loop believes.

    No reading tells one from the other, except that both encoders may be wrong by the same share as well.

    Args:
        point: with the effect to translate as its last one.

    Returns:
        None where the last effect is another.
    """
    radii = point.effects[-1]
    if not isinstance(radii, WheelRadiusMismatch) or EncoderScale.name in [e.name for e in point.effects]:
        return None
    half = 0.5 * radii.difference
    return replace(point, effects=(*point.effects[:-1], EncoderScale(1.0 - half, 1.0 + half, 1.0)))


def slower_loop(problem: Problem, point: Point) -> Point | None:
    """The same predictions with a slow speed loop told as motor_lag, where its nuisance stands far from what is known.

    Refitted rate and lag are one time constant, 1/rate + lag. The scan, which is linear, does not find the way from one
    to the other: it is curved, and long where the loop is slow. Null drives leave the rate within a tenth of its
    standard deviation.

    Args:
        problem: with the nuisances.
        point: fitted.

    Returns:
        None where the rate is near the nominal one or fast, or motor_lag is assumed.
    """
    names = [parameter.name for parameter in problem.nuisances.parameters]
    if "motor_rate" not in names or "motor_lag" in [effect.name for effect in point.effects]:
        return None
    place = names.index("motor_rate")
    value = float(point.values[place])
    if value > -PULLED * float(problem.prior[place]):
        return None
    values = point.values.copy()
    values[place] = 0.0
    lag = MotorLag(math.expm1(-value) / problem.robot.motor_rate)
    return replace(point, values=values, effects=(*point.effects, lag))
