"""Sound drives in simulation, of many kinds: does ``ddagr check`` keep silent?

Three robots on two soils, with and without a pose, drive in seven ways, among them slow motion, turns to one side alone
and standing. Every question of ``ddagr check`` is asked; each suspicious finding is a false alarm.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from ddagr_gym.parameters import Imu, PoseReceiver, Robot, Sensors
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.checks.run import check_recording
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import simulate

Array = npt.NDArray[np.float64]

TOP: Mapping[str, float] = {"ddagr": 1.2, "warthog": 6.0, "husky": 4.0}
"""Fast wheel speed of each robot [rad/s]."""
SOILS = ("thesis_a1", "firm_ground")
SECONDS, RATE, HELD, AT_REST = 48.0, 125.0, 1.2, 1.2
"""Length of a drive [s], samples per second, time for which commands are held, time at rest at both ends [s]."""
SLOW = 0.12
"""Slow motion over the fast one."""
_POSE = ("pose_x", "pose_y", "pose_yaw")

WAYS: Mapping[str, Callable[[np.random.Generator, int], Array]] = {
    "all ways": lambda rng, n: rng.uniform(-1.0, 1.0, (n, 2)) * (rng.random((n, 1)) < 0.9),
    "slowly": lambda rng, n: SLOW * rng.uniform(-1.0, 1.0, (n, 2)),
    "standing": lambda rng, n: np.zeros((n, 2)),
    "straight": lambda rng, n: np.repeat(rng.uniform(-1.0, 1.0, (n, 1)), 2, axis=1),
    "forward": lambda rng, n: 0.6 + 0.3 * rng.uniform(-1.0, 1.0, (n, 2)),
    "on the spot": lambda rng, n: rng.uniform(-0.5, 0.5, (n, 1)) * np.array([1.0, -1.0]),
    "to the left": lambda rng, n: rng.uniform(0.1, 0.5, (n, 1)) * np.array([2.0, 1.0]),
}
"""Commands of the right and the left bank over the fast speed (n, 2)."""


def commands(way: str, robot: Robot, rng: np.random.Generator) -> Array:
    """Commands of a drive (samples, 2) [rad/s], at rest at both ends."""
    hold, count = round(HELD * RATE), round(SECONDS * RATE)
    asked = TOP[robot.name] * np.repeat(WAYS[way](rng, -(-count // hold)), hold, axis=0)[:count]
    rest = round(AT_REST * RATE)
    asked[:rest] = asked[-rest:] = 0.0
    return asked


def sound_drive(way: str, robot: Robot, soil: str, seed: int, *, pose: bool) -> Recording:
    """A drive with nothing wrong.

    Args:
        way: of :data:`WAYS`.
        robot: that drives.
        soil: name.
        seed: of commands and noise.
        pose: whether poses are recorded.
    """
    asked = commands(way, robot, np.random.default_rng(seed))
    sensors = Sensors(imu=Imu(sample_rate=50.0), pose=PoseReceiver(rate=5.0))
    drive = Recording.from_columns(simulate(robot, get_soil(soil), asked, sensors=sensors, seed=seed), robot)
    kept = {name: values for name, values in drive.channels.items() if pose or name not in _POSE}
    return replace(drive, channels=kept)


def false_alarms(seeds: Sequence[int]) -> dict[str, Any]:
    """By way of driving: drives, how many of them have a suspicious finding, and what is said.

    Args:
        seeds: of the drives of each robot on each soil.
    """
    found: dict[str, Any] = {}
    for way in WAYS:
        entry: dict[str, Any] = {"drives": 0, "with a finding": 0, "said": []}
        for name, soil, seed, pose in itertools.product(TOP, SOILS, seeds, (True, False)):
            report = check_recording(sound_drive(way, get_robot(name), soil, seed, pose=pose), np.random.default_rng(0))
            entry["drives"] += 1
            entry["with a finding"] += bool(report.suspicious)
            entry["said"] += [
                f"{name} on {soil}, {seed}: {f.check}, {f.channel}: {f.meaning}" for f in report.suspicious
            ]
        found[way] = entry
        print(f"sound drives {way}: {entry['with a finding']} of {entry['drives']} with a finding", flush=True)
    return found
