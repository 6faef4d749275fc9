"""What a comparison with ordinary drives needs, said before anything is fitted."""

from __future__ import annotations

from collections.abc import Sequence

from ddagr_gym.diagnosis.change.ordinary import OrdinaryRobot
from ddagr_gym.diagnosis.preprocessing.input_requirements import check_recordings
from ddagr_gym.diagnosis.setting import Setting
from ddagr_gym.errors import InputError
from ddagr_gym.recordings.schema import Recording

NEEDED = ("command_right", "command_left", "encoder_right", "encoder_left", "yaw_rate")
"""Channels without which shifts of robot, ground and sensors cannot be told apart: those that a calibration needs."""


def check_comparable(recordings: Sequence[Recording], ordinary: OrdinaryRobot, ground: str) -> None:
    """Refuse drives that cannot be compared.

    Args:
        recordings: of one robot on one ground.
        ordinary: calibrated robot.
        ground: that they are said to be on; "" where it is not known.

    Raises:
        InputError: a drive of another robot, a ground that the calibration does not have, a missing channel, and what
            no diagnosis takes.
    """
    if ground and ground not in ordinary.soils:
        raise InputError(
            f"the calibration has no ground {ground!r}: choose from {', '.join(ordinary.soils)}, or leave --ground out "
            "for one that it does not know."
        )
    for recording in recordings:
        if recording.meta.robot not in ("", ordinary.robot.name):
            raise InputError(
                f"{recording.meta.source} is a drive of the robot {recording.meta.robot!r} and the calibration is of "
                f"{ordinary.robot.name!r}: compare it with ordinary drives of its own robot."
            )
        absent = [name for name in NEEDED if not recording.has(name)]
        if absent:
            raise InputError(
                f"{recording.meta.source} has no {', '.join(absent)}, which its ordinary drives have: without it "
                "changes cannot be told apart; name the columns in a --map."
            )
    check_recordings(recordings, ordinary.robot, Setting().with_windows(ordinary.weighing.window))
