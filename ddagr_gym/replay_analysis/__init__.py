"""Recordings driven again in the simulator: short windows with free initial states, and long roll-outs.

    recording -> windows -> WindowModel.predict -> residuals -> refit -> roll-outs and horizons

A *window* is a stretch of samples inside one segment. Its initial state is an unknown of its own (multiple shooting),
so that errors do not add up over the drive and a wrong start does not pass for wrong physics.
"""
