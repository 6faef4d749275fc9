"""Where the field is what: correlated soil variation, patches, relief, slope, ruts.

A random field is a sum of plane waves with Gaussian wave vectors (squared-exponential correlation).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .jit import kernel

NO_WAVES = np.zeros((1, 3))
NO_PATCHES = np.zeros((0, 7))
WHEELS_ALIKE = np.ones(4)
DISC, BAND = 0.0, 1.0
PATCH_EDGE = 0.06
"""Width of a patch's edge [m]."""
RUT_CELL = 0.05
"""Cell of the rut map [m]."""
RUT_CELLS = 512


class Ground(NamedTuple):
    """Ground of one case, in the world frame.

    ``*_waves`` are (waves, 3) arrays of wave vector [rad/m] and phase; ``patches`` are rows (kind, x, y, radius or
    half width [m], angle [rad], ln strength, ln stiffness).
    """

    strength_waves: np.ndarray = NO_WAVES
    stiffness_waves: np.ndarray = NO_WAVES
    relief_waves: np.ndarray = NO_WAVES
    strength_spread: float = 0.03  # standard deviation of ln strength [-]
    stiffness_spread: float = 0.03  # standard deviation of ln stiffness [-]
    relief_height: float = 0.0  # standard deviation of height [m]
    patches: np.ndarray = NO_PATCHES
    wheel_strength: np.ndarray = WHEELS_ALIKE  # factor under each wheel [-]
    wheel_stiffness: np.ndarray = WHEELS_ALIKE
    gradient_x: float = 0.0  # of height, world frame [-]
    gradient_y: float = 0.0
    ridge: float = 0.0  # relative change of the gradient across a line through (0, 0) [-]
    ridge_angle: float = 0.0  # of the line's normal [rad]
    bowl_x: float = 0.0  # lowest point [m]
    bowl_y: float = 0.0
    bowl_curvature: float = 0.0  # [1/m]
    bowl_limit: float = 0.08  # steepest gradient of the bowl [-]
    drying: float = 0.0  # growth of ln strength [1/s]
    onset: float = 0.0  # clock time of a change of the soil [s]
    onset_strength: float = 0.0  # that change of ln strength [-]
    onset_stiffness: float = 0.0  # and of ln stiffness [-]
    aging: float = 0.0  # gain of ln strength after long rest [-]
    furrow: float = 0.0  # relative growth of lateral force across the furrows [-]
    furrow_angle: float = 0.0  # of the furrows [rad]
    rut_mode: int = 0  # 0 none, 1 by alignment of the wheels, 2 by a map of earlier passes, 3 by a grid of depths
    rut_gain: float = 0.0  # stiffening by one pass, modes 1 and 2 [-]
    sinkage_mode: int = 0  # slip sinkage: 0 none, 1 immediate, 2 by soil dug out
    sinkage_gain: float = 0.0  # [-]
    bulldozing_mode: int = 0  # 0 none, 1 immediate, 2 growing with the berm
    bulldozing_gain: float = 0.0  # multiple of the passive earth pressure [-]
    rebound: float = 0.2  # share of a rut's depth that springs back, mode 3 [-]
    lateral: float = 1.0  # factor on all lateral wheel forces [-]


@kernel
def field_value(waves, x, y):  # type: ignore[no-untyped-def]
    """Value of a unit-variance random field at (x, y)."""
    total = 0.0
    for k in range(waves.shape[0]):
        total += math.cos(waves[k, 0] * x + waves[k, 1] * y + waves[k, 2])
    return total * math.sqrt(2.0 / waves.shape[0])


@kernel
def patch_cover(patch, x, y):  # type: ignore[no-untyped-def]
    """Share of a patch's effect at (x, y), 0 outside to 1 inside."""
    east, north = x - patch[1], y - patch[2]
    if patch[0] == BAND:
        distance = abs(east * math.cos(patch[4]) + north * math.sin(patch[4]))
    else:
        distance = math.hypot(east, north)
    return 0.5 - 0.5 * math.tanh((distance - patch[3]) / PATCH_EDGE)


@kernel
def local_factors(ground, wheel, x, y, time):  # type: ignore[no-untyped-def]
    """Factors on (strength, stiffness) of the soil under a wheel at (x, y) and ``time`` [s]."""
    strength = ground.strength_spread * field_value(ground.strength_waves, x, y) + ground.drying * time
    stiffness = ground.stiffness_spread * field_value(ground.stiffness_waves, x, y)
    if time >= ground.onset:
        strength += ground.onset_strength
        stiffness += ground.onset_stiffness
    for k in range(ground.patches.shape[0]):
        cover = patch_cover(ground.patches[k], x, y)
        strength += cover * ground.patches[k, 5]
        stiffness += cover * ground.patches[k, 6]
    return math.exp(strength) * ground.wheel_strength[wheel], math.exp(stiffness) * ground.wheel_stiffness[wheel]


@kernel
def relief(ground, x, y):  # type: ignore[no-untyped-def]
    """Height of the small relief at (x, y) [m]."""
    if ground.relief_height == 0.0:
        return 0.0
    return ground.relief_height * field_value(ground.relief_waves, x, y)


@kernel
def gradient(ground, x, y):  # type: ignore[no-untyped-def]
    """Gradient (world x, y) of the large-scale height at (x, y)."""
    across = x * math.cos(ground.ridge_angle) + y * math.sin(ground.ridge_angle)
    scale = 1.0 + ground.ridge * math.tanh(across / 1.0)
    g_x, g_y = scale * ground.gradient_x, scale * ground.gradient_y
    if ground.bowl_curvature != 0.0:
        east, north = x - ground.bowl_x, y - ground.bowl_y
        steep = ground.bowl_curvature * math.hypot(east, north) + 1e-12
        share = ground.bowl_limit * math.tanh(steep / ground.bowl_limit) / steep * ground.bowl_curvature
        g_x += share * east
        g_y += share * north
    return g_x, g_y


@kernel
def rut_index(x, y):  # type: ignore[no-untyped-def]
    """Cell of the rut map that holds (x, y); the map wraps around every 25.6 m."""
    return math.floor(x / RUT_CELL) % RUT_CELLS, math.floor(y / RUT_CELL) % RUT_CELLS


@kernel
def rut_share(ruts, x, y, yaw, time):  # type: ignore[no-untyped-def]
    """Share of the tyre's width at (x, y) that rolls where a wheel passed more than 0.8 s ago."""
    passed = 0
    for k in range(5):
        offset = 0.04 * (k - 2)
        i, j = rut_index(x - offset * math.sin(yaw), y + offset * math.cos(yaw))
        if ruts[i, j] < time - 0.8:
            passed += 1
        else:
            ruts[i, j] = min(ruts[i, j], time)
    return passed / 5.0


def random_waves(rng: np.random.Generator, correlation_length: float, waves: int = 32) -> np.ndarray:
    """Plane waves of a field whose correlation is exp(-d^2 / (2 correlation_length^2)) [m]."""
    vectors = rng.standard_normal((waves, 2)) / correlation_length
    return np.column_stack([vectors, rng.uniform(0.0, 2.0 * np.pi, waves)])
