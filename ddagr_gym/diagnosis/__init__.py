"""Which physics a nominal simulator leaves out, from recordings: where, what, how big, how sure, what else.

:func:`diagnose` is the entry point; :mod:`~ddagr_gym.diagnosis.pipeline` reads as the list of its stages. All of them
share one immutable :class:`~ddagr_gym.diagnosis.preprocessing.session.DiagnosisSession`.

Stages
    =================  ===============================================================================================
    ``preprocessing``  Refuses what cannot be diagnosed, mends what needs no model (repeated readings, a reversed
                       gyro), estimates the noise, and cuts windows.
    ``search``         Refits the nominal simulator, scans what each effect of the library would explain beside it,
                       and adds effects by joint refits while one passes its gate.
    ``gates``          Say how much an effect must explain to be named, from drives in which nothing is missing.
    ``null_bank``      Makes such drives with simulators of other structure, or takes real ordinary ones.
    ``result``         Turns the models of the search into a verdict, findings with intervals, and sentences.
    ``certification``  Fits the sizes to some recordings and predicts the others.
    ``localisation``   Says when, where and under which motion each effect shows.
    ``review``         Says what speaks against the verdict.
    ``unnamed``        Looks for an equation where names do not explain everything.
    ``planning``       Finds the drive that separates the explanations that are left.
    ``evidence``       Gathers the arrays behind the pictures.
    =================  ===============================================================================================

    ``answer`` has the types of the answer, which every stage may know, ``setting`` the choices, ``store`` keeps
    finished steps so that an interrupted diagnosis goes on, ``wording`` has the words of reports. Windows, noise,
    uncertain parameters and the fit itself are in :mod:`ddagr_gym.identification`.

Words
    *effect*           One kind of missing physics with sizes and shapes, of the library
                       (:mod:`ddagr_gym.physics.effects`).
    *nuisance*         What is uncertain without being missing: soil, robot, biases, clocks. Global ones are
                       parameters with priors; local ones differ from window to window and are eliminated by a QR
                       factorisation of each window.
    *cost*             Half the sum of squared residuals in units of the noise, priors included.
    *dispersion*       Mean square of the residuals of a model in units of the noise, at least 1.
    *gain*             Fall of the cost by an effect, over the dispersion of the model that it joins.
    *held-out gain*    The same on windows that the sizes were not fitted to.
    *null drive*       A drive in which nothing of the library is missing.
    *null bank*        Many null drives that went through the same refit and scan as a real drive.
    *gate*             Gain that an effect must exceed to be named: what null drives reach, with a margin.
    *misfit*           Mean square of the residuals of one channel; its limit comes from the null bank too.
    *rival*            A joint refit with one further effect that might be named instead of another.
    *equivalence set*  Names that explain nearly as much as the chosen one, weighted over resampled windows.

Two starts of a refit: where something large is missing, the nominal refit bends soil and robot to make up for it, up to
places from which no small step leads back; a joint refit from the raw nominal model finds the truth there.

Limits
    *Which* effects are named is decided on all recordings; only their sizes are certified on others. Mass hides behind
    soil strength in drives of this kind, and so does a drag along the speed: see ``detectable``. Which of two motor
    poles is the slower one is open, so that the lag of a second pole is shared out with the nuisance ``motor_rate``.
    Without poses the headings of several recordings are found where a slope shows them; a patch that they share is
    looked for as if all drives had begun at one place.

Conventions: SI units, radians, channels and states in the order of :mod:`ddagr_gym.identification.windows`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.pipeline import Outcome, diagnose

__all__ = ["Outcome", "diagnose"]


def __getattr__(name: str) -> Any:
    """The pipeline is imported when it is asked for, so that a stage alone stays light (PEP 562)."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from ddagr_gym.diagnosis import pipeline

    return getattr(pipeline, name)
