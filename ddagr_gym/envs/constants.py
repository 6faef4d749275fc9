"""Numbers of the environment that need no physics to be loaded."""

CONTROL_INTERVAL = 10
"""Sensor samples per environment step: 12.5 Hz control at 125 Hz sensors."""

EPISODE_STEPS = 312
"""Environment steps in 25 s."""
