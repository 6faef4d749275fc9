"""The verdict of a diagnosis in which the drivetrain was asked for as a whole."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ddagr_gym.diagnosis.answer.drivetrain import PART_TITLES, DrivetrainAnswer
from ddagr_gym.diagnosis.answer.verdict import UNKNOWN, Diagnosis, Finding
from ddagr_gym.diagnosis.gates.thresholds import Thresholds
from ddagr_gym.diagnosis.preprocessing.session import DiagnosisSession
from ddagr_gym.diagnosis.result.conclusion import standing
from ddagr_gym.diagnosis.result.sentences import drivetrain_headline, headline
from ddagr_gym.diagnosis.search.scanned_model import ScannedModel, SearchResult, scan_model
from ddagr_gym.identification.gauss_newton import Fitted, fit
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.physics.effects import Effect

UNLIKE = 2.0
"""Misfit of an encoder over its limit from which the whole drivetrain is asked for, whatever the names explain (ours:
right names leave at most 1.3 in 154 simulated cases, a real robot's data sheet 2.6 and more)."""

EXPLAINED = 0.5
"""Share of the squared error of left-out wheel speeds from which a fitted drivetrain is an answer (ours: half, as the
names of the library have to explain where much is left; six real drives: 0.83 to 0.93)."""

LEAST_EXPLAINED = EXPLAINED / 2
"""Share that all parts together must explain of what was left out, for each of them to be tried (ours: half of what an
answer needs, since a part that is not there makes forecasts worse; trying all takes two thirds of the time)."""

TOGETHER = 2
"""Effects of the library that are looked for before the whole drivetrain is asked for (ours: two at once are as many as
the gates were chosen for; a third costs a quarter of the time)."""

DRIVETRAIN_GROUP = "commands and motors"
"""Group of the effects whose place in the completed simulator its drivetrain takes."""

ENCODERS = tuple(name for name in CHANNELS if name.startswith("encoder"))


def unlike_commands(model: ScannedModel, gates: Thresholds, in_common: Sequence[str] = ()) -> dict[str, float]:
    """Misfit of the encoders over their limits, by channel, beside a model; empty where none is too large.

    Args:
        model: of a search.
        gates: with the limits.
        in_common: names of effects that both banks have in common, any of which the model must have: a droop of the
            motors may leave as little.
    """
    shares = {name: model.misfit[name] / gates.misfit[name] for name in ENCODERS if gates.misfit.get(name, 0.0) > 0.0}
    missed = bool(in_common) and not set(in_common) & set(model.names)
    return shares if missed or max(shares.values(), default=0.0) > UNLIKE else {}


def drivetrain_is_missing(model: ScannedModel, gates: Thresholds) -> bool:
    """Whether two names leave the wheels so unlike their commands that a third one is not worth looking for.

    Args:
        model: of a search.
        gates: with the limits.
    """
    return len(model.names) >= TOGETHER and bool(unlike_commands(model, gates))


@dataclass(frozen=True, eq=False)
class CompletedNominal:
    """A nominal simulator with the drivetrain that recordings ask for.

    Attributes:
        robot: with the parts that it needs.
        soil: as it was fitted along.
        answer: parts, and what they are worth on what was left out.
        findings: one per part or sensor that is named.
        effects: that have no place in a robot: of sensors and of the gains of commands, named or not.
    """

    robot: Robot
    soil: Soil
    answer: DrivetrainAnswer
    findings: tuple[Finding, ...]
    effects: tuple[Effect, ...] = ()

    @property
    def meant(self) -> frozenset[str]:
        """Names of all effects that the findings may be: each of them would be in the simulator twice."""
        return frozenset(name for finding in self.findings for name in (finding.name, *finding.equivalence_set))


def is_an_answer(nominal: CompletedNominal) -> bool:
    """Whether a fitted drivetrain explains most of why the wheels do not follow their commands.

    Parts are chosen by whether forecasts get better with them, which says nothing of how much is left: something that
    no drivetrain has makes some part a little better than none.
    """
    return nominal.answer.explained >= EXPLAINED


def beside_completed(session: DiagnosisSession, refitted: Fitted, effects: Sequence[Effect]) -> SearchResult:
    """The completed simulator with those names that stood beside the one as it was given and stand beside this too.

    Effects of commands and motors are left out: the completed simulator has its own.

    Args:
        session: with the completed simulator.
        refitted: to the drives.
        effects: that stood before, in their order.
    """
    models = [scan_model(session.problem, refitted, session.progress)]
    for effect in (item for item in effects if item.group != DRIVETRAIN_GROUP):
        here = models[-1].fitted
        point = replace(here.point, effects=(*here.point.effects, effect))
        fitted = fit(session.problem, point, iterations=8, renewals=2, first=here)
        models.append(scan_model(session.problem, fitted, session.progress))
    return standing(SearchResult(tuple(models)), session.gates)


def with_drivetrain(diagnosis: Diagnosis, nominal: CompletedNominal, misfit: Mapping[str, float]) -> Diagnosis:
    """A diagnosis beside a completed nominal simulator, with the names of what that one has more.

    What is left beside it has no name: its gates are those of simulated drives, which real ground and sensors exceed
    everywhere.

    Args:
        diagnosis: beside the completed simulator; what was seen in the values is named, and what stands by itself.
        nominal: the completed simulator.
        misfit: of the channels beside the simulator as it was given, refitted.
    """
    findings = (*(item for item in diagnosis.findings if item.name not in nominal.meant), *nominal.findings)
    names = tuple(finding.name for finding in findings) or (UNKNOWN,)
    complete = diagnosis.complete and bool(findings)
    parts = [PART_TITLES[name] for name in nominal.answer.names]
    others = [finding for finding in findings if finding.name not in nominal.answer.names]
    sentence = (
        drivetrain_headline(parts, others, nominal.answer.explained, complete)
        if parts
        else headline(names, complete, findings)
    )
    return replace(
        diagnosis,
        verdict=names,
        complete=complete,
        findings=findings,
        sentence=sentence,
        misfit={**diagnosis.misfit, "nominal": dict(misfit)},
        drivetrain=nominal.answer,
    )
