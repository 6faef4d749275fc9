"""The drives of the replay tests."""

from tests.replay_analysis.conftest import drive, make_drive, make_recording, make_windows, recordings_dir, robot, soil

__all__ = ["drive", "make_drive", "make_recording", "make_windows", "recordings_dir", "robot", "soil"]
