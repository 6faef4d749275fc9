"""Drives whose sizes are drawn, without any recording."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ddagr_gym.diagnosis.answer.change import Change, EffectShift
from ddagr_gym.diagnosis.answer.drive_series import DriveAnswer, SizePoint
from ddagr_gym.diagnosis.answer.verdict import NONE, Diagnosis, Estimate, Finding, GatesUsed
from ddagr_gym.diagnosis.series.change_points import Sizes

DEGREES = 9.0
"""Of freedom: four expected ones and six ordinary drives."""

SHARED = 0.4
"""Deviation of the mean of ordinary drives."""

EFFECTS = ("gyro_bias", "payload", "slope", "motor_lag", "gyro_scale", "viscous_drag")


def drawn(seed: int, drives: int, sizes: int = 6) -> Sizes:
    """Sizes in which nothing changed; the scatter is one that was estimated with :data:`DEGREES`."""
    rng = np.random.default_rng(seed)
    estimated = np.sqrt(rng.chisquare(DEGREES, sizes) / DEGREES)
    values = rng.normal(size=(drives, sizes)) + SHARED * rng.normal(size=sizes)
    shape = (drives, sizes)
    return Sizes(values, np.broadcast_to(estimated, shape), SHARED * estimated, np.full(sizes, DEGREES))


def points(values: Sequence[float]) -> tuple[SizePoint, ...]:
    """Points of one drive, a size of 1 for each effect."""
    return tuple(
        SizePoint(effect, "size", "-", float(value), 1.0, SHARED, DEGREES, (0.2, -0.1))
        for effect, value in zip(EFFECTS, values, strict=False)
    )


def answer(values: Sequence[float], *names: str, started: float = 0.0) -> DriveAnswer:
    """A drive with sizes, and effects that its own answer names."""
    findings = tuple(
        Finding(name, {"bias": Estimate(0.02, "rad/s", (0.01, 0.03))}, 20.0, 9.0, 6.0, float("nan")) for name in names
    )
    verdict = names or (NONE,)
    shifts = (EffectShift("gyro_bias", 1.0, 4.0, 0.5, DEGREES, {}),)
    change = Change("", ("a.csv",), 0.05, 0.8, 10, shifts, (), (), {})
    gates = GatesUsed(nulls=1, bank="", level=0.05)
    diagnosis = Diagnosis(verdict, True, findings, "said.", {}, {}, {}, ("x",), gates, 0.0, "0", change=change)
    return DriveAnswer(diagnosis, points(values), 60.0, started, False)
