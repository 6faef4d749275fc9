"""Simulated drives of a robot that is not as its data sheet says, on two grounds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ddagr_gym
from ddagr_gym.parameters import Robot
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording

MOTOR_RATE = 2.5
"""Of the true robot [1/s]; the data sheet has 4.5."""

DELAY = 0.22
"""Of its commands [s]; the data sheet has none."""

STRENGTH = {"field": 1.0, "track": 1.5}
"""Factors on cohesion and tan(phi) of the nominal soil by ground."""

RATE = 20.0
"""Of the recordings [Hz]."""


def true_robot():
    return replace(get_robot("ddagr"), motor_rate=MOTOR_RATE)


def true_soil(ground: str):
    soil = get_soil("thesis_a1")
    factor = STRENGTH[ground]
    angle = float(np.arctan(factor * np.tan(soil.friction_angle)))
    return replace(soil, cohesion=factor * soil.cohesion, friction_angle=angle)


def steps(seed: int, seconds: float) -> np.ndarray:
    """(T, 2) bank speed commands, each held for 2 to 5 s [rad/s]."""
    rng = np.random.default_rng(seed)
    rows: list[np.ndarray] = []
    while len(rows) < seconds * RATE:
        rows += [rng.uniform(-1.6, 1.6, 2)] * int(rng.uniform(2.0, 5.0) * RATE)
    return np.array(rows[: int(seconds * RATE)])


def drive(
    ground: str,
    seed: int,
    seconds: float = 120.0,
    name: str = "",
    robot: Robot | None = None,
    effects: tuple[str, ...] = (),
) -> Recording:
    made = ddagr_gym.simulate(
        steps(seed, seconds), robot or true_robot(), true_soil(ground), [f"command_delay={DELAY}", *effects], rate=RATE,
        pose_rate=5.0, seed=seed,
    )  # fmt: skip
    return made.recording.with_meta(source=name or f"{ground}_{seed}.csv")


@pytest.fixture(scope="session")
def drives() -> list[Recording]:
    """Two drives on the field and one on the track."""
    return [drive("field", 1), drive("field", 2), drive("track", 3)]
