"""Checks of a recording before anything is concluded from it: pure functions from a recording to findings.

One module for each family: timing, repeated_readings, extremes, clock_offsets, turning, travel, accelerometer, noise,
gravity, clock_drift, bank_limits, currents, and arbitration, which names the channel at fault where sources of a
motion disagree (votes, wheels, imu_axes, on motion_windows). Statistics are in blocks and regression; :mod:`.run` puts
the families together.
"""
