"""Makes the simulated drive that ships with the package, ``ddagr_gym/data/replay_demo.parquet``.

    python benchmarks/make_replay_demo.py

A plain drive of the DDAGR without any missing physics. Its soil is weaker and softer than the preset from which
``ddagr demo`` starts, and its motors are slower, so that the refit has something to find. Without the truth columns.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ddagr_gym.commands.demo import SAMPLE, SAMPLE_SOIL
from ddagr_gym.control.manoeuvres import MANOEUVRES
from ddagr_gym.parameters import Imu, PoseReceiver, Sensors
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.channels import CHANNELS
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.recordings.storage import save_parquet
from ddagr_gym.simulator import simulate

RATE = 50.0
PARTS = ("stops", "arcs", "table_6_2", "spin", "s_weave")
STRENGTH, STIFFNESS, MOTOR_RATE = 0.8, 0.6, 0.85
"""Factors on the presets: the answer that a refit should find."""
SEED = 20


def drive() -> Recording:
    """The drive, as a recording."""
    robot, soil = get_robot("ddagr"), get_soil(SAMPLE_SOIL)
    true_soil = replace(
        soil,
        cohesion=STRENGTH * soil.cohesion,
        friction_angle=float(np.arctan(STRENGTH * np.tan(soil.friction_angle))),
        cohesive_modulus=STIFFNESS * soil.cohesive_modulus,
        frictional_modulus=STIFFNESS * soil.frictional_modulus,
    )
    sensors = Sensors(imu=Imu(sample_rate=RATE, gyro_noise=0.002, accelerometer_noise=0.05), pose=PoseReceiver(5.0))
    columns = simulate(
        replace(robot, motor_rate=MOTOR_RATE * robot.motor_rate),
        true_soil,
        np.concatenate([MANOEUVRES[name].commands(RATE) for name in PARTS]),
        sensors=sensors,
        seed=SEED,
    )
    kept = {name: np.round(values, 7) for name, values in columns.items() if name == "t" or name in CHANNELS}
    return Recording.from_columns(kept, robot, source=SAMPLE, notes=["simulated by benchmarks/make_replay_demo.py."])


def main() -> None:
    """Write the file."""
    path = Path(__file__).resolve().parents[1] / "ddagr_gym" / "data" / SAMPLE
    save_parquet(drive(), path)
    print(f"{path}: {path.stat().st_size / 1024:.0f} KiB")


if __name__ == "__main__":
    main()
