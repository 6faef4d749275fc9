"""Where the mismatch is: channels, stretches of time, operating conditions, places, and the force that is missing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.location import (
    ChannelShare,
    EffectLocation,
    Localisation,
    OperatingConditionShare,
    Place,
    WrenchSummary,
)
from ddagr_gym.diagnosis.localisation.effect_timeline import (
    ScoreProcess,
    by_piece,
    piece_length,
    pieces_of,
    spans,
    time_share,
)
from ddagr_gym.diagnosis.localisation.mismatch_traces import MismatchTraces
from ddagr_gym.diagnosis.localisation.operating_condition_words import phrase_of, uneven_phrase
from ddagr_gym.diagnosis.localisation.operating_conditions import Pieces, shares, uneven
from ddagr_gym.diagnosis.localisation.residual_wrench import COMPONENTS, ResidualWrench
from ddagr_gym.diagnosis.preprocessing.session import DiagnosisSession
from ddagr_gym.diagnosis.search.scanned_model import SearchResult
from ddagr_gym.identification.misfit import explained_share
from ddagr_gym.identification.nuisances import LOCAL
from ddagr_gym.identification.problem import Problem
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.physics.effects import Effect

Array = NDArray[np.float64]

_SEED = 20240
"""Added to the seed of the diagnosis for the shifts in the tests of operating conditions (ours: any number does)."""

_ROUGH = 1.25
"""Mean square of the standardised residuals from which a channel's squares are located (ours: windows take 10 to 20
percent of the squares away, and noise is known to about as much)."""

_PLACE = ("centre_x", "centre_y", "radius")
_LINE = ("half_length", "bearing")


def locate(session: DiagnosisSession, found: SearchResult, traces: MismatchTraces) -> Localisation:
    """Locate what a search found, and what it left.

    Args:
        session: of the diagnosis.
        found: of the search; nominal and chosen model may be the same.
        traces: of its models along the drives.
    """
    problem, pieces, seed, nominal, chosen = session.problem, traces.pieces, session.seed, found.nominal, found.chosen
    channels = channel_shares(nominal.misfit, chosen.misfit, samples(problem))
    located = {
        process.name: _where(problem, process, effect, pieces, chosen.dispersion, seed)
        for process, effect in zip(traces.processes, chosen.fitted.point.effects, strict=True)
    }
    before, after = traces.nominal**2, traces.chosen**2
    return Localisation(
        channels,
        explained_share(nominal.misfit, chosen.misfit, session.gates.misfit),
        _lying(by_piece(before - after, pieces_of(problem)).ravel(), pieces, seed)
        if located
        else _mismatch(problem, before, rough(nominal.misfit), pieces, seed),
        _mismatch(problem, after, rough(chosen.misfit), pieces, seed),
        located,
        _summaries(traces.wrench),
    )


def rough(misfit: Mapping[str, float]) -> list[str]:
    """Channels whose mean square stands so far above that of noise that it can be said where."""
    return [name for name, value in misfit.items() if name in CHANNELS and value > _ROUGH]


def samples(problem: Problem) -> dict[str, float]:
    """Block means of each channel, and windows of each local variation."""
    count = problem.blocked.by_channel(problem.blocked.mask).sum(axis=(0, 1))
    found = {name: float(count[k]) for k, name in enumerate(CHANNELS) if count[k] > 0}
    return found | dict.fromkeys(LOCAL, float(problem.blocked.windows.count))


def channel_shares(
    nominal: Mapping[str, float], chosen: Mapping[str, float], count: Mapping[str, float]
) -> dict[str, ChannelShare]:
    """Shares of the channels in the mismatch above the noise.

    The floor of a channel is 1, the mean square of pure noise, or what the chosen model leaves where that is less
    (ours: noise is estimated with a margin, and the windows' unknowns take a share of it away).

    Args:
        nominal: mean square of the standardised residuals by channel.
        chosen: the same of the chosen model.
        count: block means of each channel.
    """
    floors = {name: min(1.0, chosen[name]) for name in nominal}
    above = {name: count[name] * max(nominal[name] - floors[name], 0.0) for name in nominal}
    total = sum(above.values())
    share = {name: above[name] / total if total > 0.0 else 0.0 for name in nominal}
    return {name: ChannelShare(nominal[name], chosen[name], floors[name], share[name]) for name in nominal}


def _where(
    problem: Problem,
    process: ScoreProcess,
    effect: Effect,
    pieces: Pieces,
    dispersion: float,
    seed: int,
) -> EffectLocation:
    """Where one effect of the chosen model acts."""
    rng = np.random.default_rng(_SEED + seed)
    windows, piece = problem.blocked.windows, piece_length(problem)
    shown = spans(process, windows.recording, windows.time, piece, windows.duration, dispersion)
    lying = shares(process.gain.ravel(), pieces, rng)
    window = np.repeat(np.arange(windows.count), process.gain.shape[1])
    other = uneven(process.remainder.ravel(), process.information.ravel(), window, pieces, rng)
    places = _fitted_place(effect) or _standing_place(lying)
    covered = time_share(shown, windows.count, windows.duration)
    phrase = phrase_of(lying, _fitted_place(effect), covered)
    if other is not None:
        phrase = f"{phrase}; {uneven_phrase(other)}"
    return EffectLocation(shown, covered, lying, places, other, phrase)


def _fitted_place(effect: Effect) -> tuple[Place, ...]:
    """Centre and radius of an effect that has them, and the middle line of one that may be long."""
    values = effect.as_mapping()["parameters"]
    if not set(_PLACE) <= set(values):
        return ()
    line = {name: float(values[name]) for name in _LINE if name in values}
    return (Place(*(float(values[name]) for name in _PLACE), **line),)


def _standing_place(lying: Sequence[OperatingConditionShare]) -> tuple[Place, ...]:
    """The disc that stands out, if that is what stands out."""
    if not lying or lying[0].name != "place" or not lying[0].stands_out:
        return ()
    x, y, radius = lying[0].edges
    return (Place(x, y, radius, lying[0].weight_inside, lying[0].time_inside),)


def _mismatch(problem: Problem, squares: Array, channels: Sequence[str], pieces: Pieces, seed: int) -> EffectLocation:
    """Where squared residuals (W, B, 8) exceed those of pure noise, in the channels that do so on the whole."""
    nothing = EffectLocation((), 0.0, (), (), None, "nothing above the noise")
    chosen = [CHANNELS.index(name) for name in channels]
    if not chosen:
        return nothing
    above = (squares - np.isfinite(problem.blocked.sigma))[..., chosen]
    return _lying(by_piece(above, pieces_of(problem)).ravel(), pieces, seed)


def _lying(weight: Array, pieces: Pieces, seed: int) -> EffectLocation:
    """Where a weight of the pieces lies, without spans."""
    lying = shares(weight, pieces, np.random.default_rng(_SEED + seed))
    return EffectLocation((), 0.0, lying, _standing_place(lying), None, phrase_of(lying))


def _summaries(wrench: ResidualWrench) -> tuple[WrenchSummary, ...]:
    """Means over all windows."""
    summaries = []
    for k, (component, unit) in enumerate(COMPONENTS):
        precision = wrench.deviation[:, k] ** -2
        before, after = (float(v[:, k] @ precision / precision.sum()) for v in (wrench.before, wrench.after))
        chi = [float(np.sqrt(np.mean(v[:, k] ** 2 * precision))) for v in (wrench.before, wrench.after)]
        summaries.append(WrenchSummary(component, unit, before, after, float(precision.sum() ** -0.5), chi[0], chi[1]))
    return tuple(summaries)
