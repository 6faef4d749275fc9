"""When an effect began, ended or changed in a drive: the part of a finding that says so."""

from __future__ import annotations

from dataclasses import dataclass

CONSTANT, BEGINS, ENDS, STEPS, DRIFTS = "constant", "begins", "ends", "steps", "drifts"
KINDS = (CONSTANT, BEGINS, ENDS, STEPS, DRIFTS)
"""How a size goes with time."""


@dataclass(frozen=True)
class TimedSize:
    """Size of an effect in a stretch of a recording.

    Attributes:
        recording: its number, from 0.
        start: time of the recording [s].
        end: the same.
        size: over the fitted one, which is 1 all along the drives [-].
        deviation: standard deviation of that, robot and soil being what all windows say of them.
    """

    recording: int
    start: float
    end: float
    size: float
    deviation: float


@dataclass(frozen=True)
class Onset:
    """How the size of a finding goes with time.

    Attributes:
        kind: "constant"; "begins" or "ends" where it is absent before or after a time; "steps" where it changes from
            one size to another; "drifts" where it grows or falls throughout a recording.
        value: time of the recording at which it begins, ends or steps [s]; null for the other kinds.
        interval: 90 % of that, from the start to the end of windows: inside a window no time is told.
        recording: number of the recording in which it changes, from 0; null for "constant".
        before: size before the time, of a drift at the recording's start, over the fitted one [-]; of one that is
            constant 1.
        after: the same after it, of a drift at the recording's end.
        evidence: logarithm of the likelihood ratio of the best such change against a constant size.
        threshold: what that exceeds in 5 % of the drives in which nothing changes.
        sizes: in stretches of about equal length, in the order of time.
    """

    kind: str
    value: float | None
    interval: tuple[float, float] | None
    recording: int | None
    before: float
    after: float
    evidence: float
    threshold: float
    sizes: tuple[TimedSize, ...] = ()
