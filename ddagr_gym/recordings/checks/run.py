"""All checks of one recording."""

from __future__ import annotations

import math
from copy import deepcopy

import numpy as np

from ddagr_gym.recordings.checks.accelerometer import accelerometer
from ddagr_gym.recordings.checks.arbitration import arbitration
from ddagr_gym.recordings.checks.bank_limits import bank_limits
from ddagr_gym.recordings.checks.clock_drift import clock_drift
from ddagr_gym.recordings.checks.clock_offsets import clock_offsets
from ddagr_gym.recordings.checks.command_gains import gain_findings
from ddagr_gym.recordings.checks.currents import currents
from ddagr_gym.recordings.checks.extremes import extremes
from ddagr_gym.recordings.checks.findings import CheckFinding, CheckReport, not_testable
from ddagr_gym.recordings.checks.gravity import gravity
from ddagr_gym.recordings.checks.noise import noise
from ddagr_gym.recordings.checks.repeated_readings import repeated_readings
from ddagr_gym.recordings.checks.timing import CHECK, timing
from ddagr_gym.recordings.checks.travel import travel
from ddagr_gym.recordings.checks.turning import turning
from ddagr_gym.recordings.schema import Recording


def check_recording(recording: Recording, rng: np.random.Generator) -> CheckReport:
    """Every finding about a recording.

    Args:
        recording: any that the schema admits; questions that it cannot answer come back as not testable.
        rng: for the resampled intervals.
    """
    findings: list[CheckFinding] = []
    if len(recording) >= 3 and not _rows_follow(recording):
        why = "No two rows are in one segment and one span, so that no time passes between rows."
        findings.append(not_testable(CHECK, "t", why, "Correct segment_columns or span_columns in the map."))
    elif len(recording) >= 3:
        # Draws of their own, so that these checks leave the intervals of the others as they are.
        apart = deepcopy(rng)
        findings += arbitration(recording, apart) + clock_drift(recording, apart) + bank_limits(recording, apart)
        findings += timing(recording) + repeated_readings(recording) + extremes(recording)
        findings += clock_offsets(recording, rng) + turning(recording, rng)
        findings += travel(recording, rng) + gain_findings(recording, rng)
        findings += accelerometer(recording, rng) + noise(recording) + gravity(recording)
        findings += currents(recording, apart)
    return CheckReport.of(recording, findings)


def _rows_follow(recording: Recording) -> bool:
    """Whether a segment and a span hold two rows."""
    return math.isfinite(recording.period) and any(span.stop - span.start > 1 for span in recording.spans())
