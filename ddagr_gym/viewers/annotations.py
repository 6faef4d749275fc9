"""Findings of a diagnosis as stretches of drives with a text."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.verdict import Diagnosis, Finding
from ddagr_gym.diagnosis.result.soil_words import finding_in_words
from ddagr_gym.viewers.drive_traces import DriveTraces

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Annotation:
    """A stretch of a drive in which something was found.

    Attributes:
        finding: name of the effect or of the part of the drivetrain.
        text: what it is, with its size.
        drive: number of the recording, from 0.
        start: time of the recording [s].
        end: the same.
        located: whether the stretch was found; else it is the whole drive.
        share: of the finding's whole gain; None where it was not located.
    """

    finding: str
    text: str
    drive: int
    start: float
    end: float
    located: bool
    share: float | None = None

    @property
    def stretch(self) -> str:
        """The stretch in words."""
        if not self.located:
            return "in the whole drive"
        share = "" if self.share is None else f", {100.0 * self.share:.0f} % of its gain"
        return f"from {self.start:.1f} s to {self.end:.1f} s{share}"


def annotated(diagnosis: Diagnosis, drives: Sequence[DriveTraces]) -> tuple[Annotation, ...]:
    """Stretches of all findings, in the order of drives and time; the whole drives of one that was not located.

    Args:
        diagnosis: the answer.
        drives: that it is of.
    """
    found = [item for finding in diagnosis.findings for item in _of_finding(finding, drives)]
    return tuple(sorted(found, key=lambda item: (item.drive, item.start)))


def shows(time: Array, names: Sequence[str], found: Sequence[Annotation]) -> Array:
    """(N, F) 1 where a finding shows, else 0.

    Args:
        time: (N,) of one drive [s].
        names: (F,) of findings.
        found: annotations of that drive.
    """
    values = np.zeros((len(time), len(names)))
    for item in found:
        values[(time >= item.start) & (time <= item.end), names.index(item.finding)] = 1.0
    return values


def finding_names(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Names of all findings, each once."""
    return tuple(dict.fromkeys(item.name for item in diagnosis.findings))


def doubts(diagnosis: Diagnosis, drive: DriveTraces) -> tuple[str, ...]:
    """What the checks of the data say about one drive, or about all together.

    Args:
        diagnosis: the answer.
        drive: one of its drives.
    """
    source = drive.recording.meta.source
    return tuple(item.sentence for item in diagnosis.checks if item.recording in ("", source))


def _of_finding(finding: Finding, drives: Sequence[DriveTraces]) -> Iterator[Annotation]:
    text = finding_in_words(finding)
    spans = () if finding.where is None else finding.where.spans
    for span in spans:
        yield Annotation(finding.name, text, span.recording, span.start, span.end, True, span.share)
    if not spans:
        for number, drive in enumerate(drives):
            yield Annotation(finding.name, text, number, float(drive.recording.t[0]), drive.end, False)
