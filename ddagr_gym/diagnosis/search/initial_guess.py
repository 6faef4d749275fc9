"""Where a joint refit starts: the effect that a scan points to, or one that predicts what a nuisance made up for."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.search.candidates import Candidate
from ddagr_gym.diagnosis.search.gains import Gain, best_multiples
from ddagr_gym.diagnosis.search.inner_products import Terms
from ddagr_gym.frames import wrap_angle
from ddagr_gym.identification.effect_parameters import at_kept_shapes
from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.identification.problem import Point, Problem
from ddagr_gym.parameters import Robot
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.centre_of_mass_offset import CentreOfMassOffset
from ddagr_gym.physics.effects.command_delay import CommandDelay
from ddagr_gym.physics.effects.encoder_scale import EncoderScale
from ddagr_gym.physics.effects.motor_lag import MotorLag
from ddagr_gym.physics.effects.payload import Payload
from ddagr_gym.physics.effects.towed_drag import TowedDrag
from ddagr_gym.physics.effects.wheel_radius_mismatch import WheelRadiusMismatch

PULLED = 4.0
"""Prior standard deviations from the nominal value beyond which a refitted nuisance makes up for something missing
(ours: null drives stay within a tenth of one)."""

_FORM_OF_SHAPE = 0.2
"""Share of a gain below which shapes that no drive shows by itself are not told apart (ours): the library's soil is not
the ground's, and drives of another simulator preferred a wrong hitch by 1 to 18 %."""

_LEAST_OFFSET = 0.02
"""Offset of the centre of mass, over the distance to the rim, below which no load is looked for behind it (ours)."""


def first_guess(candidate: Candidate, multiples: Sequence[float]) -> Effect:
    """Effect with the sizes that the multiples of a candidate's probes mean, inside its bounds.

    Probes that move different sizes add up; probes of one size in different directions (slope) or at different
    distances (towed drag) make one effect between them.

    Args:
        candidate: probes of one effect.
        multiples: of each.
    """
    kind = type(candidate.probes[0])
    if candidate.whole is not None or not kind.differentiable:
        return candidate.probes[0] if candidate.whole is None else _whole(candidate)
    if candidate.is_direction:
        return _directed(candidate, multiples)
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
    fields = {name: probe.parameter(name).metadata for name in probe.size_names()}
    moved = {name: data["high"] for name, data in fields.items() if getattr(probe, name) != data["neutral"]}
    return probe.with_values(**moved)


def _directed(candidate: Candidate, multiples: Sequence[float]) -> Effect:
    """Components along the axes of the world as a size and a direction."""
    probe = candidate.probes[0]
    size = probe.size_names()[0]
    parts = [
        (m * getattr(p, size), p.as_mapping()["parameters"]["direction"])
        for m, p in zip(multiples, candidate.probes, strict=True)
    ]
    x = sum(length * math.cos(direction) for length, direction in parts)
    y = sum(length * math.sin(direction) for length, direction in parts)
    length = min(math.hypot(x, y), probe.parameter(size).metadata["high"])
    return probe.with_values(**{size: length, "direction": math.atan2(y, x)})


def with_usual_shape(best: Fitted, before: float, refitted: Callable[[Point], Fitted]) -> Fitted:
    """A fit whose last effect, a towed load, is hitched where loads usually are, if that explains about as much.

    The scan chooses between two hitches, and no fit moves them. Of a load farther behind less force steadies the robot
    as much, and soil stands for the rest: in drives of another simulator, whose loads hung at 0.55 and 0.6 m, the least
    was left with 0.8 m and six tenths of the force. Other effects, and a load that hangs there, stay as they are.

    Args:
        best: fit that leaves least, with effects.
        before: cost without its last effect.
        refitted: gives the fit from a point.
    """
    *others, effect = best.point.effects
    shape = at_kept_shapes(effect)
    if effect.name != TowedDrag.name or shape == effect:
        return best
    usual = refitted(replace(best.point, effects=(*others, shape)))
    return usual if usual.cost - best.cost <= _FORM_OF_SHAPE * (before - best.cost) else best


def nuisance_answer(problem: Problem, fitted: Fitted, terms: Terms, gain: Gain) -> NDArray[np.float64]:
    """(P,) change of all nuisances that goes with a candidate's multiples in the scan's linear model.

    Args:
        problem: what was fitted.
        fitted: the model that was scanned.
        terms: of that scan.
        gain: of the candidate; a categorical or a limiting effect keeps its probe's size whatever its multiple.
    """
    candidate = terms.candidates[gain.candidate]
    change = np.zeros(len(fitted.point.values))
    if candidate.has_sizes:
        nuisance = terms.reduced().nuisance
        change[problem.open_at(fitted.point)] = (
            nuisance[:, 0] - nuisance[:, 1 + np.array(candidate.columns)] @ gain.multiples
        )
    return change


def turned_to_agree(problem: Problem, terms: Terms, gain: Gain, point: Point, share: float = 1.0) -> Point:
    """A point where recordings without poses are turned so that the direction of its last effect, a slope, agrees.

    Each of them shows the slope towards a direction of its own frame, and no small step turns frames that differ by
    more than a right angle.

    Args:
        problem: with the nuisances.
        terms: of the scan that found the effect.
        gain: of the effect.
        point: with the effect as the scan guesses it for one frame; one without a direction stays as it is.
        share: of the size that the scan says.
    """
    parameters = enumerate(problem.nuisances.parameters)
    shown = set(terms.recording.tolist())
    turned = {p.recording: k for k, p in parameters if p.heading and p.recording in shown}
    candidate = terms.candidates[gain.candidate]
    directed = candidate.is_direction and candidate.name == point.effects[-1].name
    if not directed or not turned or not terms.placed.any():
        return point
    own = {number: _shown_by(terms, candidate, terms.recording == number) for number in turned}
    length, direction = _shown_by(terms, candidate, terms.placed)
    values = point.values.copy()
    for number, (_, seen) in own.items():
        values[turned[number]] += wrap_angle(direction - seen)
    mean = float(np.mean([length, *(size for size, _ in own.values())]))
    last = point.effects[-1]
    last = last.with_values(**{last.size_names()[0]: share * mean, "direction": direction})
    return problem.moved(replace(point, effects=(*point.effects[:-1], last)), values)


def _shown_by(terms: Terms, candidate: Candidate, chosen: NDArray[np.bool_]) -> tuple[float, float]:
    """Size and direction that some of the windows show."""
    _, multiples = best_multiples(terms.reduced(chosen.astype(float)), candidate)
    parameters = _directed(candidate, multiples.tolist()).as_mapping()["parameters"]
    return parameters[candidate.probes[0].size_names()[0]], parameters["direction"]


def looped_encoders(point: Point) -> Point | None:
    """Encoders of the wrong scale, which the speed loop believes, in place of uneven wheel radii.

    Both predict the same readings, except that both encoders may be wrong by the same share as well.

    Args:
        point: with the effect to translate as its last one.

    Returns:
        None where the last effect is another.
    """
    radii = point.effects[-1]
    if not isinstance(radii, WheelRadiusMismatch) or EncoderScale.name in [e.name for e in point.effects]:
        return None
    return replace(point, effects=(*point.effects[:-1], looped(radii)))


def looped(radii: WheelRadiusMismatch) -> EncoderScale:
    """Encoders that make a speed loop turn the wheels as unevenly as these radii let them roll."""
    half = 0.5 * radii.difference
    return EncoderScale(1.0 - half, 1.0 + half, 1.0)


def off_centre_load(robot: Robot, point: Point) -> Point | None:
    """A load at the robot's rim that shifts the centre of mass as much, in place of an offset centre of mass.

    Every load that is not at the centre does both; its mass follows from where it lies.

    Args:
        robot: nominal.
        point: with the effect to translate as its last one.

    Returns:
        None where the last effect is another or hardly shifts anything, where no load at the rim shifts as much, or
        where a load is assumed.
    """
    offset = point.effects[-1]
    if not isinstance(offset, CentreOfMassOffset) or Payload.name in [e.name for e in point.effects]:
        return None
    distance, rim = math.hypot(offset.x, offset.y), max(robot.half_wheelbase, robot.half_track)
    if not _LEAST_OFFSET * rim < distance < 0.5 * rim:
        return None
    mass = robot.mass * distance / (rim - distance)
    x, y, height = robot.centre_of_mass
    share = rim / distance
    high = Payload.parameter("mass").metadata["high"]
    load = Payload(min(mass, high), x + share * offset.x, y + share * offset.y, height)
    return replace(point, effects=(*point.effects[:-1], load))


def slower_loop(problem: Problem, point: Point) -> Point | None:
    """The same predictions with motor_lag in place of a slow speed loop, where its nuisance is far from its prior.

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
    lag = MotorLag(math.expm1(-value) / problem.robot.motor_rate)
    return _handed_over(point, place, (*point.effects, lag))


def same_lateness(effect: Effect) -> Effect | None:
    """A dead time in place of slow motors that trail a ramp of commands by as much, or a second pole in place of one.

    Where steps of the commands are soft both predict nearly the same, and small steps do not lead from none of one to
    all of the other.

    Args:
        effect: to translate.

    Returns:
        None for other effects, for motors that are quicker than the nominal ones, and where the turning alone is late.
    """
    if isinstance(effect, MotorLag) and effect.lag > 0.0 and not effect.turning:
        return CommandDelay(min(effect.lag, CommandDelay.parameter("delay").metadata["high"]))
    if isinstance(effect, CommandDelay) and effect.delay > 0.0:
        return MotorLag(effect.delay, 1.0)
    return None


def _handed_over(point: Point, place: int, effects: tuple[Effect, ...]) -> Point:
    """A point with effects in place of what a nuisance did, which is back at its nominal value."""
    values = point.values.copy()
    values[place] = 0.0
    return replace(point, values=values, effects=effects)


def with_whole_delay(problem: Problem, point: Point) -> Point:
    """The same predictions with all of a dead time in the effect, none in the nuisance that shifts the commands.

    Both are one time, so that no step leads from one split to another; by its prior the shift is none, and only the
    effect goes on to other drives.

    Args:
        problem: with the nuisances.
        point: where no delay is assumed, or the whole is longer than one may be, it stays as it is.
    """
    place = [parameter.name for parameter in problem.nuisances.parameters].index("command_shift")
    shift = float(point.values[place])
    longer = [_later(effect, shift) if isinstance(effect, CommandDelay) else None for effect in point.effects]
    if shift <= 0.0 or not any(longer):
        return point
    return _handed_over(point, place, tuple(a or b for a, b in zip(longer, point.effects, strict=True)))


def with_whole_lag(problem: Problem, point: Point) -> Point | None:
    """The same predictions with all of a slower answer in motor_lag, the motors' rate back at its nominal value.

    A lag l with the share p in a second pole and a rate k are two time constants, 1/k + (1 - p) l and p l: k and l are
    split by the rate's prior alone. Finite differences to both are wrong by a little of what they have in common, which
    looks like knowledge of the split, so that a fit ends far from the prior.

    Args:
        problem: with the nuisances.
        point: fitted.

    Returns:
        None where no lag is assumed, the rate is no nuisance or has not moved, or no lag says the same.
    """
    names = [parameter.name for parameter in problem.nuisances.parameters]
    if "motor_rate" not in names or point.values[place := names.index("motor_rate")] == 0.0:
        return None
    later = math.expm1(-float(point.values[place])) / problem.robot.motor_rate
    whole = [_longer(effect, later) if isinstance(effect, MotorLag) else None for effect in point.effects]
    if not any(whole):
        return None
    return _handed_over(point, place, tuple(a or b for a, b in zip(whole, point.effects, strict=True)))


def _longer(motors: MotorLag, later: float) -> MotorLag | None:
    """Motors whose loop is slower by some time, with the same second pole; None where no lag says that."""
    second, lag = motors.second_pole * max(motors.lag, 0.0), motors.lag + later
    data = MotorLag.parameter("lag").metadata
    if motors.turning or not (data["low"] <= lag <= data["high"] and 0.0 <= second <= max(lag, 0.0)):
        return None
    return MotorLag(lag, second / lag if lag > 0.0 else 0.0, motors.slowing)


def _later(delay: CommandDelay, shift: float) -> CommandDelay | None:
    """A delay of both banks that is longer by a shift; None where there is none yet, or more than there may be."""
    if delay.delay <= 0.0:
        return None
    whole = delay.delay + shift
    imbalance = delay.imbalance * delay.delay / whole
    fits = whole * (1.0 + abs(imbalance)) <= delay.parameter("delay").metadata["high"]
    return CommandDelay(whole, imbalance) if fits else None
