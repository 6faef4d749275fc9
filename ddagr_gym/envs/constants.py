"""Numbers of the environment that need no physics to be loaded."""

from ddagr_gym.control.timing import CONTROL_PERIOD

EPISODE_DURATION = 25.0
"""Longest time that a row turn may take [s]."""

EPISODE_STEPS = int(EPISODE_DURATION / CONTROL_PERIOD)
"""Environment steps in that time."""

OBSERVATION_LIMIT = 10.0
"""Bound of the scaled observations [-] (ours): their scales are those of a usual turn, so that only faults reach it."""

HEADLAND_DEPTH = 3.0
"""Depth of the headland from the boundary, to a ditch or road [m] (ours)."""

ROW_MARGIN = 0.5
"""Room between the rows beyond the start and the end of the path [m] (ours)."""
