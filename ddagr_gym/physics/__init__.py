"""Wheel-terrain physics of a skid-steer robot on soft soil.

The force chain, one module a link (imports go down only)::

    contact_geometry -> contact_stress -> contact_patch -> sinkage -> wheel_forces
                                                      \\-> body_dynamics -> body_jacobian
    body_jacobian -> backward_euler -> integrators

The thesis is P. Menendez-Aponte, *Approximated Control Affine Dynamics Model for an Agricultural Field Robot
Considering Wheel Terrain Interaction*, Master of Science, University of Central Florida (its text states no year).
"Thesis (3.12)" and a number alone such as "(A.8)" are its equations, "theory: wheel model, eq. (8)" are those of
``docs/theory/wheel_model.md``, "E14" is an entry of that page's errata; "ours" is what no source has.

Symbols. The thesis uses a, b, c, lambda, W, L, R and a1 for two things each; here every one has its own name.

===========================  =========  ==========================================================
name                         thesis     meaning
===========================  =========  ==========================================================
minor_radius                 a          semi-axis of the tyre section in the wheel plane [m]
half_width                   b          semi-axis of the section across the wheel [m]
major_radius                 c          hub to the section's centre [m]
outer radius R0              c + a      hub to tread [m]
theta, psi                              angle from bottom dead centre to the front; across the section to the left
theta_f, theta_m, theta_r               entry angle, angle of peak stress, exit angle [rad]
peak_stress_coefficient_0/1  a0, a1     theta_m = (a0 + a1 slip) theta_f
exit_angle_ratio             lambda     -theta_r / theta_f
slip_ratio                   lambda     theory: wheel model, eq. (8); 1 spinning, -1 locked, up to +-2 counter-rotating
shear_modulus                K          shear displacement modulus [m]
===========================  =========  ==========================================================

Frames: body x forward, y left, z up; yaw and yaw rate counter-clockwise positive. Forces are those of the soil on
the wheel. Wheels: 1 front right, 2 front left, 3 rear right, 4 rear left; banks are ordered (right, left).
"""

from ddagr_gym.physics.sinkage import SinkageStatus
from ddagr_gym.physics.wheel_forces import WheelForce, equilibrium_sinkage, wheel_force

__all__ = ["SinkageStatus", "WheelForce", "equilibrium_sinkage", "wheel_force"]
