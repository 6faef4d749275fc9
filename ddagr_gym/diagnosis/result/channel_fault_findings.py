"""What the channels of recordings say against each other, in the answer of a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ddagr_gym.diagnosis.answer.verdict import NONE, UNKNOWN, Diagnosis, Estimate, Finding
from ddagr_gym.diagnosis.preprocessing.channel_faults import ChannelFault
from ddagr_gym.diagnosis.preprocessing.mended_recordings import MendedRecordings
from ddagr_gym.diagnosis.preprocessing.repeated_readings import RepeatedReadings, hold_effect
from ddagr_gym.diagnosis.result.sentences import change_headline
from ddagr_gym.recordings.checks.findings import CheckFinding

LONGER = 1.5
"""Times as long as before for which a reading must be repeated to be a change (ours): holds jitter."""

STAMP = 1e-3
"""How well stamps tell a duration [s] (ours)."""


def channel_fault_findings(faults: Sequence[ChannelFault]) -> list[Finding]:
    """Readings in the wrong channels need no fit: how sure they are is the evidence."""
    return [
        Finding(
            fault.name, dict(fault.sizes), 0.5 * fault.score**2, 0.0, fault.score, 0.5 * fault.score**2,
            {channel: 1.0 / len(fault.takes) for channel in fault.takes}, {fault.name: 1.0},
        )
        for fault in faults
    ]  # fmt: skip


def repeat_findings(repeated: Sequence[RepeatedReadings]) -> list[Finding]:
    """Repeated readings need no fit: the share of repeats is the evidence, and its own score."""
    if not repeated:
        return []
    effect = hold_effect(repeated)
    parameters = {
        name: Estimate(float(getattr(effect, name)), str(effect.parameter(name).metadata["unit"]))
        for name in ("duration", "accelerometer", "gyro", "encoders", "pose")
    }
    repeats = sum(item.share * item.samples for item in repeated)
    return [Finding("sensor_hold", parameters, repeats, 0.0, repeats**0.5, repeats, {}, {"sensor_hold": 1.0})]


def new_holds(mended: MendedRecordings, usual: Mapping[str, float] | None) -> tuple[RepeatedReadings, ...]:
    """Sensors that repeat their readings for longer than in ordinary drives; none where that is not known.

    Args:
        mended: drives that are compared.
        usual: time for which readings are repeated in those that they are compared with, by sensor [s].
    """
    if usual is None:
        return ()
    return tuple(item for item in mended.held if item.duration > LONGER * usual.get(item.sensor, 0.0) + STAMP)


def with_new_faults(
    diagnosis: Diagnosis,
    mended: MendedRecordings,
    before: MendedRecordings | None = None,
    holds: Sequence[RepeatedReadings] = (),
) -> Diagnosis:
    """The answer of a comparison with ordinary drives, with what is wrong with the channels named first.

    Args:
        diagnosis: of the mended drives.
        mended: the drives.
        before: those that they are compared with, whose faults are no change; None where they are not at hand.
        holds: sensors that repeat their readings for longer than usual.
    """
    usual = () if before is None else before.names
    faults = [fault for fault in mended.channel_faults if fault.name not in usual]
    known = {(item.check, item.channel) for item in (() if before is None else before.contradictions)}
    new = tuple(item for item in mended.contradictions if (item.check, item.channel) not in known)
    seen = [*channel_fault_findings(faults), *repeat_findings(holds)]
    if seen and diagnosis.change is not None:
        findings = (*seen, *diagnosis.findings)
        names = tuple(name for name in diagnosis.verdict if name not in (NONE, UNKNOWN))
        verdict = (*(finding.name for finding in seen), *names)
        sentence = change_headline(verdict, diagnosis.complete, findings, diagnosis.change)
        diagnosis = replace(diagnosis, verdict=verdict, findings=findings, sentence=sentence)
    return with_contradictions(diagnosis, new)


def with_contradictions(diagnosis: Diagnosis, contradictions: Sequence[CheckFinding]) -> Diagnosis:
    """An answer that says first where channels still contradict each other; it is not the whole truth then.

    Args:
        diagnosis: the answer.
        contradictions: between channels; what a name of the verdict explains is none.
    """
    left = unexplained(contradictions, diagnosis.verdict)
    if not left:
        return diagnosis
    said = dict.fromkeys(f"{finding.meaning} {finding.remedy}".strip() for finding in left)
    sentence = (
        f"The recordings contradict themselves, and no name is sure before that is mended: {' '.join(said)} "
        f"As they are: {diagnosis.sentence}"
    )
    return diagnosis.doubted("contradictions", sentence)


def unexplained(contradictions: Sequence[CheckFinding], verdict: Sequence[str]) -> tuple[CheckFinding, ...]:
    """Contradictions that no name of a verdict would explain."""
    return tuple(finding for finding in contradictions if not set(finding.suspects) & set(verdict))
