"""The kernel: stresses integrated over the contact patch (physics.md section 5).

Loops run over nodes inside one wheel, never over the batch, so a result cannot depend on the batch. Front and
rear of the patch share the normal stress: behind the peak A.7 maps each angle to one in front with the same u.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel
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

WRENCH = 5
"""F_x, F_y, F_z [N], M_z, axle torque [N m] of the soil on the wheel, at the hub, wheel axes."""

_SUM = SECTION_SIZE
WORKSPACE_SIZE = SECTION_SIZE + WRENCH * LANES


@kernel(inline=True)
def _add_node(
    i: int,
    workspace: NDArray[np.float64],
    cos_theta: float,
    sin_theta: float,
    swept: float,
    v_y: float,
    omega: float,
    yaw_rate: float,
    sigma: float,
    strength: float,
    decay: float,
    weight: float,
) -> None:
    """Add the force on one surface element at theta = theta_f - swept."""
    rho = workspace[RHO + i]
    normal_y = workspace[NORMAL_Y + i]
    lateral_y = workspace[LATERAL_Y + i]
    v_x = workspace[V_X_LOCAL + i]
    area = workspace[AREA + i] * weight
    side = lateral_y * v_y
    turn = lateral_y * yaw_rate * rho - normal_y * v_x
    v_t = v_x * cos_theta - omega * rho
    v_l = side + sin_theta * turn
    j_t = v_x * (workspace[SIN_ENTRY + i] - sin_theta) - omega * rho * swept
    j_l = turn * (cos_theta - workspace[COS_ENTRY + i]) + side * swept
    drag = -area * shear_over_speed(strength, j_t, j_l, v_t, v_l, decay)
    pressure = area * sigma
    lateral = drag * v_l
    # radial and tangential parts of the force in the wheel plane, then the world directions
    radial = pressure * lateral_y + lateral * normal_y
    tangential = drag * v_t
    f_x = tangential * cos_theta - radial * sin_theta
    f_y = lateral * lateral_y - pressure * normal_y
    f_z = tangential * sin_theta + radial * cos_theta
    workspace[_SUM + i] += f_x
    workspace[_SUM + LANES + i] += f_y
    workspace[_SUM + 2 * LANES + i] += f_z
    workspace[_SUM + 3 * LANES + i] += rho * sin_theta * f_y - workspace[Y_LOCAL + i] * f_x
    workspace[_SUM + 4 * LANES + i] -= rho * tangential


@kernel()
def integrate_patch(
    wheel: NDArray[np.float64],
    soil: NDArray[np.float64],
    v_x: float,
    v_y: float,
    omega: float,
    yaw_rate: float,
    sinkage: float,
    minimum_shear_rate: float,
    rest_speed: float,
    section_nodes: NDArray[np.float64],
    contact_nodes: NDArray[np.float64],
    workspace: NDArray[np.float64],
    wrench: NDArray[np.float64],
) -> None:
    """Wrench on a wheel that travels forward (R0 omega + v_x >= 0) at a given sinkage in (0, minor_radius].

    Args:
        wheel: (minor_radius, half_width, major_radius) [m].
        soil: nine parameters in the order of ``layout.SOIL_PARAMETERS``.
        v_x: hub velocity along the wheel [m/s].
        v_y: hub velocity to the left [m/s].
        omega: wheel speed, forward positive [rad/s].
        yaw_rate: spin of the wheel about the vertical [rad/s].
        sinkage: [m].
        minimum_shear_rate: nu_min [rad/s].
        rest_speed: see :func:`wheel_wrench` [m/s].
        section_nodes: from ``contact_geometry.section_rule``.
        contact_nodes: from ``contact_geometry.contact_rule``.
        workspace: WORKSPACE_SIZE floats, overwritten.
        wrench: WRENCH floats, the result.
    """
    outer_radius = wheel[0] + wheel[2]
    edge = lateral_edge(wheel[0], sinkage)
    slip = forward_slip_ratio(outer_radius * omega, v_x, rest_speed)
    peak = peak_fraction(soil[SOIL_PEAK_0], soil[SOIL_PEAK_1], slip)
    modulus = pressure_modulus(soil[SOIL_COHESIVE_MODULUS], soil[SOIL_FRICTIONAL_MODULUS], wheel[1], math.sin(edge))
    rate = max(max(abs(omega), abs(v_x) / outer_radius), minimum_shear_rate)
    decay = -1.0 / (rate * soil[SOIL_SHEAR_MODULUS])
    exponent = soil[SOIL_EXPONENT]
    cohesion = soil[SOIL_COHESION]
    friction = soil[SOIL_FRICTION_TANGENT]
    front = 1.0 - peak
    rear = peak + soil[SOIL_EXIT_RATIO]
    contact = 1.0 + soil[SOIL_EXIT_RATIO]
    for i in range(WRENCH * LANES):
        workspace[_SUM + i] = 0.0
    for first in range(0, section_nodes.shape[0] // 2, LANES):
        fill_section(
            wheel[0], wheel[1], wheel[2], outer_radius - sinkage, edge, v_x, yaw_rate, section_nodes, first, workspace
        )
        for k in range(contact_nodes.shape[1]):
            u_squared = contact_nodes[0, k]
            weight = contact_nodes[1, k]
            for i in range(LANES):
                theta_f = workspace[ENTRY + i]
                swept = theta_f * front * u_squared
                cos_theta = cos_small(theta_f - swept)
                depth = workspace[RHO + i] * (cos_theta - workspace[COS_ENTRY + i])
                sigma = normal_stress(modulus, exponent, depth)
                strength = cohesion + sigma * friction
                sin_theta = sin_small(theta_f - swept)
                _add_node(
                    i, workspace, cos_theta, sin_theta, swept, v_y, omega, yaw_rate, sigma, strength, decay,
                    weight * front,
                )  # fmt: skip
                swept = theta_f * (contact - rear * u_squared)
                _add_node(
                    i, workspace, cos_small(theta_f - swept), sin_small(theta_f - swept), swept, v_y, omega, yaw_rate,
                    sigma, strength, decay, weight * rear,
                )  # fmt: skip
    for j in range(WRENCH):
        total = 0.0
        for i in range(LANES):
            total += workspace[_SUM + LANES * j + i]
        wrench[j] = total


@kernel()
def wheel_wrench(
    wheel: NDArray[np.float64],
    soil: NDArray[np.float64],
    v_x: float,
    v_y: float,
    omega: float,
    yaw_rate: float,
    sinkage: float,
    minimum_shear_rate: float,
    rest_speed: float,
    section_nodes: NDArray[np.float64],
    contact_nodes: NDArray[np.float64],
    workspace: NDArray[np.float64],
    wrench: NDArray[np.float64],
) -> None:
    """As :func:`integrate_patch` for any direction of travel; backwards is the mirror image in x.

    The side on which soil enters is the sign of R0 omega + v_x (the larger of the two decides, section 3). Where
    that sum is below ``rest_speed`` both images are blended, so that the force is continuous through rest (ours).
    """
    direction = (wheel[0] + wheel[2]) * omega + v_x
    forward = direction / rest_speed
    blend = 1.0
    if abs(forward) < 1.0:
        blend = 0.5 + forward * (0.75 - 0.25 * forward * forward)
    elif forward < 0.0:
        blend = 0.0
    if blend > 0.0:
        integrate_patch(
            wheel, soil, v_x, v_y, omega, yaw_rate, sinkage, minimum_shear_rate, rest_speed, section_nodes,
            contact_nodes, workspace, wrench,
        )  # fmt: skip
        if blend == 1.0:
            return
    f_x, f_y, f_z, m_z, torque = wrench[0], wrench[1], wrench[2], wrench[3], wrench[4]
    integrate_patch(
        wheel, soil, -v_x, v_y, -omega, -yaw_rate, sinkage, minimum_shear_rate, rest_speed, section_nodes,
        contact_nodes, workspace, wrench,
    )  # fmt: skip
    wrench[0] = -wrench[0]
    wrench[3] = -wrench[3]
    wrench[4] = -wrench[4]
    if blend > 0.0:
        wrench[0] += blend * (f_x - wrench[0])
        wrench[1] += blend * (f_y - wrench[1])
        wrench[2] += blend * (f_z - wrench[2])
        wrench[3] += blend * (m_z - wrench[3])
        wrench[4] += blend * (torque - wrench[4])
