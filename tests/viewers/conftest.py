"""Two short drives with a gyro that reads too much, fitted with and without it, and an answer that names it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import pytest

from ddagr_gym.diagnosis.answer.location import EffectLocation, Place, Span
from ddagr_gym.diagnosis.answer.verdict import DataDoubt, Diagnosis, Estimate, Finding, GatesUsed
from ddagr_gym.identification.gauss_newton import Fitted, fit
from ddagr_gym.identification.problem import Problem
from ddagr_gym.physics.effects.registry import parse_effect
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.viewers.drive_traces import DriveTraces, drive_traces
from tests.diagnosis.conftest import drive, problem_of

__all__ = ["drive", "problem_of"]

EFFECT = "gyro_scale=1.2"

CLOCK = 1_700_000_000.25
"""Reading at time 0 of the first drive [s]."""


@dataclass(frozen=True, eq=False)
class Answered:
    """What a file for a viewer is written of."""

    recordings: tuple[Recording, ...]
    problem: Problem
    refitted: Fitted
    corrected: Fitted
    diagnosis: Diagnosis
    drives: tuple[DriveTraces, ...]


@pytest.fixture(scope="session")
def answered(drive, problem_of) -> Answered:
    """Made once: the effect in the second half of the first drive, at a place, and in all of the second."""
    first = drive((EFFECT,), seconds=12.0, seed=1).with_meta(source="first.csv", start_time=CLOCK)
    second = drive((EFFECT,), seconds=10.0, seed=2).with_meta(source="second.csv", start_time=CLOCK)
    problem = problem_of(first, second)
    refitted = fit(problem, iterations=1)
    known = replace(refitted.point, effects=(parse_effect(EFFECT),))
    corrected = fit(problem, known, iterations=1, reuse=refitted)
    spans = (Span(0, 6.0, 12.0, 0.6, 1.0, 0.1), Span(1, 2.0, 4.0, 0.3, 1.0, 0.1))
    where = EffectLocation(spans, 0.5, (), (Place(1.0, 0.5, 0.4),), None, "in two stretches")
    scale = {"scale": Estimate(1.2, "-", (1.18, 1.22))}
    findings = (
        Finding("gyro_scale", scale, 50.0, 5.0, 9.0, 40.0, where=where),
        Finding("gyro_bias", {"bias": Estimate(0.01, "rad/s", (0.008, 0.012))}, 20.0, 5.0, 6.0, 15.0),
    )
    diagnosis = Diagnosis(
        ("gyro_scale", "gyro_bias"), True, findings, "The gyro reads too much.", {}, {}, {},
        ("first.csv", "second.csv"), GatesUsed(nulls=0, bank="", level=0.05), 1.0, "0",
        checks=(DataDoubt("second.csv", "pose_x", "clock", "The poses of second.csv come late."),),
    )  # fmt: skip
    drives = drive_traces(problem, refitted, corrected, (first, second))
    return Answered((first, second), problem, refitted, corrected, diagnosis, drives)
