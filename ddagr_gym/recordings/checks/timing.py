"""Rates, jitter, gaps, duplicated rows, and how long each channel goes without a new sample."""

from __future__ import annotations

import numpy as np

from ddagr_gym.recordings.channels import CHANNELS, COMMANDS, VOLTAGES
from ddagr_gym.recordings.checks.findings import CheckFinding, Question, judge, not_testable
from ddagr_gym.recordings.checks.row_steps import MOST_JITTER, jitter, merged_on, steps_in_spans
from ddagr_gym.recordings.checks.signals import moving_mask
from ddagr_gym.recordings.checks.silences import longest_wait
from ddagr_gym.recordings.row_times import GAP_IN_PERIODS, in_bursts, longest_period, row_period
from ddagr_gym.recordings.schema import BoolArray, FloatArray, Recording

CHECK = "timing"

LONGEST_HOLE = 2.5
"""Periods between rows beyond which they are a gap (ours)."""

JITTER = Question(CHECK, (0.0, MOST_JITTER), "-", "Use the sensor's own stamps instead of the logger's.")
"""95 % quantile of |time step - median| over the median [-]."""
GAP = Question(
    CHECK, (0.0, 0.02), "-", "Look for a logger that lost messages; segments around the gaps are used apart."
)
"""Share of the spans' time that gaps of more than :data:`LONGEST_HOLE` periods take [-]."""
DUPLICATE = Question(CHECK, (0.0, 0.001), "-", "Look for rows that were logged twice.")
"""Share of rows whose time repeats the row before [-]."""
HOLD = Question(
    "wait", (0.0, 0.15), "-", "Look for a sensor that stops or a logger that drops its messages.", ("sensor_hold",)
)
"""Share of the driving time in which a channel waits more than five of its periods for a sample [-]; 0.07 at most on
the open recordings, whose poses come irregularly."""
SLOWEST = {"encoder": 2.0, "specific_force": 10.0, "yaw_rate": 10.0, "pose": 1.0}
"""Rate below which a channel cannot follow a robot's motion [Hz] (ours), by the beginning of its name."""
LONG_HOLD = 5.0
"""Wait, in median periods or times between bursts, from which a channel counts as not renewed (ours)."""


def timing(recording: Recording) -> list[CheckFinding]:
    """Findings on the rows' times and on each channel's rate."""
    return [*_row_findings(recording), *_rate_findings(recording)]


def _row_findings(recording: Recording) -> list[CheckFinding]:
    steps, across, fastest = _steps(recording)
    if steps.size < 2:
        return [not_testable(CHECK, "t", "There are fewer than three rows in a row.", "Record for longer.")]
    usual = longest_period(steps)
    lost = float(np.sum(across[across > LONGEST_HOLE * usual] - usual) / np.sum(across))
    count = recording.meta.duplicates_dropped
    duplicates = count / (count + len(recording))
    where = f" of {fastest}." if fastest else f"; {len(recording.meta.segments)} segments."
    return [
        JITTER.answer("t, jitter", jitter(steps), meaning=_rate_sentence(steps, fastest)),
        GAP.answer("t, gaps", lost, meaning=f"{100 * lost:.2g} % of the time is lost in gaps{where}"),
        DUPLICATE.answer(
            "t, duplicates", duplicates, meaning=f"{count} rows repeated the time of the row before and were left out."
        ),
    ]


def _steps(recording: Recording) -> tuple[FloatArray, FloatArray, str]:
    """Times between rows without gaps and with them [s], and "", or those of the fastest channel of merged tables."""
    fastest = merged_on(recording)
    if fastest:
        across = steps_in_spans(recording, np.isfinite(recording[fastest]))
        return across[across <= GAP_IN_PERIODS * longest_period(across)], across, fastest
    inside = np.concatenate([np.diff(recording.t[s]) for s in recording.segments()] or [np.empty(0)])
    return inside, steps_in_spans(recording), ""


def _rate_sentence(steps: FloatArray, fastest: str) -> str:
    rate, percent = f"{1 / row_period(steps):.4g} Hz", f"{100 * jitter(steps):.2g} %"
    if in_bursts(steps):
        apart = steps[steps > GAP_IN_PERIODS * np.median(steps)]
        several = f"Rows come in bursts of about {steps.size / apart.size:.2g}, {np.median(apart):.3g} s apart, "
        return several + f"and at {rate} on the whole: a logger's stamps, not the sensor's."
    if fastest:
        several = f"Rows are those of several sensors, merged on time, of which {fastest} comes at {rate}"
        return several + f"; 19 of 20 of its steps lie within {percent} of its period."
    return f"Rows come at {rate}; 19 of 20 steps lie within {percent} of the period."


def _rate_findings(recording: Recording) -> list[CheckFinding]:
    driving = moving_mask(recording)
    findings: list[CheckFinding] = []
    for name, channel in CHANNELS.items():
        if recording.has(name):
            # Commands may come only when they change, and a good battery's voltage hardly does.
            if name not in (*COMMANDS, *VOLTAGES):
                findings += _hold_findings(recording, name, driving)
        elif channel.core:
            why = "The channel has no samples."
            findings.append(not_testable("rate", name, why, "Record it, or correct the map."))
    return findings


def waits(recording: Recording, name: str, driving: BoolArray) -> FloatArray:
    """Times between new samples of a channel while the robot drives [s]; a span's ends count as samples.

    Args:
        recording: any.
        name: channel.
        driving: (n,) rows in which the robot moves; a wait counts when most of its rows do.
    """
    found = [np.empty(0)]
    moved = np.concatenate([[0], np.cumsum(driving)])
    for span in recording.spans():
        rows = span.start + np.flatnonzero(np.isfinite(recording[name][span]))
        rows = np.unique(np.concatenate([[span.start], rows, [span.stop - 1]]))
        counts = 2 * np.diff(moved[rows]) > np.diff(rows)
        found.append(np.diff(recording.t[rows])[counts])
    return np.concatenate(found)


def _hold_findings(recording: Recording, name: str, driving: BoolArray) -> list[CheckFinding]:
    between = waits(recording, name, driving)
    if between.size < 20:
        return [not_testable("rate", name, "The robot hardly drives.", "Record a drive.")]
    median, longest, rate = longest_period(between), float(between.max()), 1 / row_period(between)
    share = float(np.sum(between[between > LONG_HOLD * median]) / np.sum(between))
    slowest = next((rate for start, rate in SLOWEST.items() if name.startswith(start)), 0.0)
    return [
        judge(
            "rate",
            name,
            rate,
            (rate, rate),
            (slowest, np.inf),
            "Hz",
            meaning=f"New samples come at {rate:.3g} Hz while driving.",
            remedy="Raise the sensor's rate, or declare the channel under held in the map if the logger repeats it.",
            suspects=("sensor_hold",),
        ),
        judge(
            "wait",
            name,
            longest,
            (longest, longest),
            (0.0, longest_wait(median)),
            "s",
            meaning=f"While driving it goes without a new sample for {longest:.2f} s at most.",
            remedy="Look for a sensor that stops or a logger that drops its messages.",
            suspects=("sensor_hold",),
        ),
        HOLD.answer(
            f"{name}, share",
            share,
            meaning=f"Waits of more than {LONG_HOLD:g} periods take {100 * share:.2g} % of the driving time.",
        ),
    ]
