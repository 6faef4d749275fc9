"""The drives of the replay tests."""

from tests.replay.conftest import drive, make_drive, make_recording, make_windows, recordings_dir, robot, soil

__all__ = ["drive", "make_drive", "make_recording", "make_windows", "recordings_dir", "robot", "soil"]
