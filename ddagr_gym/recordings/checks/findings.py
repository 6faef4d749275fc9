"""Findings of the checks: one per question, in words and in numbers.

JSON of a report (``schema_version`` 1)::

    {"schema_version": 1, "source": file name, "source_sha256": ..., "robot": ..., "rows": n, "seconds": duration,
     "verdict": "pass" | "suspicious", "sentences": [what Recording.validate() says],
     "findings": [{"check": family, "channel": ..., "status": "pass" | "suspicious" | "not_testable",
                   "value": number or null, "interval": [low, high] or null, "expected": [low, high] or null,
                   "unit": ..., "meaning": sentence, "remedy": sentence or "", "suspects": [effect names]}]}

Intervals are 99 % intervals over blocks of the drive. A quantity is suspicious when its whole interval lies outside
the expected range: noise alone may not accuse a sound recording.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any

from ddagr_gym.recordings.schema import Recording

REPORT_VERSION = 1
"""Of the JSON above; it changes whenever a field changes its meaning or goes."""

Interval = tuple[float, float]


class Status(StrEnum):
    """Outcome of one question."""

    PASS = "pass"
    SUSPICIOUS = "suspicious"
    NOT_TESTABLE = "not_testable"


@dataclass(frozen=True)
class CheckFinding:
    """Answer to one question about one channel or pair of channels.

    Attributes:
        check: family of checks ("clock_offset").
        channel: channel, or "a to b" for a pair.
        status: pass, suspicious or not testable.
        value: estimate [unit], None where there is none.
        interval: 99 % interval of the value [unit].
        expected: range in which the value counts as sound [unit].
        unit: of the three above.
        meaning: what the value says, one sentence.
        remedy: what to do, one sentence; "" for a pass.
        suspects: names of effects (diagnosis vocabulary) that would explain a suspicious value.
    """

    check: str
    channel: str
    status: Status
    meaning: str
    remedy: str = ""
    value: float | None = None
    interval: Interval | None = None
    expected: Interval | None = None
    unit: str = ""
    suspects: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Plain values; numbers that are not finite become null."""
        content = asdict(self)
        for key in ("value", "interval", "expected"):
            content[key] = _plain(content[key])
        return {**content, "status": str(self.status), "suspects": list(self.suspects)}


def _plain(value: float | Interval | None) -> Any:
    if value is None:
        return None
    if isinstance(value, tuple | list):
        return [_plain(v) for v in value]
    return float(f"{value:.6g}") if math.isfinite(value) else None


def judge(
    check: str,
    channel: str,
    value: float,
    interval: Interval,
    expected: Interval,
    unit: str,
    *,
    meaning: str,
    remedy: str,
    suspects: tuple[str, ...] = (),
) -> CheckFinding:
    """CheckFinding that is suspicious exactly when the whole interval lies outside the expected range.

    Args:
        check: family.
        channel: channel or pair.
        value: estimate [unit].
        interval: its 99 % interval.
        expected: sound range; a side may be infinite.
        unit: of all three.
        meaning: sentence for either outcome.
        remedy: sentence for a suspicious value.
        suspects: effects behind a suspicious value.
    """
    outside = interval[0] > expected[1] or interval[1] < expected[0]
    return CheckFinding(
        check=check,
        channel=channel,
        status=Status.SUSPICIOUS if outside else Status.PASS,
        meaning=meaning,
        remedy=remedy if outside else "",
        value=value,
        interval=interval,
        expected=expected,
        unit=unit,
        suspects=suspects if outside else (),
    )


@dataclass(frozen=True)
class Question:
    """What a check asks of a channel.

    Attributes:
        check: family.
        expected: sound range [unit]; a side may be infinite.
        unit: of value and range.
        remedy: sentence for a suspicious value.
        suspects: effects behind a suspicious value.
    """

    check: str
    expected: Interval
    unit: str
    remedy: str
    suspects: tuple[str, ...] = ()

    def answer(
        self,
        channel: str,
        value: float,
        interval: Interval | None = None,
        *,
        meaning: str,
        suspects: tuple[str, ...] | None = None,
    ) -> CheckFinding:
        """The finding: see :func:`judge`. A value without an interval was counted and has no error."""
        return judge(
            self.check, channel, value, (value, value) if interval is None else interval, self.expected, self.unit,
            meaning=meaning, remedy=self.remedy, suspects=self.suspects if suspects is None else suspects,
        )  # fmt: skip


def not_testable(check: str, channel: str, why: str, remedy: str) -> CheckFinding:
    """CheckFinding for a question that this recording cannot answer."""
    return CheckFinding(check, channel, Status.NOT_TESTABLE, why, remedy)


@dataclass(frozen=True)
class CheckReport:
    """All findings about one recording.

    Attributes:
        source: file name.
        source_sha256: its hash.
        robot: name, "" where unknown.
        rows: number of rows.
        seconds: time inside the spans [s].
        sentences: what :meth:`Recording.validate` says.
        findings: in the order of the checks.
    """

    source: str
    source_sha256: str
    robot: str
    rows: int
    seconds: float
    sentences: tuple[str, ...]
    findings: tuple[CheckFinding, ...]

    @classmethod
    def of(cls, recording: Recording, findings: Iterable[CheckFinding]) -> CheckReport:
        """Report on a recording."""
        meta = recording.meta
        seconds = math.fsum(float(recording.t[s.stop - 1] - recording.t[s.start]) for s in recording.spans())
        return cls(
            meta.source,
            meta.source_sha256,
            meta.robot,
            len(recording),
            seconds,
            recording.validate(),
            tuple(findings),
        )

    @property
    def suspicious(self) -> tuple[CheckFinding, ...]:
        """Findings that need attention."""
        return tuple(f for f in self.findings if f.status is Status.SUSPICIOUS)

    def to_json(self) -> dict[str, Any]:
        """The report as plain values, in the form that this module's docstring describes."""
        return {
            "schema_version": REPORT_VERSION,
            "source": self.source,
            "source_sha256": self.source_sha256,
            "robot": self.robot,
            "rows": self.rows,
            "seconds": round(self.seconds, 3),
            "verdict": str(Status.SUSPICIOUS if self.suspicious or self.sentences else Status.PASS),
            "sentences": list(self.sentences),
            "findings": [finding.to_json() for finding in self.findings],
        }
