"""What a search holds: fitted models with their scans, refits with one further effect, and its result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ddagr_gym.diagnosis.search.gains import Gain, gains, held_out_gains, scores
from ddagr_gym.diagnosis.search.inner_products import Terms
from ddagr_gym.diagnosis.search.scan import scan
from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.identification.misfit import channel_misfit, dispersion_of
from ddagr_gym.identification.problem import Problem


@dataclass(frozen=True, eq=False)
class ScannedModel:
    """A model and what the scan at it says about every effect that it lacks.

    Attributes:
        fitted: the model.
        terms: of the scan.
        gains: of absent effects over the dispersion, largest first.
        scores: cluster-robust, by name.
        held_out: gains on left-out windows over the dispersion, by name.
        dispersion: mean square of the weighted residuals of this model, at least 1.
        misfit: mean square of the residuals by channel.
    """

    fitted: Fitted
    terms: Terms
    gains: tuple[Gain, ...]
    scores: dict[str, float]
    held_out: dict[str, float]
    dispersion: float
    misfit: dict[str, float]

    @property
    def names(self) -> tuple[str, ...]:
        """Assumed effects."""
        return tuple(effect.name for effect in self.fitted.point.effects)


@dataclass(frozen=True, eq=False)
class Rival:
    """A joint refit with one further effect.

    Attributes:
        name: of the effect.
        fitted: the refit.
        gain: fall of the cost against the model before, over the dispersion.
        equivalent: whether it predicts the same as another rival with other parameters, so that no fit separates them.
    """

    name: str
    fitted: Fitted
    gain: float
    equivalent: bool = False


@dataclass(frozen=True, eq=False)
class SearchResult:
    """Result of a search.

    Attributes:
        models: from the nominal one to the chosen one.
        steps: refits of every step, best first; of the steps that added an effect, in the order of ``models[1:]``.
    """

    models: tuple[ScannedModel, ...]
    steps: tuple[tuple[Rival, ...], ...] = ()

    @property
    def nominal(self) -> ScannedModel:
        """The refitted nominal model."""
        return self.models[0]

    @property
    def chosen(self) -> ScannedModel:
        """The last model."""
        return self.models[-1]


def scan_model(problem: Problem, fitted: Fitted, progress: Callable[[str], None] = lambda text: None) -> ScannedModel:
    """Scan the library at a fitted model."""
    progress("scanning the library")
    terms = scan(problem, fitted)
    dispersion = dispersion_of(problem, fitted)
    found = tuple(gains(terms, dispersion=dispersion))
    held_out = held_out_gains(terms, dispersion)
    misfit = channel_misfit(problem, fitted)
    return ScannedModel(fitted, terms, found, scores(terms, found), held_out, dispersion, misfit)


def rival_of(model: ScannedModel, name: str, fitted: Fitted) -> Rival:
    """A refit beside the model before it."""
    return Rival(name, fitted, (model.fitted.cost - fitted.cost) / model.dispersion)
