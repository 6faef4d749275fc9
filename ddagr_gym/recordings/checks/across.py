"""Findings from several runs of one robot: pooled values, and gravity over all their headings."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import ndtri, stdtrit

from ddagr_gym.recordings.checks.blocks import CONFIDENCE
from ddagr_gym.recordings.checks.findings import CheckFinding, CheckReport, Interval, judge
from ddagr_gym.recordings.checks.gravity import Rest, offset_by_heading, offset_findings, rests
from ddagr_gym.recordings.schema import Recording


def across_runs(recordings: Sequence[Recording], reports: Sequence[CheckReport]) -> list[CheckFinding]:
    """Findings that need more than one run.

    Args:
        recordings: runs of one robot.
        reports: on each of them, in the same order.

    Returns:
        One pooled finding for each question that two runs or more answered with an interval, and the accelerometer's
        offset over the headings of all runs.
    """
    if len(recordings) < 2:
        return []
    groups: dict[tuple[str, str], list[CheckFinding]] = {}
    for report in reports:
        for finding in report.findings:
            if finding.interval is not None and _has_width(finding.interval):
                groups.setdefault((finding.check, finding.channel), []).append(finding)
    pooled = [_pooled(group) for group in groups.values() if len(group) >= 2]
    return pooled + _gravity(recordings)


def _has_width(interval: Interval) -> bool:
    return math.isfinite(interval[1] - interval[0]) and interval[1] > interval[0]


def pooled_value(values: Sequence[float], intervals: Sequence[Interval]) -> tuple[float, Interval]:
    """Weighted mean of independent estimates with its 99 % interval.

    Weights are inverse variances. Where the estimates scatter more than their intervals allow, the interval grows by
    the Birge ratio and Student's t, because the runs then differ for a reason that no run knows of.

    Args:
        values: estimates, at least two.
        intervals: their 99 % intervals, of positive width.
    """
    z = float(ndtri((1 + CONFIDENCE) / 2))
    v = np.asarray(values, dtype=np.float64)
    sigma = np.array([(high - low) / (2 * z) for low, high in intervals])
    weight = 1.0 / sigma**2
    mean = float(np.sum(weight * v) / np.sum(weight))
    birge = math.sqrt(float(np.sum(weight * (v - mean) ** 2)) / (v.size - 1))
    factor = max(z, birge * float(stdtrit(v.size - 1, (1 + CONFIDENCE) / 2)))
    half = factor / math.sqrt(float(np.sum(weight)))
    return mean, (mean - half, mean + half)


def _pooled(group: Sequence[CheckFinding]) -> CheckFinding:
    first = group[0]
    values = [f.value for f in group if f.value is not None]
    value, interval = pooled_value(values, [f.interval for f in group if f.interval is not None])
    listed = ", ".join(f"{v:.3g}" for v in values[:8]) + (", ..." if len(values) > 8 else "")
    remedies = [f.remedy for f in group if f.remedy]
    suspects = tuple(dict.fromkeys(name for f in group for name in f.suspects))
    return judge(
        first.check,
        first.channel,
        value,
        interval,
        first.expected or (-math.inf, math.inf),
        first.unit,
        meaning=f"Over {len(values)} runs it is {value:.4g} {first.unit} ({listed}).",
        remedy=remedies[0] if remedies else "Compare the runs: together they leave no doubt that one run alone leaves.",
        suspects=suspects,
    )


def _gravity(recordings: Sequence[Recording]) -> list[CheckFinding]:
    """Offset over the rests of all runs that have one frame; a slope common to all of them is fitted."""
    found: list[Rest] = [rest for r in recordings if len(r.meta.spans) == 1 for rest in rests(r)]
    by_heading = offset_by_heading(found)
    if by_heading is None:
        return []
    return offset_findings(*by_heading, "over rests of all runs", len(found))
