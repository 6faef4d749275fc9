"""Wheel-terrain physics of a skid-steer robot on soft soil.

The force chain, one module a link (imports go down only)::

    contact_geometry -> contact_stress -> contact_patch -> sinkage -> wheel_forces
                                                      \\-> body_dynamics -> body_jacobian
    body_jacobian -> backward_euler -> integrators

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
slip_ratio                   lambda     section 3 of the model; 1 spinning, -1 locked, up to +-2 counter-rotating
shear_modulus                K          shear displacement modulus [m]
===========================  =========  ==========================================================

Frames: body x forward, y left, z up; yaw and yaw rate counter-clockwise positive. Forces are those of the soil on
the wheel. Wheels: 1 front right, 2 front left, 3 rear right, 4 rear left; banks are ordered (right, left).
"""

from ddagr_gym.physics.sinkage import SinkageStatus
from ddagr_gym.physics.wheel_forces import WheelForce, equilibrium_sinkage, wheel_force

__all__ = ["SinkageStatus", "WheelForce", "equilibrium_sinkage", "wheel_force"]
