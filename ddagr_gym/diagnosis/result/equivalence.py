"""What else it could be: rivals that the same windows may mean, with weights."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.result.uncertainty import DRAWS
from ddagr_gym.diagnosis.search.scanned_model import Rival, SearchResult
from ddagr_gym.identification.size_prior import implausibility

Array = NDArray[np.float64]

LEAST_WEIGHT = 0.05
"""Weight that a rival needs to stand in the equivalence set (ours, with the level)."""


_NOTHING = 1e-12
"""Gain below which there is nothing but rounding."""

FORM = 0.08
"""Share of its gain that an effect may lose because the library's form of it is not the robot's (ours)."""


APART = math.log(19.0)
"""Lead in cost, in units of :func:`unit_of_cost`, at which the wrong one of two names keeps a weight of 5 percent."""


def unit_of_cost(gain: float, form: float = FORM) -> float:
    """What a difference of cost over the dispersion counts in (theory: diagnosis, eq. (9)).

    Args:
        gain: of the best explanation.
        form: share of it that its form may lose.
    """
    return max(form * gain, 1.0)


def runs_apart(lead: float, gain: float) -> float:
    """Repetitions of a drive after which the wrong one of two names keeps a weight of 5 percent (with sizes as usual).

    Lead and gain grow alike with them: infinite where the lead is less than the library's form of the right name may
    lose.

    Args:
        lead: gain of the right name over the wrong one in one drive.
        gain: all that the right name gains in it.
    """
    if lead <= _NOTHING or lead < APART * FORM * gain:
        return math.inf
    return APART / lead


def equivalence_weights(
    rivals: Sequence[Rival],
    dispersion: float,
    rng: np.random.Generator,
    form: float = FORM,
    choices: Mapping[str, int] | None = None,
) -> dict[str, float]:
    """Weight of each rival as the better explanation, averaged over resamplings of the windows.

    Theory: diagnosis, eq. (9).

    In a resampling a joint refit has the weight exp(-cost/dispersion) over the sum of all: two that explain the same
    share it equally even where one is always ahead by a little. The library's form of an effect is not the robot's:
    differences of cost count in units of a share of what the best explains, where that is more than 1.

    Args:
        rivals: joint refits of one step of the search, best first.
        dispersion: of the model before.
        rng: of the resampling.
        form: that share.
        choices: by name, among how many forms of an effect the refitted one was chosen, each as likely before any data
            (1 where it is missing).

    Returns:
        Weights that add up to 1, of the first rival and of all with :data:`LEAST_WEIGHT`.
    """
    windows = np.stack([rival.fitted.window_cost for rival in rivals])
    priors = np.array([rival.fitted.cost for rival in rivals]) - windows.sum(axis=1)
    chosen = np.log([(choices or {}).get(rival.name, 1) for rival in rivals])
    unusual = chosen + [implausibility(rival.fitted.point.effects[-1]) for rival in rivals]
    count = windows.shape[1]
    counts = rng.multinomial(count, np.full(count, 1.0 / count), size=DRAWS).astype(float)
    costs = (counts @ windows.T + priors) / dispersion / unit_of_cost(rivals[0].gain, form) + unusual
    relative = np.exp(costs.min(axis=1, keepdims=True) - costs)
    weights = (relative / relative.sum(axis=1, keepdims=True)).mean(axis=0)
    kept = {
        rival.name: float(weight)
        for number, (rival, weight) in enumerate(zip(rivals, weights, strict=True))
        if number == 0 or weight >= LEAST_WEIGHT
    }
    total = sum(kept.values())
    return {name: weight / total for name, weight in kept.items()} if total > 0.0 else {rivals[0].name: 1.0}


def equivalents(found: SearchResult, name: str, rng: np.random.Generator) -> dict[str, float]:
    """Names that explain nearly as much as one that was chosen, with their weights.

    The step that chose it counts: in an earlier one it may have stood beside an effect that became idle when it was
    added. An effect that the final model has besides it is no rival of it.

    Args:
        found: by the search.
        name: of an effect of the chosen model.
        rng: of the resampling.
    """
    tried = [
        (step, before)
        for step, before in zip(found.steps, found.models, strict=False)
        if name in [rival.name for rival in step]
    ]
    if not tried:
        return {name: 1.0}
    step, before = next((item for item in tried if item[0][0].name == name), tried[0])
    rivals = [rival for rival in step if rival.name == name or rival.name not in found.chosen.names]
    return equivalence_weights(sorted(rivals, key=lambda rival: rival.name != name), before.dispersion, rng)
