"""Simulated drives of a Warthog with a drivetrain, with motor currents whose constants are known."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.motor_currents import BANKS
from ddagr_gym.parameters import Imu, PoseReceiver, Robot, Sensors, Soil, WheelEncoder
from ddagr_gym.physics import layout
from ddagr_gym.physics.motor_torque import RECORDED, motor_torques
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.checks.currents import CurrentKind
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import Simulator

Array = NDArray[np.float64]

ROBOT, SOIL = "warthog", "firm_ground"
RATE = 20.0
"""Of the recordings [Hz], as of the real ones."""
CURRENT_NOISE = 0.05
"""Of a current sensor, over the root mean square of its readings (ours)."""
VOLTAGE, EFFICIENCY, LOSS = 48.0, 0.8, 0.002
"""Of the supply [V], of motors and gears [-], and what a motor loses by its torque [rad/s/(N m)] (ours)."""
TORQUE_CONSTANT = (0.10, 0.11)
"""Current by torque at the wheels, right and left [A/(N m)] (ours)."""

SOIL_SPREAD = {"soil_strength": 0.2, "soil_stiffness": 0.5, "shear_modulus": 0.4}
"""Deviations of the logarithms by which true soils differ from the nominal one."""


@dataclass(frozen=True, eq=False)
class TrueDrive:
    """A drive and what it was made with.

    Attributes:
        recording: with currents.
        truth: parameters by name, as a calibration has them: logarithms of factors, or changes from the data sheet.
    """

    recording: Recording
    truth: dict[str, float]


def true_robot(rng: np.random.Generator) -> tuple[Robot, dict[str, float]]:
    """A Warthog with a drivetrain of likely size, and its parameters beside the data sheet."""
    sheet = get_robot(ROBOT)
    heaviest = 2.0 / (sheet.mass * sheet.outer_radius**2)
    drivetrain = {
        "command_delay": rng.uniform(0.1, 0.3),
        "integral_rate": rng.uniform(1.0, 4.0),
        "load_compliance": rng.uniform(0.2, 0.6) * heaviest,
        "viscous_rate": rng.uniform(0.1, 0.4),
        "coulomb_friction": rng.uniform(0.2, 1.0),
    }
    factors = {"motor_rate": rng.normal(0.0, 0.15), "mass": rng.normal(0.0, 0.03)}
    changed = {name: getattr(sheet, name) * math.exp(value) for name, value in factors.items()}
    return replace(sheet, drivetrain=replace(sheet.drivetrain, **drivetrain), **changed), {**drivetrain, **factors}


def true_soil(rng: np.random.Generator) -> tuple[Soil, dict[str, float]]:
    """A soil beside the nominal one, and the logarithms of its factors."""
    soil = get_soil(SOIL)
    factors = {name: rng.normal(0.0, spread) for name, spread in SOIL_SPREAD.items()}
    strength, stiffness = math.exp(factors["soil_strength"]), math.exp(factors["soil_stiffness"])
    changed = replace(
        soil,
        cohesion=soil.cohesion * strength,
        friction_angle=math.atan(math.tan(soil.friction_angle) * strength),
        cohesive_modulus=soil.cohesive_modulus * stiffness,
        frictional_modulus=soil.frictional_modulus * stiffness,
        shear_modulus=soil.shear_modulus * math.exp(factors["shear_modulus"]),
    )
    return changed, factors


def commands(rng: np.random.Generator, seconds: float) -> Array:
    """(T, 2) bank speed commands, each held for 3 to 6 s, straight pieces among them [rad/s]."""
    rows: list[Array] = []
    while len(rows) < seconds * RATE:
        pair = rng.uniform(-5.0, 5.0, 2) if rng.random() < 0.7 else np.full(2, rng.uniform(-6.0, 6.0))
        rows += [pair] * int(rng.uniform(3.0, 6.0) * RATE)
    return np.array(rows[: int(seconds * RATE)])


def true_drive(seed: int, kind: CurrentKind, *, seconds: float = 120.0, current_rate: float = RATE) -> TrueDrive:
    """A drive of a robot on a soil of its own.

    Args:
        seed: of robot, soil, commands and noise.
        kind: of the recorded currents.
        seconds: of the drive.
        current_rate: at which currents come [Hz].
    """
    rng = np.random.default_rng(seed)
    (robot, truth), (soil, factors) = true_robot(rng), true_soil(rng)
    driven = commands(rng, seconds)
    sensors = Sensors(Imu(sample_rate=RATE), WheelEncoder(), PoseReceiver(rate=5.0))
    simulator = Simulator(1)
    simulator.configure(0, robot, soil, sensors)
    simulator.reset()
    noise = rng.standard_normal((1, len(driven), layout.NOISE_CHANNELS))
    readings, record = simulator.step(driven[None], noise, recorded=RECORDED)
    current = _currents(motor_torques(record[0]), record[0, :, :2], kind)
    current += CURRENT_NOISE * np.sqrt(np.mean(current**2, axis=0)) * rng.standard_normal(current.shape)
    current[np.arange(len(current)) % round(RATE / current_rate) != 0] = np.nan
    columns = {"t": np.arange(1.0, len(driven) + 1.0) / RATE}
    columns |= {"command_right": driven[:, 0], "command_left": driven[:, 1]}
    columns |= {name: readings[0, :, k] for k, name in enumerate(layout.READINGS)}
    columns |= {f"current_{bank}": current[:, k] for k, bank in enumerate(BANKS)}
    if kind is CurrentKind.SUPPLY:
        columns["battery_voltage"] = np.full(len(driven), VOLTAGE)
    return TrueDrive(Recording.from_columns(columns, get_robot(ROBOT), source=f"drive_{seed}"), truth | factors)


def _currents(torque: Array, speed: Array, kind: CurrentKind) -> Array:
    """(T, 2) currents without noise [A]."""
    if kind is CurrentKind.MOTOR:
        return np.asarray(np.array(TORQUE_CONSTANT) * torque)
    return np.asarray((torque * speed + LOSS * torque**2) / (EFFICIENCY * VOLTAGE))
