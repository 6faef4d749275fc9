"""What a comparison with ordinary drives needs, said before anything is fitted."""

from __future__ import annotations

from collections.abc import Sequence

from ddagr_gym.diagnosis.change.ordinary import OrdinaryRobot
from ddagr_gym.diagnosis.preprocessing.input_requirements import check_recordings, content_hash
from ddagr_gym.diagnosis.setting import Setting
from ddagr_gym.errors import InputError
from ddagr_gym.identification.windows import PERIOD_TOLERANCE
from ddagr_gym.parameters import Robot
from ddagr_gym.recordings.schema import Recording

NEEDED = ("command_right", "command_left", "encoder_right", "encoder_left", "yaw_rate")
"""Channels without which a calibration fits neither drivetrain nor turning, and shifts cannot be told apart."""


def check_comparable(recordings: Sequence[Recording], ordinary: OrdinaryRobot, ground: str) -> None:
    """Refuse drives that cannot be compared.

    Args:
        recordings: of one robot on one ground.
        ordinary: calibrated robot.
        ground: that they are said to be on; "" where it is not known.

    Raises:
        InputError: a drive of another robot or rate, a ground that the calibration does not have, a missing channel,
            and what no diagnosis takes.
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
    _check_rate(recordings, ordinary)
    _check_channels(recordings)
    check_recordings(recordings, ordinary.robot, Setting().with_windows(ordinary.weighing.window))


def check_before(after: Sequence[Recording], before: Sequence[Recording], robot: Robot, window: float) -> None:
    """Refuse drives that cannot be compared with those from before.

    Args:
        after: of one robot on one ground.
        before: from before, on one ground.
        robot: nominal.
        window: length of the windows [s].

    Raises:
        InputError: none from before, drives of two robots or periods, one that is in both, a missing channel, and what
            no diagnosis takes.
    """
    if not before:
        raise InputError("no drive from before is given: name one or more ordinary ones behind --before.")
    for recording in (*before, *after):
        if recording.meta.robot not in ("", robot.name):
            raise InputError(
                f"{recording.meta.source} is a drive of the robot {recording.meta.robot!r}, compared with --robot "
                f"{robot.name}: give drives of one robot, and its name."
            )
    _check_same_rate(after[0], before[0].period, f"{before[0].meta.source} from before")
    _check_apart(after, before)
    _check_channels((*before, *after))
    for drives in (before, after):
        check_recordings(drives, robot, Setting().with_windows(window))


def _check_rate(recordings: Sequence[Recording], ordinary: OrdinaryRobot) -> None:
    """Refuse drives of another rate than the ordinary ones', as far as the calibration says theirs."""
    known = next((item for item in ordinary.references if item.period > 0.0), None)
    if known is not None:
        for recording in recordings:
            _check_same_rate(recording, known.period, f"{known.drive} of the calibration")


def _check_same_rate(recording: Recording, period: float, other: str) -> None:
    """Refuse a drive whose rows are not as far apart [s] as those of another one."""
    if abs(recording.period - period) > PERIOD_TOLERANCE * period:
        raise InputError(
            f"{recording.meta.source} has {1.0 / recording.period:.3g} Hz and {other} {1.0 / period:.3g} Hz: compare "
            "drives of one rate (a topic map with `rate: 50` reads a bag at 50 Hz; resample CSV files before the "
            "import)."
        )


def _check_apart(after: Sequence[Recording], before: Sequence[Recording]) -> None:
    """Refuse a drive that is on both sides: nothing can have changed in it."""
    known = {content_hash(recording): recording.meta.source for recording in before}
    for recording in after:
        values = content_hash(recording)
        if values in known:
            raise InputError(
                f"{recording.meta.source} and {known[values]} from before hold the same values: leave it out on one "
                "side."
            )


def _check_channels(recordings: Sequence[Recording]) -> None:
    for recording in recordings:
        absent = [name for name in NEEDED if not recording.has(name)]
        if absent:
            raise InputError(
                f"{recording.meta.source} has no {', '.join(absent)}, which ordinary drives have: without it "
                "changes cannot be told apart; name the columns in a --map."
            )
