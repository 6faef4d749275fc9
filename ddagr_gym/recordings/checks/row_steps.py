"""Steps by which rows are judged: between rows, or where tables were merged on time between samples of one sensor."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ddagr_gym.recordings.row_times import GAP_IN_PERIODS, row_period
from ddagr_gym.recordings.schema import BoolArray, FloatArray, Recording, cut_at_gaps

MOST_JITTER = 0.3
"""Jitter up to which rows come evenly [-] (ours)."""
MOST_OF_ONE = 0.75
"""Share of the rows that hold a sample of one channel from which the rows are that sensor's (ours): its period is then
at most twice the median step, and no step is called a gap for the rows of others in between."""
LEAST_TOLD = 0.95
"""Share of the rows of merged tables that hold a new sample at all (ours): each is there for one."""


def steps_in_spans(recording: Recording, known: BoolArray | None = None) -> FloatArray:
    """Times between rows inside spans, or between those that are ``known`` (n,) [s]."""
    t = recording.t
    parts = (t[s] if known is None else t[s][known[s]] for s in recording.spans())
    return np.concatenate([np.empty(0), *(np.diff(part) for part in parts)])


def jitter(steps: FloatArray) -> float:
    """95 % quantile of |step - period| over the period [-]; 0 without steps."""
    period = row_period(steps)
    return float(np.quantile(np.abs(steps - period), 0.95)) / period if steps.size else 0.0


def merged_on(recording: Recording) -> str:
    """The fastest channel of tables that were merged on time, so that every row is one of some sensor; else ""."""
    if jitter(steps_in_spans(recording)) <= MOST_JITTER:
        return ""
    new = {name: np.isfinite(values) for name, values in recording.channels.items()}
    fastest = max(new, key=lambda name: int(np.count_nonzero(new[name])), default="")
    if not fastest or np.mean(new[fastest]) >= MOST_OF_ONE:
        return ""
    return fastest if np.mean(np.any(list(new.values()), axis=0)) >= LEAST_TOLD else ""


def unbroken(recording: Recording) -> Iterator[slice]:
    """Segments, or where tables were merged on time stretches in which the fastest channel misses no sample."""
    fastest = merged_on(recording)
    if not fastest:
        return recording.segments()
    period = float(np.median(steps_in_spans(recording, np.isfinite(recording[fastest]))))
    return (slice(a, b) for a, b in cut_at_gaps(recording.t, recording.meta.spans, GAP_IN_PERIODS * period))
