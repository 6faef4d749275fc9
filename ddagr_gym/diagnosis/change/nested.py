"""What contains a named effect: another one that does the same, and has one more size that drives hardly tell.

Encoders that a speed loop believes turn the wheels as unevenly as uneven radii let them roll, and both may be wrong by
the same share besides. A load that is not at the centre shifts the centre of mass, and is a mass besides.
"""

from __future__ import annotations

from collections.abc import Container

from ddagr_gym.diagnosis.change.model import Model
from ddagr_gym.diagnosis.search.equivalents import TRIAL_STEPS
from ddagr_gym.diagnosis.search.initial_guess import looped_encoders, off_centre_load
from ddagr_gym.diagnosis.search.scanned_model import Rival
from ddagr_gym.identification.gauss_newton import fit

AS_GOOD = 0.9
"""Share of a name's gain from which what contains it stands beside it (ours): both predict the same but for what the
library's forms of them differ by."""


def containing(
    before: Model, named: Model, rival: Rival, dispersion: float, known: Container[str] = ()
) -> Rival | None:
    """The effect that contains a named one, refitted; None where there is none, or where it explains less.

    Args:
        before: the model without the name.
        named: the model with it.
        rival: the refit of it.
        dispersion: of the model before.
        known: names that stand beside it anyway.
    """
    point, problem = rival.fitted.point, named.problem
    found = looped_encoders(point) or off_centre_load(problem.robot, point)
    if found is None or found.effects[-1].name in known:
        return None
    larger = found.effects[-1].name
    spells = {name: spell for name, spell in problem.spells.items() if name != larger}
    if rival.name in spells:
        spells[larger] = spells[rival.name]
    fitted = fit(problem.during(spells), found, iterations=TRIAL_STEPS, reuse=rival.fitted)
    gain = (before.fitted.cost - fitted.cost) / dispersion
    return Rival(larger, fitted, min(gain, rival.gain), equivalent=True) if gain >= AS_GOOD * rival.gain else None


def beside(weights: dict[str, float], name: str, larger: str) -> dict[str, float]:
    """Weights in which what contains a name weighs as much as the name: nothing tells them apart."""
    raised = {**weights, larger: weights[name]}
    return {other: weight / sum(raised.values()) for other, weight in raised.items()}
