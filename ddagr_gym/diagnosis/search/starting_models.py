"""Where a search starts: the nominal model as it is and refitted, on windows in which a refit can succeed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from ddagr_gym.diagnosis.preprocessing.session import DiagnosisSession, be_silent
from ddagr_gym.diagnosis.setting import SHORT
from ddagr_gym.diagnosis.store import StepCache, compute_without_cache
from ddagr_gym.errors import InputError
from ddagr_gym.identification.gauss_newton import Fitted, fit
from ddagr_gym.identification.misfit import dispersion_of
from ddagr_gym.identification.problem import Problem
from ddagr_gym.parameters import Robot

FAR_OFF = 4.0
"""Dispersion of the refitted nominal model above which something large is missing: windows are then short, and the raw
model is scanned too (ours: residuals of twice the noise)."""


MOST_WINDOWS = 120
"""Short windows above which :data:`SOME_WINDOWS` of them are searched where the refitted nominal model is far off
(ours; three drives of 60 s have 90)."""

MANY_WINDOWS = 2 * MOST_WINDOWS
"""Windows of the set length above which :data:`SOME_WINDOWS` of them say first whether the nominal model is far off
(ours): with fewer that would take longer than it saves."""

SOME_WINDOWS = 60
"""Windows that stand for long drives there (ours): what is large shows in a few, and the time of a search does not grow
with the length of the drives. On a drive of ten minutes half of 120 named the same, in 0.6 times the time."""


FAST = 2.0
"""Rim speed of a robot [m/s] above which a model that is far off is simulated as coarsely as field drives allow (ours;
measured on a Warthog, 5 m/s): slow robots accelerate less, and errors of that simulation count more."""


@dataclass(frozen=True, eq=False)
class StartingModels:
    """Nominal models before any effect is assumed.

    Attributes:
        session: with the windows to search.
        raw: the nominal model before any fit, with its sensitivities.
        refitted: the same with refitted nuisances.
    """

    session: DiagnosisSession
    raw: Fitted
    refitted: Fitted


def starting_models(session: DiagnosisSession, cache: StepCache = compute_without_cache) -> StartingModels:
    """Nominal models on windows of the set length; on short ones where the refitted one is far off.

    What is large bends long predictions so much that no small step leads to it, and shows in short ones as well. Of
    long drives some of the windows say whether it is there. For a fast robot a coarse simulator says so, and serves the
    whole search where it is.

    Args:
        session: of the diagnosis.
        cache: of the refits.

    Raises:
        InputError: the nominal simulator breaks down on some window.
    """
    begun = session.as_far_off() if _is_fast(session.robot) else session
    some = _thinned(begun, MANY_WINDOWS)
    raw, refitted = _refitted(some, "search refit" if some is session else "search refit, some windows", cache)
    if dispersion_of(some.problem, refitted) > FAR_OFF and session.setting.duration > SHORT:
        short = begun.with_windows(SHORT, SHORT * session.setting.stride / session.setting.duration)
        session = _thinned(short, MOST_WINDOWS)
        # windows of drives in short segments are as short already
        if not _same_windows(session, some):
            session.progress("far off: again in short windows")
            raw, refitted = _refitted(session, "search refit, short windows", cache)
    elif some is not session:
        raw, refitted = _refitted(session, "search refit", cache)
    _check_predicted(session, refitted)
    return StartingModels(session, raw, refitted)


def _is_fast(robot: Robot) -> bool:
    return robot.maximum_wheel_speed * robot.outer_radius > FAST


def _same_windows(session: DiagnosisSession, other: DiagnosisSession) -> bool:
    """Whether two sessions of the same recordings fit the same samples."""
    here, there = session.problem.blocked.windows, other.problem.blocked.windows
    return here.samples == there.samples and all(
        np.array_equal(a, b) for a, b in ((here.recording, there.recording), (here.start, there.start))
    )


def _refitted(session: DiagnosisSession, name: str, cache: StepCache) -> tuple[Fitted, Fitted]:
    return cache(name, partial(refit_nominal, session.problem, session.progress))


def _thinned(session: DiagnosisSession, most: int) -> DiagnosisSession:
    """The same with :data:`SOME_WINDOWS`, farther apart, where there are more than ``most``."""
    count = session.problem.blocked.windows.count
    if count <= most:
        return session
    return session.with_windows(session.setting.duration, session.setting.stride * count / SOME_WINDOWS)


def refit_nominal(problem: Problem, progress: Callable[[str], None] = be_silent) -> tuple[Fitted, Fitted]:
    """The raw nominal model with its sensitivities, and the refitted one."""
    progress("refitting the nominal model")
    raw = fit(problem, iterations=0)
    return raw, fit(problem, raw.point, first=raw)


def _check_predicted(session: DiagnosisSession, refitted: Fitted) -> None:
    """A window that cannot be predicted has no residual, and nothing could be said of it."""
    failed = np.flatnonzero(~np.isfinite(refitted.window_cost))
    if failed.size:
        windows = session.problem.blocked.windows
        source = session.mended.recordings[int(windows.recording[failed[0]])].meta.source
        raise InputError(
            f"the nominal simulator breaks down in {failed.size} of {windows.count} windows, first at "
            f"{windows.time[failed[0]]:.1f} s of {source}: leave that stretch out, or give a --robot and --soil that "
            "are closer to the real ones."
        )
