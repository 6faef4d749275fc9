"""Stuck channels, saturation, and zeros that stand for missing data."""

from __future__ import annotations

import numpy as np

from ddagr_gym.recordings.checks.findings import CheckFinding, Question, judge
from ddagr_gym.recordings.checks.signals import moving_mask
from ddagr_gym.recordings.schema import FloatArray, Recording

INERTIAL = ("specific_force_x", "specific_force_y", "specific_force_z", "yaw_rate")
CHECKED = ("encoder_right", "encoder_left", *INERTIAL, "pose_x", "pose_y", "pose_yaw")

SATURATED = Question(
    "saturation",
    (0.0, 0.002),
    "-",
    "The sensor's range is too small for this drive: raise it, or leave the clipped samples out.",
)
"""Share of samples at the very largest or smallest value [-]."""
ZERO = Question(
    "zeros",
    (0.0, 0.001),
    "-",
    "Zeros were logged where there was no measurement: make them empty fields.",
    ("sensor_hold",),
)
"""Share of samples that are exactly 0 though their neighbours rule it out [-]."""
TIES = 5
"""Samples at one exact value that count as a heap, and how many times its neighbours' count it must be (ours)."""
LONGEST_RUN = 1.0
"""Time up to which a run of zeros counts as short [s]: a robot that brakes to a stop stays longer."""


def extremes(recording: Recording) -> list[CheckFinding]:
    """Findings on stuck, saturated and zeroed channels, for every channel that has samples."""
    driving = bool(np.count_nonzero(moving_mask(recording)) * recording.period > 5.0)
    findings = []
    for name in CHECKED:
        values = recording[name][np.isfinite(recording[name])]
        if values.size < 50:
            continue
        if driving:
            findings.append(stuck(name, values))
        if name in INERTIAL:
            findings.append(_saturated(name, values))
        findings.append(_zeros(recording, name))
    return findings


def stuck(name: str, values: FloatArray) -> CheckFinding:
    """Whether a channel changes at all while the robot drives.

    Args:
        name: of the channel.
        values: its samples (n,).
    """
    spread = float(np.ptp(values))
    return judge(
        "stuck",
        name,
        spread,
        (spread, spread),
        (np.finfo(float).tiny, np.inf),
        "SI",
        meaning=f"Its samples range over {spread:.4g} while the robot drives.",
        remedy="The channel never changes: look at the sensor and the map.",
        suspects=("sensor_hold",),
    )


def saturated_share(values: FloatArray) -> float:
    """Share of samples at the largest or smallest value where these values are heaped.

    An unclipped channel has about as many samples at its extreme as at each of the values next to it; a clipped one
    has a heap there.
    """
    share = 0.0
    levels, counts = np.unique(values, return_counts=True)
    for ordered in (counts, counts[::-1]):
        if ordered.size > 10 and ordered[-1] >= TIES and ordered[-1] > TIES * float(np.mean(ordered[-11:-1])):
            share += float(ordered[-1]) / values.size
    return share if levels.size > 10 else 0.0


def _saturated(name: str, values: FloatArray) -> CheckFinding:
    share = saturated_share(values)
    return SATURATED.answer(
        name,
        share,
        meaning=f"{100 * share:.2g} % of its samples sit exactly at its largest or smallest value, beyond chance.",
    )


def false_zeros(values: FloatArray, longest: int, heaps_count: bool) -> int:
    """Number of exact zeros that cannot be measurements.

    A short run of zeros is false where it is entered and left by jumps from and to values of one sign that are larger
    than nearly any other step of the channel. In a noisy channel exact zeros are also false where they are heaped far
    beyond every value near them.

    Args:
        values: successive samples (n,).
        longest: most samples of a short run.
        heaps_count: whether the channel is noisy at all times, so that heaps count.
    """
    zero = values == 0
    if not zero.any() or zero.all():
        return 0
    steps = np.abs(np.diff(values))[~(zero[1:] | zero[:-1])]
    limit = 1.5 * float(np.quantile(steps, 0.99)) if steps.size else np.inf
    count = 0
    starts = np.flatnonzero(zero & ~np.concatenate([[False], zero[:-1]]))
    stops = np.flatnonzero(zero & ~np.concatenate([zero[1:], [False]])) + 1
    for start, stop in zip(starts, stops, strict=True):
        inside = start > 0 and stop < values.size and stop - start <= longest
        if inside and min(abs(values[start - 1]), abs(values[stop])) > limit and values[start - 1] * values[stop] > 0:
            count += int(stop - start)
    if heaps_count:
        _, others = np.unique(values[~zero], return_counts=True)
        heap = int(np.count_nonzero(zero))
        if heap >= TIES and heap > TIES * int(others.max()):
            count = max(count, heap)
    return count


def _zeros(recording: Recording, name: str) -> CheckFinding:
    parts = [recording[name][s][np.isfinite(recording[name][s])] for s in recording.spans()]
    values = np.concatenate(parts)
    longest = max(1, round(LONGEST_RUN * recording.rate(name)))
    share = false_zeros(values, longest, name in INERTIAL) / values.size
    return ZERO.answer(
        name, share, meaning=f"{100 * share:.2g} % of its samples are exact zeros that their neighbours rule out."
    )
