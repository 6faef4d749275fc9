"""Recordings that cannot be diagnosed are refused with the reason before anything is computed."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.preprocessing.input_requirements import (
    check_recordings,
    content_hash,
    warn_of_unmeasured,
)
from ddagr_gym.diagnosis.result.conclusion import data_source
from ddagr_gym.diagnosis.setting import Setting, commanded_seconds, window_duration, windows_in
from ddagr_gym.errors import InputError, InputWarning
from ddagr_gym.identification.noise import noise_from_differences
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.presets import get_robot
from ddagr_gym.recordings.schema import Recording

ROBOT = get_robot("ddagr")


def made(seconds: float = 30.0, rate: float = 50.0, **channels: float | None) -> Recording:
    """A drive with constant channels; None leaves one out."""
    t = np.arange(int(seconds * rate)) / rate
    values = {"command_right": 0.5, "command_left": 0.5, "yaw_rate": 0.1} | channels
    columns = {name: np.full(len(t), value) for name, value in values.items() if value is not None}
    return Recording.from_columns({"t": t, **columns}, ROBOT, source="drive.csv")


def told_late() -> Recording:
    """A drive whose commands begin two seconds before its end."""
    drive = made()
    valid = drive.command_valid & (drive.t > 28.0)
    return replace(drive, command_valid=valid)


def test_a_sound_drive_passes() -> None:
    check_recordings([made()], ROBOT, Setting())


@pytest.mark.parametrize(
    ("recordings", "words"),
    [
        ([], "no recording"),
        ([made(command_left=None)], "no commands"),
        ([made(yaw_rate=None)], "neither yaw_rate nor encoders nor poses"),
        ([made(seconds=10.0)], "too few"),
        ([made(), made(rate=100.0)], "100 Hz"),
        ([made(command_right=0.0, command_left=0.0)], "stand still 100 %"),
        ([made(), made().with_meta(robot="husky")], "--robot husky,"),
        ([made().with_meta(robot="rover")], "'rover': diagnose it with --robot FILE.yaml"),
        ([made().with_meta(segments=tuple((row, row + 1) for row in range(1500)))], "no two are in one segment"),
        ([made(), made(seconds=20.0), made()], "drive.csv and drive.csv hold the same values"),
        ([told_late()], "0 windows of 2 s without a gap and with commands"),
    ],
)
def test_what_cannot_be_diagnosed_is_refused(recordings: list[Recording], words: str) -> None:
    with pytest.raises(InputError, match=words):
        check_recordings(recordings, ROBOT, Setting())


def with_poses(every: float, seconds: float, segment: float | None = None) -> Recording:
    """A drive that has one pose in so many seconds, cut into segments [s]."""
    drive = made(seconds, pose_x=0.0)
    x = np.where(
        np.arange(len(drive)) % round(50.0 * every) == 0, np.random.default_rng(1).normal(size=len(drive)), np.nan
    )
    rows = round(50.0 * (segment or seconds))
    cuts = tuple((start, start + rows) for start in range(0, len(drive), rows))
    return replace(drive, channels={**drive.channels, "pose_x": x}).with_meta(segments=cuts)


@pytest.mark.parametrize(("seconds", "segment"), [(37.0, None), (120.0, 3.0)])
def test_poses_too_few_to_measure_their_noise_are_left_out_aloud(seconds: float, segment: float | None) -> None:
    """37 poses of a receiver at 1 Hz, or three in each piece of a log that was cut into steps."""
    few = with_poses(1.0, seconds, segment)
    assert noise_from_differences([few], ROBOT.outer_radius)[CHANNELS.index("pose_x")] is None
    with pytest.warns(InputWarning, match=r"drive.csv: pose_x \(.* are too few to measure their noise, and left out"):
        warn_of_unmeasured([few])


def test_enough_poses_are_no_reason_to_warn(recwarn: pytest.WarningsRecorder) -> None:
    enough = with_poses(0.2, 37.0)
    assert noise_from_differences([enough], ROBOT.outer_radius)[CHANNELS.index("pose_x")] is not None
    warn_of_unmeasured([enough])
    assert not recwarn.list


def test_the_hash_knows_every_value(drive: Callable[..., Recording]) -> None:
    recording = drive()
    changed = {**recording.channels, "yaw_rate": recording["yaw_rate"].copy()}
    changed["yaw_rate"][7] += 1e-9
    assert content_hash(recording) == content_hash(drive())
    assert content_hash(replace(recording, channels=changed)) != content_hash(recording)
    source = data_source(recording)
    assert source.sha256 == content_hash(recording)
    assert source.seconds == pytest.approx(23.98)


def test_logs_cut_into_steps_of_one_window_pass() -> None:
    drive = made(rate=20.0)
    segments = tuple((k, k + 40) for k in range(0, 600, 40))
    check_recordings([replace(drive, meta=replace(drive.meta, segments=segments))], ROBOT, Setting())


@pytest.mark.parametrize(("seconds", "duration"), [(24.0, 3.0), (60.0, 6.0), (10.0, 2.0)])
def test_short_recordings_get_shorter_windows(seconds: float, duration: float) -> None:
    recording = made(rate=50.0, seconds=seconds)
    assert window_duration([recording], Setting().with_windows(6.0)) == pytest.approx(duration, rel=0.01)


def test_windows_are_as_short_as_what_was_commanded_asks_for() -> None:
    """A drive of 60 s of which an operator drove 36 s by hand has room for eight windows of 3 s."""
    drive = made(rate=50.0, seconds=60.0)
    commands = {name: drive[name].copy() for name in ("command_right", "command_left")}
    for values in commands.values():
        values[600:2401] = np.nan
    by_hand = replace(
        drive, channels={**drive.channels, **commands}, command_valid=np.isfinite(commands["command_left"])
    )
    assert sum(commanded_seconds(by_hand)) == pytest.approx(24.0, abs=0.1)
    assert window_duration([by_hand], Setting().with_windows(6.0)) == pytest.approx(3.0, rel=0.01)
    check_recordings([by_hand], ROBOT, Setting())


def test_windows_fit_into_stretches() -> None:
    """Five windows of 4 s in 20 s and three in 14 s; of an eighth of the whole time there would be seven."""
    recording = made(rate=50.0, seconds=34.1)
    cut = replace(recording, meta=replace(recording.meta, segments=((0, 1001), (1001, 1702))))
    duration = window_duration([cut], Setting().with_windows(6.0))
    assert duration == pytest.approx(4.0, abs=0.01)
    assert windows_in(commanded_seconds(cut), duration) == 8


def test_windows_may_not_overlap() -> None:
    assert Setting().with_windows(3.0, 8.0).stride == 8.0
    with pytest.raises(InputError, match=r"a stride of 1 s makes windows of 3 s overlap"):
        Setting().with_windows(3.0, 1.0)
