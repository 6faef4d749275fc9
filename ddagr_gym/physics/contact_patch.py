"""The kernel: stresses integrated over the contact patch (theory: wheel model, section 5).

Loops run over nodes inside one wheel, never over the batch, so a result cannot depend on the batch. Front and
rear of the patch share the normal stress: behind the peak A.7 maps each angle to one in front with the same u.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel, stack_array
from ddagr_gym.physics.contact_geometry import (
    AREA,
    COS_ENTRY,
    ENTRY,
    LANES,
    LATERAL_Y,
    NORMAL_Y,
    RHO,
    SECTION_SIZE,
    SIN_ENTRY,
    V_X_LOCAL,
    Y_LOCAL,
    fill_section,
    lateral_edge,
    sin_edge,
)
from ddagr_gym.physics.contact_stress import (
    forward_slip_ratio,
    normal_stress,
    peak_fraction,
    pressure_modulus,
    shear_over_speed,
)
from ddagr_gym.physics.fast_math import cos_small, sin_small
from ddagr_gym.physics.layout import (
    SOIL_COHESION,
    SOIL_COHESIVE_MODULUS,
    SOIL_EXIT_RATIO,
    SOIL_EXPONENT,
    SOIL_FRICTION_TANGENT,
    SOIL_FRICTIONAL_MODULUS,
    SOIL_PEAK_0,
    SOIL_PEAK_1,
    SOIL_SHEAR_MODULUS,
)
from ddagr_gym.physics.numerics import PatchNumerics

Array = NDArray[np.float64]

WRENCH = 5
"""F_x, F_y, F_z [N], M_z, axle torque [N m] of the soil on the wheel, at the hub, wheel axes."""

# Rows besides those of the section, LANES entries each: the slice's motion, sums over theta of its normal, lateral and
# tangential force per area, plain and times cos(theta) and sin(theta), and its wrench
(
    RIM_SPEED, SIDE, TURN, PRESSURE, PRESSURE_COS, PRESSURE_SIN, LATERAL, LATERAL_COS, LATERAL_SIN, TANGENTIAL,
    TANGENTIAL_COS, TANGENTIAL_SIN, _WRENCH,
) = (SECTION_SIZE + LANES * i for i in range(13))  # fmt: skip
_SIZE = _WRENCH + WRENCH * LANES


class WheelMotion(NamedTuple):
    """Motion of a wheel in its own axes.

    Attributes:
        v_x: velocity of the hub forward [m/s].
        v_y: velocity of the hub to the left [m/s].
        omega: wheel speed, rolling forward positive [rad/s].
        yaw_rate: of the wheel about the vertical, counter-clockwise positive [rad/s].
    """

    v_x: float
    v_y: float
    omega: float
    yaw_rate: float


@kernel(inline=True)
def _begin_slices(work: Array, v_y: float, omega: float, yaw_rate: float) -> None:
    """Motion of the slices, V_t = V_X_LOCAL cos(theta) - RIM_SPEED, V_l = SIDE + TURN sin(theta), and empty sums."""
    for i in range(LANES):
        work[RIM_SPEED + i] = omega * work[RHO + i]
        work[SIDE + i] = work[LATERAL_Y + i] * v_y
        work[TURN + i] = work[LATERAL_Y + i] * yaw_rate * work[RHO + i] - work[NORMAL_Y + i] * work[V_X_LOCAL + i]
    for i in range(PRESSURE, _WRENCH):
        work[i] = 0.0


@kernel(inline=True)
def _add_node(
    i: int, work: Array, cos_theta: float, sin_theta: float, swept: float, sigma: float, strength: float, decay: float
) -> None:
    """Add the stresses at theta = theta_f - swept, already times the weight of the node, to the sums of slice i."""
    v_x = work[V_X_LOCAL + i]
    v_t = v_x * cos_theta - work[RIM_SPEED + i]
    v_l = work[SIDE + i] + sin_theta * work[TURN + i]
    j_t = v_x * (work[SIN_ENTRY + i] - sin_theta) - work[RIM_SPEED + i] * swept
    j_l = work[TURN + i] * (cos_theta - work[COS_ENTRY + i]) + work[SIDE + i] * swept
    drag = shear_over_speed(strength, j_t, j_l, v_t, v_l, decay)
    lateral = drag * v_l
    tangential = drag * v_t
    work[PRESSURE + i] += sigma
    work[PRESSURE_COS + i] += sigma * cos_theta
    work[PRESSURE_SIN + i] += sigma * sin_theta
    work[LATERAL + i] += lateral
    work[LATERAL_COS + i] += lateral * cos_theta
    work[LATERAL_SIN + i] += lateral * sin_theta
    work[TANGENTIAL + i] += tangential
    work[TANGENTIAL_COS + i] += tangential * cos_theta
    work[TANGENTIAL_SIN + i] += tangential * sin_theta


@kernel(inline=True)
def _add_slices(work: Array) -> None:
    """Add the wrench of each slice, dF = -(sigma n + tau_t t + tau_l l) dS, in the axes of the wheel."""
    for i in range(LANES):
        normal_y = work[NORMAL_Y + i]
        lateral_y = work[LATERAL_Y + i]
        area = work[AREA + i]
        rho = work[RHO + i]
        # n and l in the wheel plane point along (sin, -cos) and (-sin, cos) of theta
        radial_cos = lateral_y * work[PRESSURE_COS + i] - normal_y * work[LATERAL_COS + i]
        radial_sin = lateral_y * work[PRESSURE_SIN + i] - normal_y * work[LATERAL_SIN + i]
        f_x = -area * (work[TANGENTIAL_COS + i] + radial_sin)
        f_y = -area * (lateral_y * work[LATERAL + i] + normal_y * work[PRESSURE + i])
        f_y_sin = -area * (lateral_y * work[LATERAL_SIN + i] + normal_y * work[PRESSURE_SIN + i])
        work[_WRENCH + i] += f_x
        work[_WRENCH + LANES + i] += f_y
        work[_WRENCH + 2 * LANES + i] += area * (radial_cos - work[TANGENTIAL_SIN + i])
        work[_WRENCH + 3 * LANES + i] += rho * f_y_sin - work[Y_LOCAL + i] * f_x
        work[_WRENCH + 4 * LANES + i] += rho * area * work[TANGENTIAL + i]


@kernel()
def integrate_patch(
    wheel: Array, soil: Array, motion: WheelMotion, sinkage: float, numerics: PatchNumerics, wrench: Array
) -> None:
    """Wrench on a wheel that travels forward (R0 omega + v_x >= 0) at a given sinkage in (0, minor_radius].

    Args:
        wheel: (minor_radius, half_width, major_radius) [m].
        soil: nine parameters in the order of ``layout.SOIL_PARAMETERS``.
        motion: of the wheel.
        sinkage: [m].
        numerics: quadrature.
        wrench: WRENCH floats, the result.
    """
    v_x, v_y, omega, yaw_rate = motion
    section_nodes, contact_nodes = numerics.section_nodes, numerics.contact_nodes
    outer_radius = wheel[0] + wheel[2]
    hub_height = outer_radius - sinkage
    edge = lateral_edge(wheel[0], sinkage)
    slip = forward_slip_ratio(outer_radius * omega, v_x, numerics.rest_speed)
    peak = peak_fraction(soil[SOIL_PEAK_0], soil[SOIL_PEAK_1], slip)
    modulus = pressure_modulus(
        soil[SOIL_COHESIVE_MODULUS], soil[SOIL_FRICTIONAL_MODULUS], wheel[1], sin_edge(wheel[0], sinkage)
    )
    rate = max(max(abs(omega), abs(v_x) / outer_radius), numerics.minimum_shear_rate)
    decay = -1.0 / (rate * soil[SOIL_SHEAR_MODULUS])
    front, rear = 1.0 - peak, peak + soil[SOIL_EXIT_RATIO]
    work = stack_array(_SIZE)
    for i in range(_WRENCH, _SIZE):
        work[i] = 0.0
    for first in range(0, section_nodes.shape[0] // 2, LANES):
        fill_section(wheel[0], wheel[1], wheel[2], hub_height, edge, v_x, yaw_rate, section_nodes, first, work)
        _begin_slices(work, v_y, omega, yaw_rate)
        for k in range(contact_nodes.shape[1]):
            front_swept, rear_swept = front * contact_nodes[0, k], front + rear - rear * contact_nodes[0, k]
            front_weight, rear_weight = front * contact_nodes[1, k], rear * contact_nodes[1, k]
            for i in range(LANES):
                swept = work[ENTRY + i] * front_swept
                cos_theta = cos_small(work[ENTRY + i] - swept)
                sigma = normal_stress(modulus, soil[SOIL_EXPONENT], work[RHO + i] * cos_theta - hub_height)
                strength = soil[SOIL_COHESION] + sigma * soil[SOIL_FRICTION_TANGENT]
                _add_node(
                    i, work, cos_theta, sin_small(work[ENTRY + i] - swept), swept, front_weight * sigma,
                    front_weight * strength, decay,
                )  # fmt: skip
                swept = work[ENTRY + i] * rear_swept
                _add_node(
                    i, work, cos_small(work[ENTRY + i] - swept), sin_small(work[ENTRY + i] - swept), swept,
                    rear_weight * sigma, rear_weight * strength, decay,
                )  # fmt: skip
        _add_slices(work)
    # written out: as a function of its own this sum costs a sixth of the simulator's speed
    for half in (4, 2, 1):
        for j in range(WRENCH):
            for i in range(half):
                work[_WRENCH + LANES * j + i] += work[_WRENCH + LANES * j + half + i]
    for j in range(WRENCH):
        wrench[j] = work[_WRENCH + LANES * j]


@kernel()
def wheel_wrench(
    wheel: Array, soil: Array, motion: WheelMotion, sinkage: float, numerics: PatchNumerics, wrench: Array
) -> None:
    """As :func:`integrate_patch` for any direction of travel; backwards is the mirror image in x.

    The side on which soil enters is the sign of R0 omega + v_x (the larger of the two decides). Where that sum is below
    ``rest_speed`` both images are blended, so that the force is continuous through rest (ours).
    Theory: wheel model, eq. (9), (10).
    """
    direction = (wheel[0] + wheel[2]) * motion.omega + motion.v_x
    forward = direction / numerics.rest_speed
    blend = 1.0
    if abs(forward) < 1.0:
        blend = 0.5 + forward * (0.75 - 0.25 * forward * forward)
    elif forward < 0.0:
        blend = 0.0
    if blend > 0.0:
        integrate_patch(wheel, soil, motion, sinkage, numerics, wrench)
        if blend == 1.0:
            return
    f_x, f_y, f_z, m_z, torque = wrench[0], wrench[1], wrench[2], wrench[3], wrench[4]
    mirrored = WheelMotion(-motion.v_x, motion.v_y, -motion.omega, -motion.yaw_rate)
    integrate_patch(wheel, soil, mirrored, sinkage, numerics, wrench)
    wrench[0] = -wrench[0]
    wrench[3] = -wrench[3]
    wrench[4] = -wrench[4]
    if blend > 0.0:
        wrench[0] += blend * (f_x - wrench[0])
        wrench[1] += blend * (f_y - wrench[1])
        wrench[2] += blend * (f_z - wrench[2])
        wrench[3] += blend * (m_z - wrench[3])
        wrench[4] += blend * (torque - wrench[4])
