"""All stages of a diagnosis in their order, each kept when it is finished.

checks of the data -> search, once more with effects in a part of the drives where that explains more -> verdict ->
certification -> localisation and onsets -> unnamed terms -> next drive -> evidence
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import ParamSpec, TypeVar

from ddagr_gym.diagnosis.answer.evidence import Evidence
from ddagr_gym.diagnosis.answer.location import EffectLocation
from ddagr_gym.diagnosis.answer.verdict import DataDoubt, Diagnosis, Options
from ddagr_gym.diagnosis.certification.certify import certify
from ddagr_gym.diagnosis.evidence import gather_evidence
from ddagr_gym.diagnosis.gates.thresholds import Thresholds
from ddagr_gym.diagnosis.localisation.localise import locate
from ddagr_gym.diagnosis.localisation.mismatch_traces import trace_mismatch
from ddagr_gym.diagnosis.localisation.repeat_spans import where_readings_repeat
from ddagr_gym.diagnosis.mid_drive.again import onsets_of_names, search_in_parts
from ddagr_gym.diagnosis.mid_drive.onsets import with_onsets
from ddagr_gym.diagnosis.planning.drivetrain_drive import drivetrain_drive
from ddagr_gym.diagnosis.planning.next_drive import plan_next_drive
from ddagr_gym.diagnosis.preprocessing.data_checks import DoubtedBanks, data_doubts, doubted_banks
from ddagr_gym.diagnosis.preprocessing.mended_recordings import MendedRecordings
from ddagr_gym.diagnosis.preprocessing.session import DiagnosisSession, Progress, be_silent, prepare
from ddagr_gym.diagnosis.result.channel_fault_findings import with_contradictions
from ddagr_gym.diagnosis.result.conclusion import accept, conclude, standing
from ddagr_gym.diagnosis.result.drivetrain_names import (
    CompletedNominal,
    beside_completed,
    drivetrain_is_missing,
    is_an_answer,
    unlike_commands,
    with_drivetrain,
)
from ddagr_gym.diagnosis.review import review, with_dead_channels
from ddagr_gym.diagnosis.search.scanned_model import SearchResult
from ddagr_gym.diagnosis.search.starting_models import refit_nominal, starting_models
from ddagr_gym.diagnosis.search.stepwise import search
from ddagr_gym.diagnosis.setting import Setting
from ddagr_gym.diagnosis.store import StepStore
from ddagr_gym.diagnosis.unnamed.terms import unnamed_terms
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.slope import Slope
from ddagr_gym.recordings.schema import Recording

STEPS = ("checks", "search", "verdict", "certification", "localisation", "unnamed terms", "next drive", "evidence")
"""Names of the steps that are kept."""

LATER = ("certification", "unnamed terms", "next drive")
"""Those that ``names_only`` leaves out."""

OnStep = Callable[[str, bool], None]
"""Function that takes the name of a step that begins, and whether its result was kept from before."""

CompleteNominal = Callable[[Mapping[str, float], MendedRecordings, DoubtedBanks], CompletedNominal | None]
"""Function that fits the drivetrain of the nominal robot to recordings; takes the encoders' misfit over its limit, the
recordings, and what of the banks is in doubt.

None where the recordings cannot tell it. It is given from outside, since a calibration knows the stages of a diagnosis
and not the other way round."""

Inputs = ParamSpec("Inputs")
Result = TypeVar("Result")


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of a diagnosis.

    Attributes:
        diagnosis: the answer.
        effects: what it names, with fitted sizes.
        session: recordings, problem and gates.
        found: by the search, without the names that were not accepted.
        evidence: what the page draws.
    """

    diagnosis: Diagnosis
    effects: tuple[Effect, ...]
    session: DiagnosisSession
    found: SearchResult
    evidence: Evidence

    @property
    def nominal(self) -> tuple[Robot, Soil]:
        """Robot and soil that were diagnosed."""
        return self.session.robot, self.session.soil


@dataclass(frozen=True)
class Steps:
    """Does one step after the other: says that it begins, and computes it unless its result is kept.

    Attributes:
        store: of results.
        on_step: see :data:`OnStep`.
    """

    store: StepStore
    on_step: OnStep

    def begin(self, name: str) -> None:
        """Say that a step begins."""
        self.on_step(name, self.store.has(name))

    def keep(self, name: str, stage: Callable[Inputs, Result], *inputs: Inputs.args, **named: Inputs.kwargs) -> Result:
        """Result of a stage: the kept one, or that of ``stage(*inputs, **named)``, which is kept."""
        return self.store.step(name, lambda: stage(*inputs, **named))

    def run(self, name: str, stage: Callable[Inputs, Result], *inputs: Inputs.args, **named: Inputs.kwargs) -> Result:
        """The same for a step that is a single stage: says that it begins."""
        self.begin(name)
        return self.keep(name, stage, *inputs, **named)


def steps_of(names_only: bool) -> tuple[str, ...]:
    """Those of STEPS that a diagnosis does."""
    return tuple(name for name in STEPS if not (names_only and name in LATER))


def diagnose(
    recordings: Sequence[Recording],
    robot: Robot,
    soil: Soil,
    thresholds: Thresholds,
    setting: Setting,
    *,
    seed: int = 0,
    names_only: bool = False,
    soil_name: str = "",
    robot_file: str = "",
    complete_nominal: CompleteNominal | None = None,
    cache: Path | None = None,
    on_step: OnStep = lambda name, kept: None,
    progress: Progress = be_silent,
) -> Outcome:
    """Which physics the nominal simulator leaves out of recordings.

    Args:
        recordings: at least one, of one robot and period.
        robot: nominal.
        soil: nominal.
        thresholds: of the null bank.
        setting: windows, priors and threads.
        seed: of everything random.
        names_only: leave out certification, unnamed terms and the next drive.
        soil_name: of the nominal soil, for the report.
        robot_file: where the nominal robot came from, where that was a file.
        complete_nominal: fits the drivetrain where the wheels do not follow their commands as the nominal simulator
            says; None searches the library whatever they do.
        cache: folder of finished steps, from which the same diagnosis goes on after an interruption; it stays when
            all is done. None keeps nothing.
        on_step: called when a step begins.
        progress: called with what is being done inside a step.

    Raises:
        InputError: recordings that cannot be diagnosed, or a cache that holds something else.
    """
    began = time.monotonic()
    session = prepare(recordings, robot, soil, thresholds, setting, seed=seed, progress=progress)
    steps = Steps(StepStore(cache, "" if cache is None else session.key(), progress), on_step)
    checks = steps.run("checks", data_doubts, session.mended.given, session.rng("checks"))
    steps.begin("search")
    start = starting_models(session, steps.store.step)
    session = start.session
    found = steps.keep(
        "search", search, session, start, steps.store.step,
        lambda model: complete_nominal is not None and drivetrain_is_missing(model, start.session.gates),
    )  # fmt: skip
    spells, found = steps.keep("search in parts of the drives", search_in_parts, session, start, found)
    session = session.during(spells) if spells else session
    accepted = accept(found, session.gates)
    nominal = None
    if complete_nominal is not None:
        doubted = doubted_banks(session.mended.recordings, session.rng("checks"))
        unlike = unlike_commands(accepted.chosen, session.gates, doubted.common)
        nominal = complete_nominal(unlike, session.mended, doubted) if unlike else None
    if nominal is not None and is_an_answer(nominal):
        made = _beside_drivetrain(session, standing(found, session.gates), nominal, checks, names_only, steps)
    else:
        if nominal is not None:
            progress(f"a drivetrain explains {nominal.answer.explained:.0%} of the wheel speeds' errors: no answer")
        made = _by_library(session, found, accepted, checks, names_only, steps)
    answer = replace(
        made.diagnosis,
        checks=checks,
        robot=robot.name,
        soil=soil_name,
        options=_options(session, names_only, robot_file),
        seconds=time.monotonic() - began,
    )
    return replace(made, diagnosis=answer)


def _by_library(
    session: DiagnosisSession,
    found: SearchResult,
    accepted: SearchResult,
    checks: tuple[DataDoubt, ...],
    names_only: bool,
    steps: Steps,
) -> Outcome:
    """The answer by the effects of the library.

    Args:
        session: of the diagnosis.
        found: by the search.
        accepted: the same without the names that were not accepted.
        checks: of the data.
        names_only: leave out certification, unnamed terms and the next drive.
        steps: of the diagnosis.
    """
    diagnosis, effects = steps.run("verdict", conclude, session, found, accepted)
    fit = None if names_only else steps.run("certification", certify, session, accepted)
    steps.begin("localisation")
    traces = steps.keep("localisation traces", trace_mismatch, session, accepted)
    located = steps.keep("localisation", locate, session, accepted, traces)
    diagnosis = with_onsets(diagnosis, steps.keep("onsets", onsets_of_names, session, accepted))
    reviewed = review(diagnosis, located, _where_repeated(session), fit, checks)
    diagnosis = with_contradictions(reviewed, session.mended.contradictions)
    unnamed = None if names_only else steps.run("unnamed terms", unnamed_terms, session, accepted, diagnosis)
    following = None if names_only else steps.run("next drive", plan_next_drive, session, diagnosis)
    evidence = steps.run("evidence", gather_evidence, session, accepted, traces)
    answer = replace(diagnosis, fit=fit, localisation=located, unnamed=unnamed, next_drive=following)
    return Outcome(answer, effects, session, accepted, evidence)


def _where_repeated(session: DiagnosisSession) -> EffectLocation | None:
    mended = session.mended
    return where_readings_repeat(mended.given, mended.repeated, mended.left_out)


def _beside_drivetrain(
    given: DiagnosisSession,
    before: SearchResult,
    nominal: CompletedNominal,
    checks: Sequence[DataDoubt],
    names_only: bool,
    steps: Steps,
) -> Outcome:
    """The answer beside a nominal simulator whose drivetrain was fitted: its parts, and where something is left.

    Args:
        given: session with the nominal simulator as it was given.
        before: what stands by itself beside that one.
        nominal: the completed one.
        checks: of the recordings.
        names_only: leave out the next drive.
        steps: of the diagnosis.
    """
    session = given.with_nominal(nominal.robot, nominal.soil, nominal.effects)
    refitted = steps.keep("completed refit", refit_nominal, session.problem, session.progress)[1]
    found = steps.keep("completed scan", beside_completed, session, refitted, before.chosen.fitted.point.effects)
    diagnosis, effects = steps.run("verdict", conclude, session, found, found)
    diagnosis = with_onsets(diagnosis, steps.keep("onsets", onsets_of_names, session, found))
    diagnosis = with_drivetrain(diagnosis, nominal, before.nominal.misfit)
    steps.begin("localisation")
    traces = steps.keep("localisation traces", trace_mismatch, session, found)
    located = steps.keep("localisation", locate, session, found, traces)
    evidence = steps.run("evidence", gather_evidence, session, found, traces)
    others = [effect for effect in effects if effect.name not in nominal.meant]
    told = {effect.name: effect for effect in (*others, *nominal.effects)}
    places = {"sensor_hold": _where_repeated(session)}
    findings = tuple(replace(item, where=places.get(item.name, item.where)) for item in diagnosis.findings)
    following = None if names_only else drivetrain_drive(nominal.answer)
    located_too = replace(diagnosis, localisation=located, findings=findings, next_drive=following)
    diagnosis = with_contradictions(with_dead_channels(located_too, checks), session.mended.contradictions)
    return Outcome(diagnosis, tuple(told.values()), session, found, evidence)


def _options(session: DiagnosisSession, names_only: bool, robot_file: str) -> Options:
    """Choices that the answer depends on besides data, robot, soil and thresholds; windows as they were searched."""
    setting = session.setting
    return Options(
        window=setting.duration,
        stride=setting.stride,
        block=setting.block,
        priors=asdict(setting.priors),
        seed=session.seed,
        names_only=names_only,
        robot_file=robot_file or None,
    )


def effect_intervals(diagnosis: Diagnosis, effects: Sequence[Effect]) -> list[Mapping[str, tuple[float, float]]]:
    """Intervals of the parameters of effects, in their order; parts of a drivetrain have none.

    A slope on top of that of drives from before has none either: the finding's is that of the change.

    Args:
        diagnosis: with its findings.
        effects: that it names, and what drives from before had.
    """
    sloping = diagnosis.change is not None and diagnosis.change.slope is not None
    found = {item.name: item.parameters for item in diagnosis.findings if not (sloping and item.name == Slope.name)}
    return [
        {name: e.interval for name, e in found.get(effect.name, {}).items() if e.interval is not None}
        for effect in effects
    ]


def data_hash(diagnosis: Diagnosis) -> str:
    """SHA-256 over the hashes of the recordings."""
    return hashlib.sha256("".join(source.sha256 for source in diagnosis.data).encode()).hexdigest()
