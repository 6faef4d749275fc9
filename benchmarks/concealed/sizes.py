"""The names of the verdict and the least meaningful size of each effect in this benchmark.

Least meaningful: about what a careful engineer would just care about in a model of the DDAGR, that is roughly one per
cent of speed or yaw rate in its ordinary driving, or the specification of an ordinary sensor. Sizes of cases are drawn
as multiples of it, so that a scorer can ask how power grows with size.
"""

from __future__ import annotations

import math

LEAST_MEANINGFUL: dict[str, tuple[float, str, str]] = {
    "command_delay": (0.04, "s", "two samples"),
    "motor_lag": (0.06, "s", "a quarter of the nominal time constant 1/4.5 s, added to it"),
    "motor_droop": (5e-4, "rad/s/(N m)", "2 % of wheel speed at the 40 N m of a tight turn"),
    "motor_saturation": (0.05, "-", "limit lies this share below the fastest command of 1.2 rad/s"),
    "command_deadband": (0.02, "rad/s", "3 % of the usual command"),
    "payload": (8.0, "kg", "5 % of the mass"),
    "centre_of_mass_offset": (0.02, "m", "6 % of the half wheelbase"),
    "wheel_radius_mismatch": (0.005, "-", "right over left less one; turns a straight by 1.7 mrad/s at 0.2 m/s"),
    "towed_drag": (10.0, "N", "0.6 % of the weight"),
    "viscous_drag": (30.0, "N s/m", "6 N at 0.2 m/s"),
    "slope": (math.radians(0.5), "rad", "0.9 % of the weight"),
    "soil_change": (0.15, "-", "ln of the factor on strength; the fields' own scatter is 0.1"),
    "soil_split": (0.1, "-", "ln of right over left"),
    "soil_patch": (0.15, "-", "ln of the factor on strength"),
    "lateral_bulldozing": (0.5, "-", "multiple of Rankine's passive pressure, here 2 % of a wheel's load"),
    "slip_sinkage": (0.5, "-", "sinkage grows by half the slip"),
    "multipass": (0.1, "-", "relative stiffening by one pass"),
    "gyro_bias": (1e-3, "rad/s", "0.06 deg/s, a usual turn-on bias"),
    "gyro_scale": (0.01, "-", "usual specification 1 to 3 %"),
    "gyro_sign": (1.0, "-", "no size"),
    "accelerometer_bias": (0.03, "m/s^2", "3 mg, one sample's noise at rest"),
    "accelerometer_sign": (1.0, "-", "no size"),
    "imu_misalignment": (math.radians(3.0), "rad", "5 % of the acceleration leaks into the other axis"),
    "imu_tilt": (math.radians(0.4), "rad", "0.07 m/s^2"),
    "imu_lever_arm": (0.05, "m", "0.05 m/s^2 at 1 rad/s^2"),
    "encoder_scale": (0.01, "-", "1 % of speed"),
    "pose_latency": (0.1, "s", "2 cm at 0.2 m/s"),
    "sensor_hold": (0.04, "s", "two samples"),
}
"""Name: (value, unit, reason)."""
