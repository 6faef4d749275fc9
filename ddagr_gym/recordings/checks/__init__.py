"""Checks of a recording before anything is concluded from it: pure functions from a recording to findings.

One module for each family: timing, repeated_readings, extremes, clock_offsets, turning, travel, accelerometer, noise,
gravity. Statistics are in blocks and regression; :mod:`.run` puts the families together.
"""
