"""Equivalent parameterisations of a nuisance or of another rival, which the linear scan cannot find."""

from __future__ import annotations

from dataclasses import replace

from ddagr_gym.diagnosis.search.initial_guess import looped_encoders, off_centre_load, slower_loop
from ddagr_gym.diagnosis.search.scanned_model import Rival, ScannedModel, rival_of
from ddagr_gym.identification.gauss_newton import Fitted, fit
from ddagr_gym.identification.nuisances import LEAD
from ddagr_gym.identification.problem import Problem
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.centre_of_mass_offset import CentreOfMassOffset
from ddagr_gym.physics.effects.multipass import Multipass
from ddagr_gym.physics.effects.payload import Payload

TRIAL_STEPS = 3
"""Gauss-Newton steps after which a rival is judged (ours: each costs a simulation per size)."""

_SECOND_SIZE = 0.05
"""Share of the gain by which a rival with one more size must exceed the rival that predicts the same (ours)."""


def with_slower_loop(problem: Problem, model: ScannedModel, tried: list[Rival]) -> list[Rival]:
    """Rivals and, where the refitted speed loop is far from the nominal one, motor_lag in its stead."""
    point = slower_loop(problem, model.fitted.point)
    if point is None:
        return tried
    fitted = fit(problem, point, iterations=TRIAL_STEPS, renewals=2, reuse=model.fitted)
    return _beside(tried, rival_of(model, "motor_lag", fitted))


def with_looped_encoders(problem: Problem, model: ScannedModel, tried: list[Rival]) -> list[Rival]:
    """Rivals and, beside uneven radii, encoders that the speed loop believes; they fit as well and have a size more."""
    radii = next((rival for rival in tried if rival.name == "wheel_radius_mismatch"), None)
    point = None if radii is None else looped_encoders(radii.fitted.point)
    if radii is None or point is None:
        return tried
    looped = rival_of(model, "encoder_scale", fit(problem, point, iterations=TRIAL_STEPS, reuse=radii.fitted))
    return _beside(tried, _behind(looped, radii))


def with_off_centre_load(problem: Problem, model: ScannedModel, tried: list[Rival]) -> list[Rival]:
    """Rivals and, beside an offset centre of mass that explains most, a load that shifts it as much.

    Every load that is not at the centre shifts the centre of mass; how much mass there is, drives hardly tell.
    """
    best = max(tried, key=lambda rival: rival.gain, default=None)
    if best is None or best.name != CentreOfMassOffset.name:
        return tried
    point = off_centre_load(problem.robot, best.fitted.point)
    if point is None:
        return tried
    load = rival_of(model, Payload.name, fit(problem, point, iterations=TRIAL_STEPS, renewals=2, reuse=best.fitted))
    return _beside(tried, _behind(load, best))


def with_turning_centre(problem: Problem, model: ScannedModel, raw: Fitted, tried: list[Rival]) -> list[Rival]:
    """Rivals and, where no place in the contact explains the turning centre, what else moves it along the robot.

    The lead of the side slip then stands at its bound, and soil and robot are bent beside it, so far that the scan may
    not show the truth: the others begin at the raw nominal model.

    Args:
        problem: what to fit.
        model: the model so far.
        raw: the nominal model with its sensitivities.
        tried: rivals.
    """
    names = [parameter.name for parameter in problem.nuisances.parameters]
    if LEAD not in names or names.index(LEAD) in problem.open_at(model.fitted.point):
        return tried
    forward = 1.0 if model.fitted.point.values[names.index(LEAD)] > 0.0 else -1.0
    least = CentreOfMassOffset.parameter("x").metadata["least"]
    movers: tuple[Effect, ...] = (CentreOfMassOffset(x=forward * least), Multipass(forward * 0.2))
    named = {effect.name for effect in model.fitted.point.effects}
    for mover in movers:
        if mover.name not in named:
            point = replace(raw.point, effects=(*model.fitted.point.effects, mover))
            moved = fit(problem, point, iterations=TRIAL_STEPS, renewals=2, first=raw)
            tried = _beside(tried, rival_of(model, mover.name, moved))
    return tried


def _behind(told: Rival, first: Rival) -> Rival:
    """A rival with one more size that predicts the same as another, behind that one unless it is clearly better."""
    if told.gain - first.gain >= _SECOND_SIZE * first.gain:
        return told
    return replace(told, gain=min(told.gain, first.gain) * (1.0 - _SECOND_SIZE), equivalent=True)


def _beside(tried: list[Rival], further: Rival) -> list[Rival]:
    """Rivals with a further one, which takes the place of one of its name unless that one explains as much."""
    better = any(rival.name == further.name and rival.gain >= further.gain for rival in tried)
    return tried if better else [*(rival for rival in tried if rival.name != further.name), further]
