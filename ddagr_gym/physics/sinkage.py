"""Sinkage at which the soil carries a wheel's load (theory: wheel model, eq. (20), (21); thesis A.4)."""

from __future__ import annotations

import math
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel
from ddagr_gym.physics.contact_patch import WheelMotion, wheel_wrench
from ddagr_gym.physics.numerics import PatchNumerics

MAXIMUM_ITERATIONS = 60
"""Ours: bisections alone, to which the search falls back, narrow a tyre's 5 cm below 1e-15 m in 46."""


class SinkageStatus(IntEnum):
    """Outcome of the search for the sinkage."""

    FOUND = 0
    """The soil carries the load at a sinkage in (0, minor_radius]."""
    BOGGED = 1
    """It does not at any: the sinkage returned is minor_radius. Remedy: firmer soil, less load, a larger wheel."""
    UNLOADED = 2
    """The load is zero or negative: no contact, sinkage 0."""


@kernel()
def solve_sinkage(
    wheel: NDArray[np.float64],
    soil: NDArray[np.float64],
    motion: WheelMotion,
    load: float,
    guess: float,
    tolerance: float,
    numerics: PatchNumerics,
    wrench: NDArray[np.float64],
) -> tuple[float, bool]:
    """Root of F_z(sinkage) = load in (0, minor_radius], and whether the wheel is bogged.

    F_z behaves as a power of the sinkage, so the search is a secant in logarithms, kept inside a bracket. On
    return ``wrench`` belongs to the sinkage returned; |F_z - load| <= tolerance * load unless bogged.
    """
    low = 0.0
    high = wheel[0]
    sinkage = min(max(guess, 1e-4 * high), high)
    power = 1.0
    last_log_sinkage = last_log_force = 0.0
    for iteration in range(MAXIMUM_ITERATIONS):
        wheel_wrench(wheel, soil, motion, sinkage, numerics, wrench)
        force = wrench[2]
        if abs(force - load) <= tolerance * load:
            return sinkage, False
        if force < load:
            if sinkage >= wheel[0]:
                return sinkage, True
            low = sinkage
        else:
            high = sinkage
        if high - low <= 1e-15:
            return sinkage, False
        log_sinkage = math.log(sinkage)
        log_force = math.log(force) if force > 0.0 else -700.0
        if iteration > 0 and log_sinkage != last_log_sinkage and force > 0.0:
            power = min(max((log_force - last_log_force) / (log_sinkage - last_log_sinkage), 0.2), 5.0)
        last_log_sinkage = log_sinkage
        last_log_force = log_force
        sinkage = math.exp(log_sinkage + (math.log(load) - log_force) / power) if force > 0.0 else high
        if sinkage >= high and high == wheel[0]:
            sinkage = high
        elif not low < sinkage < high or iteration % 8 == 7:
            sinkage = 0.5 * (low + high)
    return sinkage, False
