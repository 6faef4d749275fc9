"""Numbers of the environment that need no physics to be loaded."""

from ddagr_gym.control.timing import CONTROL_PERIOD

EPISODE_DURATION = 25.0
"""Longest time that a row turn may take [s]."""

EPISODE_STEPS = int(EPISODE_DURATION / CONTROL_PERIOD)
"""Environment steps in that time."""
