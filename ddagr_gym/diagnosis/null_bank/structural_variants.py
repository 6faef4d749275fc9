"""Simulators that differ from the nominal one in structure, with nothing missing that the library could name.

Null drives from the very simulator that is fitted to them would make every threshold far too low (the inverse crime,
theory: diagnosis, section 1). Each kind here changes something that real ground and real robots do otherwise; none is
in the library. They are effects only in how they attach to the simulator; they are not registered and cannot be named
by a verdict.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.null_bank.readings import Reading, draw_reading
from ddagr_gym.parameters import Numerics, Soil
from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.effects.motor_lag import slow_turning
from ddagr_gym.physics.effects.soil_factors import scale_soil
from ddagr_gym.physics.layout import (
    MOTOR_RATE,
    MOTOR_TARGET,
    OMEGA,
    POINT_LOADS,
    POINT_MOTORS,
    POINT_SOIL,
    SAMPLE_PERIOD,
    SINKAGE,
    SLIP_RATIO,
    SLOPE,
    WHEEL_V_X,
    WHEEL_V_Y,
    X,
)
from ddagr_gym.physics.terrain import SoilField
from ddagr_gym.physics.wheel_forces import soil_vector

Array = NDArray[np.float64]


def bend_pressure(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Stiffness by sinkage, as another pressure law has it: a power of sinkage over its size at rest, and of speed."""
    for i in range(4):
        depth = min(max(row[SINKAGE + i] / 0.008, 0.2), 5.0)
        rate = 1.0 + parameters[1] * math.log(1.0 + abs(row[WHEEL_V_X + i]) / 0.05)
        scale_soil(row, i, 1.0, rate * math.exp(parameters[0] * math.log(depth)))


def bend_shear(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Strength by slip and by slip angle, as a law with a peak (negative) or one that hardens (positive) has it."""
    for i in range(4):
        slip = min(abs(row[SLIP_RATIO + i]), 1.0)
        across = abs(row[WHEEL_V_Y + i]) / max(math.hypot(row[WHEEL_V_X + i], row[WHEEL_V_Y + i]), 0.02)
        scale_soil(row, i, (1.0 + parameters[0] * (slip - 0.2)) * (1.0 + parameters[1] * (across - 0.3)), 1.0)


def second_order_motors(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Split the time constant between a filter of the command, of ``parameters[0]`` seconds, and a faster loop."""
    share = 1.0 - math.exp(-row[SAMPLE_PERIOD] / parameters[0])
    for bank in range(2):
        if memory[2] == 0.0:
            memory[bank] = row[OMEGA + bank]
        memory[bank] += share * (row[MOTOR_TARGET + bank] - memory[bank])
        row[MOTOR_TARGET + bank] = memory[bank]
        row[MOTOR_RATE + bank] = 1.0 / max(1.0 / row[MOTOR_RATE + bank] - parameters[0], 0.02)
    memory[2] = 1.0


def ripple_ground(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Relief by place: crossed waves of gradient ``parameters[0]``, each shorter than the one before by a golden ratio.

    Gradients of equal size in every band are the coloured profile of fields, whose heights fall with the length.
    """
    for axis in range(2):
        length, phase = parameters[1 + axis], parameters[3 + axis]
        for k in range(int(parameters[5])):
            turn = 2.0 * math.pi * row[X + axis] / length + (1.0 + 2.4 * k) * phase
            row[SLOPE + axis] += parameters[0] * math.sin(turn)
            length *= 0.618


@dataclass(frozen=True)
class OtherPressureLaw(Effect):
    """Exponent and rate of the pressure law (Wong, Theory of Ground Vehicles, section 2.4.2, for rates)."""

    name = "null_pressure_law"
    title = "Another pressure law"
    group = "ground"
    equation = "k -> k (z/8 mm)^power (1 + rate ln(1 + |v|/5 cm/s))"
    source = "ours"
    signature = "none that a refit leaves"
    actions = ((POINT_SOIL, bend_pressure),)

    power: float = size("-", -1.0, 1.0, least=0.1)
    rate: float = size("-", -0.5, 0.5, least=0.1, default=0.0)


@dataclass(frozen=True)
class OtherShearLaw(Effect):
    """Shear strength that falls or rises with slip and slip angle."""

    name = "null_shear_law"
    title = "Another shear law"
    group = "ground"
    equation = "c, tan(phi) -> (1 + gain (|slip| - 0.2)) (1 + across (|sin(slip angle)| - 0.3)) c, tan(phi)"
    source = "hump and hardening curves (Wong, Theory of Ground Vehicles, section 2.4.3)"
    signature = "none that a refit leaves"
    actions = ((POINT_SOIL, bend_shear),)

    gain: float = size("-", -1.0, 1.0, least=0.1)
    across: float = size("-", -1.0, 1.0, least=0.1, default=0.0)


@dataclass(frozen=True)
class SecondOrderMotors(Effect):
    """Speed loop of second order with the nominal 63 % time."""

    name = "null_motor_loop"
    title = "Another speed loop"
    group = "commands and motors"
    equation = "filter of the command and a loop that is faster by as much"
    source = "ours"
    signature = "none that a refit leaves"
    actions = ((POINT_MOTORS, second_order_motors),)

    filter: float = size("s", 0.001, 0.15, least=0.01, neutral=0.001)


@dataclass(frozen=True)
class YieldingLoop(Effect):
    """Speed loop that yields a little to the ground, which resists turns the most."""

    name = "null_yielding_loop"
    title = "A loop that yields in turns"
    group = "commands and motors"
    equation = "the difference of both banks' commands trails by a few milliseconds"
    source = "ours"
    signature = "none that a refit leaves"
    actions = ((POINT_MOTORS, slow_turning),)

    lag: float = size("s", 0.0, 0.05, least=0.01)


@dataclass(frozen=True)
class Relief(Effect):
    """Small waves of the ground, one length or a spectrum."""

    name = "null_relief"
    title = "Relief"
    group = "ground"
    equation = "sum over k of gradient sin(2 pi x/(0.618^k length) + phase_k) along both world axes"
    source = "ours"
    signature = "noise of the accelerometers with the pace of the drive"
    actions = ((POINT_LOADS, ripple_ground),)

    gradient: float = size("-", 0.0, 0.2, least=0.001)
    length_x: float = size("m", 0.1, 100.0, least=1.0, default=0.9, neutral=0.9)
    length_y: float = size("m", 0.1, 100.0, least=1.0, default=0.7, neutral=0.7)
    phase_x: float = size("rad", -10.0, 10.0, least=1.0, default=0.0)
    phase_y: float = size("rad", -10.0, 10.0, least=1.0, default=0.0)
    waves: float = size("-", 1.0, 8.0, least=1.0, default=1.0, neutral=1.0)


KINDS = (
    "plain", "pressure law", "shear law", "motor loop", "relief", "rough", "patchy", "readings", "noise", "all",
)  # fmt: skip
"""Structural kinds, in the order in which a bank goes through them."""


_SPACING = 0.25
"""Of the nodes of a field [m] (ours: half the shortest correlation length)."""


@dataclass(frozen=True, eq=False)
class NullWorld:
    """A simulator in which nothing is missing that has a name.

    Attributes:
        kind: of KINDS.
        field: soil by place.
        changes: structural changes.
        numerics: of its integrator.
        reading: how it is commanded and read.
        tilt: share of the tilt by unequal sinkage that its accelerometer feels.
    """

    kind: str
    field: SoilField
    changes: tuple[Effect, ...]
    numerics: Numerics
    reading: Reading
    tilt: float


def draw_world(kind: str, soil: Soil, reach: float, rng: np.random.Generator) -> NullWorld:
    """World of a kind: every one has its own soil, 10 percent off, and varies by 2 to 4 percent from place to place.

    Args:
        kind: of KINDS.
        soil: nominal.
        reach: half the side of the area driven on [m].
        rng: source of randomness.
    """
    spread = float(rng.uniform(0.05, 0.1)) if kind in ("all", "patchy") else float(rng.uniform(0.02, 0.04))
    numerics = replace(Numerics(), maximum_step=float(rng.choice([0.004, 0.01])))
    field = _field(_other(soil, rng), reach, spread, rng)
    changes, reading = _changes(kind, rng), draw_reading(kind, rng)
    return NullWorld(kind, field, changes, numerics, reading, float(rng.uniform(0.0, 1.0)))


def _changes(kind: str, rng: np.random.Generator) -> tuple[Effect, ...]:
    every = kind == "all"
    changes: list[Effect] = []
    if every or kind == "pressure law":
        changes.append(OtherPressureLaw(float(rng.uniform(-0.4, 0.4)), float(rng.uniform(0.0, 0.08))))
    if every or kind == "shear law":
        changes.append(OtherShearLaw(float(rng.uniform(-0.5, 0.5)), float(rng.uniform(-0.3, 0.3))))
    if every or kind in ("motor loop", "plain"):
        # shorter than the least delay that counts as one
        changes.append(SecondOrderMotors(float(rng.uniform(0.005, 0.02))))
        changes.append(YieldingLoop(float(rng.uniform(0.0, 0.015))))
    if every or kind == "relief":
        changes.append(_relief(rng.uniform(0.003, 0.01), rng.uniform(0.4, 1.5, 2), 1, rng))
    if kind == "rough":
        changes.append(_relief(rng.uniform(0.002, 0.006), rng.uniform(1.0, 4.0, 2), 6, rng))
    return tuple(changes)


def _relief(gradient: float, lengths: Array, waves: int, rng: np.random.Generator) -> Relief:
    (x, y), (phase_x, phase_y) = map(float, lengths), map(float, rng.uniform(-3.1, 3.1, 2))
    return Relief(float(gradient), length_x=x, length_y=y, phase_x=phase_x, phase_y=phase_y, waves=float(waves))


def _other(soil: Soil, rng: np.random.Generator) -> Soil:
    """The field's own soil: strength 10, stiffness 12, K 10, n 5 percent off the nominal one."""
    strength, stiffness, shear, exponent = np.exp(np.array([0.1, 0.12, 0.1, 0.05]) * rng.standard_normal(4))
    return replace(
        soil,
        cohesion=soil.cohesion * float(strength),
        friction_angle=float(math.atan(math.tan(soil.friction_angle) * strength)),
        cohesive_modulus=soil.cohesive_modulus * float(stiffness),
        frictional_modulus=soil.frictional_modulus * float(stiffness),
        shear_modulus=soil.shear_modulus * float(shear),
        sinkage_exponent=soil.sinkage_exponent * float(exponent),
    )


def _field(soil: Soil, reach: float, spread: float, rng: np.random.Generator) -> SoilField:
    """Strength and stiffness as smooth random fields, correlated over 0.5 to 3 m."""
    from scipy.ndimage import gaussian_filter

    nodes = int(2.0 * reach / _SPACING) + 2
    values = np.broadcast_to(soil_vector(soil), (nodes, nodes, 9)).copy()
    for entries, times in (((0, 1), 1.0), ((3, 4), 1.5)):
        smooth = gaussian_filter(rng.standard_normal((nodes, nodes)), rng.uniform(0.5, 3.0) / _SPACING)
        factor = np.exp(times * spread * smooth / smooth.std())
        values[..., list(entries)] *= factor[..., None]
    return SoilField((-reach, -reach), (_SPACING, _SPACING), values)
