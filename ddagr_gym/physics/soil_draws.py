"""Random soils: named ranges, draws from them that do not immobilise the robot, and soil that varies by place.

A soil is not nine independent numbers (theory: wheel model, eq. (39)). k_phi's unit depends on the exponent n, so n and
the pressure of a plate at 3 cm are drawn and the moduli derived; cohesion and shear modulus follow n as published soils
do.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.config import config_names, find_config, load_config
from ddagr_gym.errors import InputError
from ddagr_gym.parameters import STANDARD_GRAVITY, Robot, Soil
from ddagr_gym.physics.layout import (
    SOIL_COHESION,
    SOIL_COHESIVE_MODULUS,
    SOIL_FRICTION_TANGENT,
    SOIL_FRICTIONAL_MODULUS,
)
from ddagr_gym.physics.sinkage import SinkageStatus
from ddagr_gym.physics.terrain import SoilField
from ddagr_gym.physics.wheel_forces import equilibrium_sinkage, soil_vector, wheel_force

Array = NDArray[np.float64]

REFERENCE_SINKAGE = 0.03
"""Depth at which the plate pressure is drawn [m]: about a small robot's rut."""
REFERENCE_WIDTH = 0.1
"""Plate width of that pressure [m]."""

CORRELATED = ("sinkage_exponent", "reference_pressure", "cohesion", "shear_modulus", "friction_angle")
_LOGARITHMIC = ("reference_pressure", "cohesion", "shear_modulus")
CORRELATIONS = np.array(
    [
        [1.00, -0.21, -0.68, 0.51, 0.28],
        [-0.21, 1.00, 0.50, -0.62, 0.24],
        [-0.68, 0.50, 1.00, -0.62, -0.24],
        [0.51, -0.62, -0.62, 1.00, 0.43],
        [0.28, 0.24, -0.24, 0.43, 1.00],
    ]
)
"""Of n, ln p(3 cm), ln c, ln K and phi over the 18 field soils of Wong's table (snow and simulants left out)."""

_MOST_REJECTIONS = 1000  # ours: ranges in which less than one soil in a thousand can be driven on are a mistake
_SPEED = 0.2  # [m/s]; forces do not depend on it
# Slips that are tried (ours): forces saturate beyond a few tenths, so the outer ones lie wider apart
_STRAIGHT_SLIPS = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
_OUTER_SLIPS = np.array([0.05, 0.1, 0.2, 0.35, 0.55, 0.75, 0.9])
"""Of the outer bank, which drives (ours: denser below 0.4, where forces still rise)."""

_INNER_SLIPS = np.array([-0.95, -0.5, -0.2, -0.1, -0.05, 0.0, 0.05, 0.1, 0.2, 0.35, 0.55, 0.75, 0.9])
"""Of the inner bank, which may brake as well (ours: the same on either side of zero, but coarser where it brakes)."""

_PARTS = 6  # between two slips the forces are interpolated
_TIGHTEST = 1.05  # half tracks: closer in, the inner bank stands still or reverses and slip says nothing

Range = tuple[float, float]


@dataclass(frozen=True)
class SoilDistribution:
    """Ranges from which soils are drawn, and why they are so wide.

    Marginals are uniform, in the logarithm for pressure, cohesion and shear modulus; the five parameters of
    ``CORRELATED`` are joined by a Gaussian copula, the others are independent.

    Attributes:
        description: one line.
        sinkage_exponent: n [-].
        reference_pressure: under a plate 0.1 m wide at 3 cm [Pa].
        cohesive_share: of that pressure due to k_c, (k_c/0.1 m)/(k_c/0.1 m + k_phi) [-].
        cohesion: c [Pa].
        friction_angle: phi [rad].
        shear_modulus: K [m].
        peak_stress_coefficient_0: a0 [-].
        peak_stress_coefficient_1: a1 [-].
        exit_angle_ratio: -theta_r/theta_f [-].
        reasons: why each range is what it is, by the names above.
    """

    description: str
    sinkage_exponent: Range
    reference_pressure: Range
    cohesive_share: Range
    cohesion: Range
    friction_angle: Range
    shear_modulus: Range
    peak_stress_coefficient_0: Range
    peak_stress_coefficient_1: Range
    exit_angle_ratio: Range
    reasons: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in self.range_names():
            low, high = getattr(self, name)
            least = 1e-9 if name in (*_LOGARITHMIC, "sinkage_exponent") else 0.0
            if not (math.isfinite(low) and math.isfinite(high) and least <= low <= high):
                raise InputError(f"SoilDistribution.{name} is ({low:g}, {high:g}): give {least:g} <= low <= high.")
        for name in self.reasons:
            if name not in self.range_names():
                raise InputError(f"SoilDistribution.reasons has {name!r}: it takes {', '.join(self.range_names())}.")
        for corner in (0, 1):
            self._build({name: getattr(self, name)[corner] for name in self.range_names()})

    @classmethod
    def range_names(cls) -> tuple[str, ...]:
        """Fields that are ranges."""
        return tuple(item.name for item in fields(cls) if item.name not in ("description", "reasons"))

    def sample(self, rng: np.random.Generator) -> Soil:
        """One soil, whether or not a robot can move on it; uses the same number of draws each time."""
        correlated = _CHOLESKY @ rng.standard_normal(len(CORRELATED))
        shares = dict(zip(CORRELATED, 0.5 * (1.0 + _erf(correlated / math.sqrt(2.0))), strict=True))
        others = [name for name in self.range_names() if name not in CORRELATED]
        shares |= dict(zip(others, rng.uniform(size=len(others)), strict=True))
        values = {}
        for name, share in shares.items():
            low, high = getattr(self, name)
            values[name] = low * (high / low) ** share if name in _LOGARITHMIC else low + share * (high - low)
        return self._build(values)

    @staticmethod
    def _build(values: Mapping[str, float]) -> Soil:
        given = {name: float(value) for name, value in values.items()}
        modulus = given.pop("reference_pressure") / REFERENCE_SINKAGE ** given["sinkage_exponent"]
        share = given.pop("cohesive_share")
        return Soil(
            cohesive_modulus=share * modulus * REFERENCE_WIDTH, frictional_modulus=(1.0 - share) * modulus, **given
        )


def _erf(values: Array) -> Array:
    return np.array([math.erf(value) for value in values])


# The copula's normal correlation that gives uniform marginals the stated one (Pearson 1907).
_CHOLESKY = np.linalg.cholesky(2.0 * np.sin(np.pi / 6.0 * CORRELATIONS))


def distribution_names() -> tuple[str, ...]:
    """Names that :func:`get_distribution` takes: the files of configs/soils."""
    return config_names("soils")


def get_distribution(name: str | os.PathLike[str]) -> SoilDistribution:
    """Soil distribution by name, or from a YAML file of one's own.

    Raises:
        InputError: unknown name, with the closest ones; a file that is missing or not valid.
    """
    return load_config(find_config("soils", name), SoilDistribution)


def draw_soil(
    distribution: SoilDistribution, rng: np.random.Generator, robot: Robot, *, turn_radius: float = 0.8
) -> tuple[Soil, int]:
    """Soil on which ``robot`` can drive and turn, and how many draws before it were rejected.

    The same generator state gives the same soil. See :func:`immobilises` for the criterion.

    Args:
        distribution: what to draw from.
        rng: source of randomness.
        robot: the robot.
        turn_radius: that it must be able to hold [m].

    Raises:
        InputError: 1000 draws in a row were rejected.
    """
    for rejected in range(_MOST_REJECTIONS):
        soil = distribution.sample(rng)
        if not immobilises(soil, robot, turn_radius=turn_radius):
            return soil, rejected
    raise InputError(
        f"{_MOST_REJECTIONS} soils in a row immobilise the robot {robot.name!r}: raise cohesion, friction_angle or "
        f"reference_pressure of the soil distribution."
    )


def immobilises(soil: Soil, robot: Robot, *, turn_radius: float = 0.8) -> bool:
    """Whether ``robot`` cannot drive or turn on a soil, by the balance of forces at steady speed (ours).

    True when, at the static load of the heaviest wheel, (1) a wheel is bogged at a slip from 0 to 1; (2) no slip gives
    net traction; or (3) no pair of bank slips up to 0.9 keeps, with no wheel bogged, both the speed and the yaw rate of
    a turn of ``turn_radius`` [m] without side slip of the body origin.
    """
    forward, bogged = _straight_pull(soil, robot)
    if bogged or forward <= 0.0:
        return True
    yaw_rate = _SPEED / max(turn_radius, _TIGHTEST * robot.half_track)
    outer = _turning_wrench(soil, robot, yaw_rate, 1.0, _OUTER_SLIPS)
    inner = _turning_wrench(soil, robot, yaw_rate, -1.0, _INNER_SLIPS)
    pull, moment = (outer[k][:, None] + inner[k][None, :] for k in (0, 1))
    return not bool(((pull >= 0.0) & (moment >= 0.0)).any())


def _static_load(robot: Robot) -> float:
    """Of the wheel nearest to the centre of mass [N]."""
    x, y, _ = robot.centre_of_mass
    share = (1.0 + abs(x) / robot.half_wheelbase) * (1.0 + abs(y) / robot.half_track)
    return 0.25 * robot.mass * STANDARD_GRAVITY * share


def _wheel_speed(v_x: Array, slip: Array, radius: float) -> tuple[Array, Array]:
    """Hub and bank speed of a slip ratio at a hub speed; at slip 1 the wheel spins on the spot."""
    driven = slip >= 0.0
    hub = np.where(slip >= 1.0, 0.0, v_x)
    rim = np.where(driven, v_x / np.where(slip >= 1.0, 1.0, 1.0 - np.maximum(slip, 0.0)), v_x * (1.0 + slip))
    return hub, rim / radius


def _carried(
    soil: Soil, robot: Robot, v_x: Array, v_y: Array, omega: Array, yaw_rate: float
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Forces (..., 3) and yaw moments of a wheel at the sinkage that carries it, and where it is bogged."""
    wheel, load = robot.wheels[0], _static_load(robot)
    sinkage, status = equilibrium_sinkage(wheel, soil, v_x, v_y, omega, yaw_rate, load)
    result = wheel_force(wheel, soil, v_x, v_y, omega, yaw_rate, sinkage)
    return result.force, result.yaw_moment, np.asarray(status == SinkageStatus.BOGGED)


def _straight_pull(soil: Soil, robot: Robot) -> tuple[float, bool]:
    """Greatest net traction of a wheel in straight travel [N], and whether it is bogged at any slip."""
    radius = robot.wheels[0].outer_radius
    v_x, omega = _wheel_speed(np.full(_STRAIGHT_SLIPS.size, _SPEED), _STRAIGHT_SLIPS, radius)
    force, _, bogged = _carried(soil, robot, v_x, np.zeros_like(v_x), omega, 0.0)
    return float(force[:, 0].max()), bool(bogged.any())


def _turning_wrench(soil: Soil, robot: Robot, yaw_rate: float, bank: float, slips: Array) -> tuple[Array, Array]:
    """Pull and moment about the body origin of one bank's two wheels at each slip, in a left turn.

    ``bank`` is 1 for the outer (right) one, -1 for the inner. Minus infinity where a wheel is bogged.
    """
    y = -bank * robot.half_track
    hub = np.full(slips.size, _SPEED - yaw_rate * y)
    v_x, omega = _wheel_speed(hub, slips, robot.wheels[0].outer_radius)
    x = np.array([[robot.half_wheelbase], [-robot.half_wheelbase]])
    v_y = np.broadcast_to(yaw_rate * x, (2, slips.size))
    force, own, bogged = _carried(
        soil, robot, np.broadcast_to(v_x, v_y.shape), v_y, np.broadcast_to(omega, v_y.shape), yaw_rate
    )
    moment = (x * force[..., 1] - y * force[..., 0] + own).sum(axis=0)
    stuck = np.asarray(bogged.any(axis=0))
    fine = np.interp(np.arange(_PARTS * (slips.size - 1) + 1) / _PARTS, np.arange(slips.size), slips)
    return _between(slips, force[..., 0].sum(axis=0), stuck, fine), _between(slips, moment, stuck, fine)


def _between(slips: Array, values: Array, stuck: NDArray[np.bool_], fine: Array) -> Array:
    """Values at the slips ``fine``, linear between ``slips``; minus infinity beside a slip at which they are stuck."""
    blocked = np.interp(fine, slips, stuck.astype(float)) > 0.0
    return np.where(blocked, -np.inf, np.interp(fine, slips, values))


# Soil that varies from place to place

_NODES_PER_LENGTH = 3.0  # bilinear interpolation between nodes then loses a tenth of the variance
_STIFFNESS_OVER_STRENGTH = 2.0  # relative scatter of cone index over that of shear strength, ours
_STRENGTH_AND_STIFFNESS = 0.5  # their correlation: ln c and ln p(3 cm) over Wong's soils
_LARGEST_DEVIATION = 3.0  # standard deviations


def soil_field(
    soil: Soil,
    rng: np.random.Generator,
    strength_variation: float,
    correlation_length: float,
    extent: tuple[float, float, float, float],
) -> SoilField:
    """Random field about ``soil``: lognormal factors on shear strength and, twice as variable, on stiffness.

    The correlation of the logarithms over a distance d is exp(-(d/correlation_length)^2); strength and stiffness
    correlate by 0.5. Fields of one extent and length have one shape.

    Args:
        soil: the mean.
        rng: source of randomness.
        strength_variation: standard deviation over mean of cohesion and tan(phi) [-], at most 0.5.
        correlation_length: [m].
        extent: world x_low, x_high, y_low, y_high [m].

    Raises:
        InputError: a value outside its bounds, or more than 512 nodes along a side.
    """
    x_low, x_high, y_low, y_high = extent
    if not 0.0 <= strength_variation <= 0.5:
        raise InputError(f"strength_variation is {strength_variation:g}: give 0 to 0.5, relative.")
    if not (correlation_length > 0.0 and x_high > x_low and y_high > y_low):
        raise InputError(f"soil field over {extent} m with correlation length {correlation_length:g} m: give x_low < "
                         "x_high, y_low < y_high and a positive length.")  # fmt: skip
    spacing = correlation_length / _NODES_PER_LENGTH
    shape = tuple(max(math.ceil(span / spacing), 1) + 1 for span in (x_high - x_low, y_high - y_low))
    if max(shape) > 512:
        raise InputError(f"soil field needs {shape[0]} x {shape[1]} nodes: give a longer correlation length.")
    first, second = (_gaussian_field(rng, shape) for _ in range(2))
    together = _STRENGTH_AND_STIFFNESS
    strength = _lognormal(first, strength_variation)
    stiffness = _lognormal(
        together * first + math.sqrt(1.0 - together**2) * second, _STIFFNESS_OVER_STRENGTH * strength_variation
    )
    values = np.tile(soil_vector(soil), (*shape, 1))
    values[..., (SOIL_COHESION, SOIL_FRICTION_TANGENT)] *= strength[..., None]
    values[..., (SOIL_COHESIVE_MODULUS, SOIL_FRICTIONAL_MODULUS)] *= stiffness[..., None]
    return SoilField((x_low, y_low), (spacing, spacing), values)


def _lognormal(normal: Array, variation: float) -> Array:
    """Factors of mean 1 and relative standard deviation ``variation`` from standard normal values."""
    deviation = math.sqrt(math.log1p(variation**2))
    return np.exp(deviation * np.clip(normal, -_LARGEST_DEVIATION, _LARGEST_DEVIATION) - 0.5 * deviation**2)


def _gaussian_field(rng: np.random.Generator, shape: tuple[int, ...]) -> Array:
    """Standard normal field with the correlation exp(-(k/_NODES_PER_LENGTH)^2) over k nodes.

    By circulant embedding (Dietrich and Newsam, SIAM J. Sci. Comput. 18 (1997) 1088) on a torus wide enough for the
    correlation to die out.
    """
    padded = tuple(nodes + math.ceil(5 * _NODES_PER_LENGTH) for nodes in shape)
    x, y = (np.minimum(np.arange(n), n - np.arange(n)) / _NODES_PER_LENGTH for n in padded)
    spectrum = np.fft.fft2(np.exp(-(x[:, None] ** 2) - y[None, :] ** 2)).real
    noise = np.fft.fft2(rng.standard_normal(padded))
    periodic = np.fft.ifft2(np.sqrt(np.maximum(spectrum, 0.0)) * noise).real
    return np.ascontiguousarray(periodic[: shape[0], : shape[1]])
