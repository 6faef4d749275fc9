"""Forces on a single wheel: the stable entry points (theory: wheel model, section 5)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.jit import kernel, stack_array
from ddagr_gym.parameters import Numerics, Soil, TorusWheel
from ddagr_gym.physics.contact_patch import WRENCH, WheelMotion, wheel_wrench
from ddagr_gym.physics.contact_stress import slip_ratio
from ddagr_gym.physics.numerics import PatchNumerics, patch_numerics
from ddagr_gym.physics.sinkage import SinkageStatus, solve_sinkage

Array = NDArray[np.float64]


@dataclass(frozen=True)
class WheelForce:
    """Soil's wrench on a wheel, at the hub, in wheel axes (x forward, y left, z up).

    Attributes:
        force: (..., 3) [N].
        yaw_moment: (...) M_z [N m].
        axle_torque: (...) the soil's moment about the hub's y axis [N m]; negative brakes a driven wheel.
        slip_ratio: (...) [-] (theory: wheel model, eq. (8)).
    """

    force: Array
    yaw_moment: Array
    axle_torque: Array
    slip_ratio: Array


def soil_vector(soil: Soil) -> Array:
    """Soil as the kernel reads it, shape (9,), in the order of ``layout.SOIL_PARAMETERS``."""
    return np.array(
        [
            soil.cohesion,
            math.tan(soil.friction_angle),
            soil.sinkage_exponent,
            soil.cohesive_modulus,
            soil.frictional_modulus,
            soil.shear_modulus,
            soil.peak_stress_coefficient_0,
            soil.peak_stress_coefficient_1,
            soil.exit_angle_ratio,
        ]
    )


def wheel_vector(wheel: TorusWheel) -> Array:
    """Wheel as the kernel reads it: (minor_radius, half_width, major_radius)."""
    return np.array([wheel.minor_radius, wheel.half_width, wheel.major_radius])


@kernel(inline=True)
def _motion(state: Array) -> WheelMotion:
    return WheelMotion(state[0], state[1], state[2], state[3])


@kernel()
def _wrenches(wheel: Array, soil: Array, states: Array, numerics: PatchNumerics, wrenches: Array) -> None:
    for i in range(states.shape[0]):
        wheel_wrench(wheel, soil, _motion(states[i]), states[i, 4], numerics, wrenches[i])
        wrenches[i, WRENCH] = slip_ratio((wheel[0] + wheel[2]) * states[i, 2], states[i, 0])


@kernel()
def _sinkages(
    wheel: Array, soil: Array, states: Array, tolerance: float, numerics: PatchNumerics, sinkage: Array,
    status: NDArray[np.int64],
) -> None:  # fmt: skip
    wrench = stack_array(WRENCH)
    for i in range(states.shape[0]):
        if states[i, 4] <= 0.0:
            status[i] = 2
            continue
        sinkage[i], bogged = solve_sinkage(
            wheel, soil, _motion(states[i]), states[i, 4], 0.3 * wheel[0], tolerance, numerics, wrench
        )
        status[i] = 1 if bogged else 0


def finite_array(name: str, values: ArrayLike) -> Array:
    """``values`` as float64, or one sentence when they are no finite numbers."""
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name} is {values!r}: give numbers, in an array of regular shape.") from None
    if not np.all(np.isfinite(array)):
        bad = array[~np.isfinite(array)].flat[0]
        raise InputError(f"{name} contains {bad}: give finite values.")
    return array


def _broadcast(names: tuple[str, ...], values: tuple[ArrayLike, ...]) -> tuple[Array, tuple[int, ...]]:
    arrays = [finite_array(name, value) for name, value in zip(names, values, strict=True)]
    try:
        shape = np.broadcast_shapes(*(array.shape for array in arrays))
    except ValueError:
        shapes = ", ".join(f"{n} {a.shape}" for n, a in zip(names, arrays, strict=True))
        raise InputError(f"shapes do not broadcast: {shapes}.") from None
    states = np.empty((*shape, len(arrays)))
    for j, array in enumerate(arrays):
        states[..., j] = array
    return states.reshape(-1, len(arrays)), shape


def wheel_force(
    wheel: TorusWheel,
    soil: Soil,
    v_x: ArrayLike,
    v_y: ArrayLike,
    omega: ArrayLike,
    yaw_rate: ArrayLike,
    sinkage: ArrayLike,
    *,
    numerics: Numerics = Numerics(),
) -> WheelForce:
    """Force of the soil on a wheel at a given sinkage (theory: wheel model, eq. (17), (18)).

    Args:
        wheel: geometry.
        soil: parameters.
        v_x: hub velocity forward [m/s]; this and the following broadcast against each other.
        v_y: hub velocity to the left [m/s].
        omega: wheel speed, rolling forward positive [rad/s].
        yaw_rate: of the wheel about the vertical, counter-clockwise positive [rad/s].
        sinkage: in (0, wheel.minor_radius] [m].
        numerics: quadrature; the default keeps the force within 1e-3 of the converged one.

    Raises:
        InputError: a value that is not finite, shapes that do not broadcast, a sinkage outside its range.
    """
    states, shape = _broadcast(("v_x", "v_y", "omega", "yaw_rate", "sinkage"), (v_x, v_y, omega, yaw_rate, sinkage))
    outside = (states[:, 4] <= 0) | (states[:, 4] > wheel.minor_radius)
    if outside.any():
        raise InputError(
            f"sinkage is {states[outside, 4][0]:g} m: the torus model holds in (0, {wheel.minor_radius:g}] m "
            "(minor_radius); use equilibrium_sinkage to find one."
        )
    wrenches = np.empty((states.shape[0], WRENCH + 1))
    _wrenches(wheel_vector(wheel), soil_vector(soil), states, patch_numerics(numerics), wrenches)
    yaw_moment, torque, slip = (wrenches[:, j].reshape(shape) for j in (3, 4, 5))
    return WheelForce(wrenches[:, :3].reshape(*shape, 3), yaw_moment, torque, slip)


def equilibrium_sinkage(
    wheel: TorusWheel,
    soil: Soil,
    v_x: ArrayLike,
    v_y: ArrayLike,
    omega: ArrayLike,
    yaw_rate: ArrayLike,
    load: ArrayLike,
    *,
    numerics: Numerics = Numerics(),
) -> tuple[Any, Any]:
    """Sinkage at which the soil carries the load, and a status for each (thesis A.4).

    Args:
        wheel: geometry.
        soil: parameters.
        v_x: as in :func:`wheel_force`; this and the following broadcast.
        v_y: hub velocity to the left [m/s].
        omega: wheel speed [rad/s].
        yaw_rate: [rad/s].
        load: vertical load [N].
        numerics: quadrature and tolerance.

    Returns:
        ``(sinkage, status)``: arrays of the broadcast shape, or a float and a :class:`SinkageStatus` for scalars.
        A bogged wheel has sinkage ``minor_radius``; it is never NaN.

    Raises:
        InputError: a value that is not finite or shapes that do not broadcast.
    """
    states, shape = _broadcast(("v_x", "v_y", "omega", "yaw_rate", "load"), (v_x, v_y, omega, yaw_rate, load))
    sinkage = np.zeros(states.shape[0])
    status = np.zeros(states.shape[0], dtype=np.int64)
    tolerance = min(numerics.sinkage_tolerance, 1e-6)
    rules = patch_numerics(numerics)
    _sinkages(wheel_vector(wheel), soil_vector(soil), states, tolerance, rules, sinkage, status)
    if shape == ():
        return float(sinkage[0]), SinkageStatus(int(status[0]))
    return sinkage.reshape(shape), status.reshape(shape)
