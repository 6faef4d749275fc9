"""All steps of a diagnosis in their order, each kept when it is finished.

checks of the data -> search -> verdict -> certification -> localisation -> unnamed terms -> next drive -> evidence
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ddagr_gym.diagnosis.certification.certificate import of_mended_readings, worse_on_unseen
from ddagr_gym.diagnosis.certification.certify import certify
from ddagr_gym.diagnosis.evidence import Evidence, gather_evidence
from ddagr_gym.diagnosis.gates.source_digest import source_digest
from ddagr_gym.diagnosis.gates.thresholds import Thresholds
from ddagr_gym.diagnosis.localisation.localise import locate
from ddagr_gym.diagnosis.localisation.operating_condition_words import uneven_phrase
from ddagr_gym.diagnosis.localisation.operating_conditions import Unevenness
from ddagr_gym.diagnosis.planning.next_drive import next_drive, rivals_of_diagnosis, sensors_of_diagnosis
from ddagr_gym.diagnosis.preprocessing.data_checks import DataDoubt, data_doubts, dead_channels, suspects_of
from ddagr_gym.diagnosis.preprocessing.input_requirements import check_recordings, content_hash
from ddagr_gym.diagnosis.preprocessing.mended_recordings import Prepared, prepare
from ddagr_gym.diagnosis.preprocessing.repeat_spans import where_readings_repeat
from ddagr_gym.diagnosis.result.conclusion import accepted, conclude, searched
from ddagr_gym.diagnosis.result.sentences import (
    dead_in_words,
    headline,
    pushed_in_words,
    suspects_in_words,
    worse_in_words,
)
from ddagr_gym.diagnosis.result.size_bounds import pushed_to_bounds
from ddagr_gym.diagnosis.result.verdict import NONE, UNKNOWN, Diagnosis, as_mapping
from ddagr_gym.diagnosis.search.scanned_model import SearchResult
from ddagr_gym.diagnosis.setting import Setting
from ddagr_gym.diagnosis.store import StepStore
from ddagr_gym.diagnosis.unnamed.terms import unnamed_terms
from ddagr_gym.diagnosis.wording import in_sentence
from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.physics.effects import Effect
from ddagr_gym.recordings.schema import Recording

STEPS = ("checks", "search", "verdict", "certification", "localisation", "unnamed terms", "next drive", "evidence")
"""Names of the steps that are kept."""

LATER = ("certification", "unnamed terms", "next drive")
"""Those that ``names_only`` leaves out."""


WHOLE = 0.8
"""Share of the mismatch that complete findings explain at least (ours: in two opened sealed sets all complete and right
ones explain 0.99 or more, a patch in place of a disturbed compass 0.3)."""


@dataclass(frozen=True, eq=False)
class Task:
    """What is diagnosed, and how.

    Attributes:
        robot: nominal.
        soil: nominal.
        recordings: at least one, of one robot and period.
        thresholds: of the null bank.
        setting: choices.
        seed: of everything random.
        names_only: leave out certification, unnamed terms and the next drive.
        soil_name: of the nominal soil, for the report.
        robot_file: where the nominal robot came from, where that was a file.
    """

    robot: Robot
    soil: Soil
    recordings: tuple[Recording, ...]
    thresholds: Thresholds
    setting: Setting
    seed: int = 0
    names_only: bool = False
    soil_name: str = ""
    robot_file: str = ""

    @property
    def steps(self) -> tuple[str, ...]:
        """Those of STEPS that are done."""
        return tuple(name for name in STEPS if not (self.names_only and name in LATER))

    def key(self) -> str:
        """Hash of all that the results depend on; the number of threads is not among it."""
        digest = hashlib.sha256(source_digest().encode())
        for recording in self.recordings:
            digest.update(content_hash(recording).encode())
            digest.update(repr((recording.meta.source, recording.meta.segments, recording.meta.spans)).encode())
        setting = replace(self.setting, threads=1)
        texts = [repr(self.robot), repr(self.soil), repr(setting), asdict(self.thresholds), self.seed]
        digest.update(json.dumps(texts, sort_keys=True).encode())
        return digest.hexdigest()

    def rng(self, step: str) -> np.random.Generator:
        """Randomness of one step, the same whatever was done before it."""
        return np.random.default_rng([self.seed, *step.encode()])


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of a diagnosis.

    Attributes:
        diagnosis: the answer.
        effects: what it names, with fitted sizes.
        prepared: windows and model.
        found: by the search.
        evidence: what the page draws.
        nominal: robot and soil that were diagnosed.
    """

    diagnosis: Diagnosis
    effects: tuple[Effect, ...]
    prepared: Prepared
    found: SearchResult
    evidence: Evidence
    nominal: tuple[Robot, Soil]


def run(
    task: Task,
    store: StepStore | None = None,
    began_step: Callable[[str], None] = lambda name: None,
    progress: Callable[[str], None] = lambda text: None,
) -> Outcome:
    """Diagnose.

    Args:
        task: what and how.
        store: of finished steps; nothing is kept without one.
        began_step: called with the name of each of STEPS when it begins.
        progress: called with what is being done inside a step.

    Raises:
        InputError: recordings that cannot be diagnosed.
    """
    began = time.monotonic()
    store = StepStore(None, "") if store is None else store
    check_recordings(task.recordings, task.robot, task.setting)

    def step(name: str, work: Callable[[], Any]) -> Any:
        if name not in task.steps:
            return None
        began_step(name)
        return store.step(name, work)

    checks = step("checks", lambda: data_doubts(task.recordings, task.rng("checks")))
    nominal = (task.robot, task.soil, task.recordings)
    work = partial(searched, *nominal, task.thresholds, task.setting, progress, store.step)
    setting, found = step("search", work)
    prepared = prepare(*nominal, setting)
    task = replace(task, thresholds=task.thresholds.for_length(prepared.problem.covered))
    diagnosis, effects = step("verdict", lambda: conclude(prepared, found, task.thresholds, task.rng("verdict")))
    found = accepted(found, task.thresholds)
    fit = step("certification", lambda: _certified(task, prepared, found, progress))
    where = step("localisation", lambda: asdict(locate(prepared.problem, found, task.thresholds.misfit)))
    held = where_readings_repeat(task.recordings, prepared.held)
    diagnosis = _doubted(diagnosis, where, {} if held is None else {"sensor_hold": asdict(held)}, fit, checks)
    unnamed = step("unnamed terms", lambda: _unnamed(task, prepared, found, diagnosis))
    following = step("next drive", lambda: _next_drive(task, setting, diagnosis, progress))
    evidence = step("evidence", lambda: gather_evidence(prepared.problem, found, task.thresholds))
    seconds = time.monotonic() - began
    entries = {"fit": fit, "localisation": where, "unnamed": unnamed, "next_drive": following, "checks": checks}
    diagnosis = replace(
        diagnosis,
        robot=task.robot.name,
        soil=task.soil_name,
        options=_options(task, setting),
        seconds=seconds,
        **entries,
    )
    return Outcome(diagnosis, effects, prepared, found, evidence, (task.robot, task.soil))


def _options(task: Task, setting: Setting) -> dict[str, Any]:
    """Choices that the answer depends on besides data, robot, soil and thresholds; windows as they were searched."""
    windows = {"window": setting.duration, "stride": setting.stride, "block": setting.block}
    choices = {"priors": asdict(setting.priors), "seed": task.seed, "names_only": task.names_only}
    return {**windows, **choices, **({"robot_file": task.robot_file} if task.robot_file else {})}


def _doubted(
    diagnosis: Diagnosis,
    where: Mapping[str, Any],
    held: Mapping[str, Any],
    fit: Mapping[str, Any] | None = None,
    checks: Sequence[DataDoubt] = (),
) -> Diagnosis:
    """Findings with their places, and what speaks against them.

    The verdict is not the whole truth where a size is not the same everywhere or at the bound of what exists, where
    much of the mismatch is left, where drives that nothing was fitted to are certainly predicted worse with it, or
    where a channel is dead. Where nothing has a name, the sentence has the effects that the checks of the recordings
    suspect.
    """
    located = {**where["findings"], **held}
    findings = tuple(replace(f, where=located.get(f.name)) for f in diagnosis.findings)
    doubts = [
        uneven_phrase(Unevenness(**f.where["uneven"]), f"the size of {in_sentence(f.name)}")
        for f in findings
        if f.where is not None and f.where.get("uneven") is not None
    ]
    doubts += [pushed_in_words(**vars(pushed)) for pushed in pushed_to_bounds(findings)]
    worse = worse_on_unseen(fit) if findings else None
    if worse is not None:
        doubts.append(worse_in_words(**worse))
    dead = dead_channels(checks)
    silent = [dead_in_words(dead)] if dead else []
    nameless = diagnosis.verdict in ((NONE,), (UNKNOWN,))
    doubts = silent if nameless else [*doubts, *silent]
    # what was seen in the values is mended in all models: its share is not known
    share = where["explained"] if any(f.gate > 0.0 for f in findings) else None
    whole = diagnosis.complete and (share is None or share >= WHOLE)
    suspects = suspects_of(checks) if nameless else ()
    remarks = [suspects_in_words(suspects)] if suspects else []
    sentence = headline(diagnosis.verdict, whole, findings, share, [*doubts, *remarks])
    return replace(diagnosis, findings=findings, complete=whole and not doubts, sentence=sentence)


def _unnamed(task: Task, prepared: Prepared, found: SearchResult, diagnosis: Diagnosis) -> Mapping[str, Any] | None:
    """Terms without a name, where names do not explain everything."""
    if diagnosis.complete:
        return None
    return unnamed_terms(prepared.problem, found.chosen, task.rng("unnamed terms")).as_mapping()


def _next_drive(
    task: Task, setting: Setting, diagnosis: Diagnosis, progress: Callable[[str], None]
) -> Mapping[str, Any]:
    """The drive that would tell what is left open apart; without one, why there is none."""
    mapping = as_mapping(diagnosis)
    sensors = sensors_of_diagnosis(mapping)
    try:
        rivals = rivals_of_diagnosis(mapping)
        return next_drive(
            task.robot,
            task.soil,
            rivals,
            sensors=sensors,
            seed=task.seed,
            setting=setting,
            progress=progress,
        )
    except InputError as error:
        return {"manoeuvre": "", "why": str(error), "separates": [], "power": 0.0, "minutes": None, "alternatives": []}


def _certified(
    task: Task, prepared: Prepared, found: SearchResult, progress: Callable[[str], None]
) -> Mapping[str, Any]:
    """Errors of the models; one that names nothing has no corrected model of its own."""
    fit = certify(
        prepared.problem,
        found.nominal.fitted,
        found.chosen.fitted,
        task.robot,
        prepared.recordings,
        task.rng("certification"),
        progress,
    )
    mended = prepared.held or prepared.flipped is not None
    return of_mended_readings(fit, named=bool(found.chosen.names)) if mended else fit


def effect_intervals(diagnosis: Diagnosis) -> Sequence[Mapping[str, tuple[float, float]]]:
    """Intervals of the named effects' parameters, in the order of the findings."""
    return [
        {name: e.interval for name, e in finding.parameters.items() if e.interval is not None}
        for finding in diagnosis.findings
    ]


def data_hash(diagnosis: Diagnosis) -> str:
    """SHA-256 over the hashes of the recordings."""
    return hashlib.sha256("".join(source.sha256 for source in diagnosis.data).encode()).hexdigest()
