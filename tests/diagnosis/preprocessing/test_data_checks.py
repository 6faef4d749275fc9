"""What the recordings say against themselves comes before any physics, and a dead channel is no evidence."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.answer.location import EffectLocation, Localisation
from ddagr_gym.diagnosis.answer.verdict import DataDoubt, Diagnosis, GatesUsed
from ddagr_gym.diagnosis.preprocessing.data_checks import data_doubts, dead_channels, doubted_banks
from ddagr_gym.diagnosis.preprocessing.mended_recordings import mend_recordings
from ddagr_gym.diagnosis.result.sentences import dead_in_words
from ddagr_gym.diagnosis.review import review
from ddagr_gym.recordings.schema import Recording, RobotGeometry
from tests.recordings.conftest import Faults
from tests.recordings.conftest import drive as made_drive
from tests.recordings.test_pose_frames import in_a_frame_of_its_own

_NOTHING = EffectLocation((), 0.0, (), (), None, "")
NOWHERE = Localisation({}, None, _NOTHING, _NOTHING, {}, ())


NO_GATES = GatesUsed(nulls=0, bank="", level=0.05)


def doubts(*recordings: Recording) -> tuple[DataDoubt, ...]:
    return data_doubts(recordings, np.random.default_rng(1))


def with_zeros(recording: Recording, *names: str) -> Recording:
    zeros = {name: np.zeros(len(recording)) for name in names}
    return replace(recording, channels={**recording.channels, **zeros})


@pytest.fixture(scope="module")
def sound(drive: Callable[..., Recording]) -> Recording:
    return drive()


def test_a_sound_drive_has_no_dead_channel(sound: Recording) -> None:
    assert dead_channels(doubts(sound)) == ()


def test_zeros_logged_as_readings_are_found_and_named(sound: Recording) -> None:
    found = doubts(with_zeros(sound, "yaw_rate", "specific_force_x"), sound)
    assert dead_channels(found) == ("specific_force_x", "yaw_rate")
    stuck = [doubt for doubt in found if doubt.finding == "stuck"]
    assert {doubt.recording for doubt in stuck} == {sound.meta.source}
    assert all("look at the sensor" in doubt.sentence for doubt in stuck)


def test_stretches_whose_poses_may_be_in_frames_of_their_own(sound: Recording) -> None:
    half = len(sound) // 2
    parts = replace(sound, meta=replace(sound.meta, spans=((0, half), (half, len(sound)))))
    assert not any(doubt.finding == "frames" for doubt in doubts(parts, sound))
    moved = in_a_frame_of_its_own(parts, half)
    told = [doubt for doubt in doubts(moved, sound) if doubt.finding == "frames"]
    assert [doubt.recording for doubt in told] == [sound.meta.source]
    assert "2 stretches" in told[0].sentence
    without = replace(moved, channels={k: v for k, v in moved.channels.items() if not k.startswith("pose")})
    assert not any(doubt.finding == "frames" for doubt in doubts(without))


@pytest.mark.parametrize(
    ("faults", "names"),
    [
        ([Faults()], ()),
        # gyro and commands speak against one encoder
        ([Faults(left_scale=1.2)], ("encoder_scale",)),
        # only the commands speak against one bank: what it does, the gyro feels
        ([Faults(command_scale=0.85)], ("command_gain",)),
        ([Faults(command_scale=0.85), Faults(command_scale=0.8)], ("command_gain",)),
        ([Faults(command_scale=0.85), Faults()], ()),
        ([Faults(command_scale=0.85), Faults(command_scale=1.2)], ()),
    ],
)
def test_banks_that_differ_are_asked_for(faults: list[Faults], names: tuple[str, ...]) -> None:
    geometry = RobotGeometry("warthog", 0.3, 0.54)
    drives = [made_drive(geometry, item, seed=seed) for seed, item in enumerate(faults)]
    assert doubted_banks(drives, np.random.default_rng(0)).factors == names


def test_banks_are_judged_as_they_were_mended() -> None:
    """Encoders that count backwards are no encoders of another scale."""
    geometry = RobotGeometry("warthog", 0.3, 0.54)
    made = made_drive(geometry, Faults(command_scale=0.8))
    backwards = replace(made, channels={**made.channels, "encoder_left": -made["encoder_left"]})
    mended = mend_recordings([backwards])
    assert "encoders_reversed" in mended.names
    assert doubted_banks(mended.recordings, np.random.default_rng(0)).factors == ("command_gain",)


@pytest.mark.parametrize(
    ("faults", "commands", "common"),
    [
        # encoders of another scale read as slip of another tenth; of 0.95 travelled a sixth less is too little
        (Faults(right_scale=1.1, left_scale=1.1, travel=1.1), 1.0, ("encoder_scale", "command_gain")),
        (Faults(right_scale=1.2, left_scale=1.2, travel=1.05), 1.0, ("encoder_scale",)),
        (Faults(travel=1.05), 1.2, ("command_gain",)),
        # motors may droop, and robots are not pushed
        (Faults(right_scale=0.9, left_scale=0.9), 1.0, ()),
        (Faults(right_scale=0.85, left_scale=0.85, travel=1.05), 1.0, ("encoder_scale",)),
    ],
)
def test_what_both_banks_have_in_common_is_asked_for_where_no_drivetrain_does_it(
    faults: Faults, commands: float, common: tuple[str, ...]
) -> None:
    made = made_drive(RobotGeometry("warthog", 0.3, 0.54), faults, seconds=300.0)
    told = {name: made[name] / commands for name in ("command_right", "command_left")}
    found = doubted_banks([replace(made, channels={**made.channels, **told})], np.random.default_rng(0))
    assert found.common == common
    assert found.factors == common[:1]


def test_channels_that_no_diagnosis_compares_are_not_called_dead() -> None:
    assert dead_channels([DataDoubt("a", "current_left", "stuck", "It never changes.")]) == ()
    assert dead_channels([DataDoubt("a", "yaw_rate", "wait", "It waits.")]) == ()


@pytest.mark.parametrize(("verdict", "begin"), [("none", "Nothing is missing"), ("unknown", "Something is missing")])
def test_with_a_dead_channel_no_answer_is_complete(verdict: str, begin: str) -> None:
    answer = Diagnosis((verdict,), True, (), "", {"limit": {"yaw_rate": 1.2}}, {}, {}, ("a",), NO_GATES, 1.0, "0")
    dead = [DataDoubt("a", "yaw_rate", "stuck", "It never changes.")]
    made = review(answer, NOWHERE, checks=dead)
    assert not made.complete
    assert made.sentence.startswith(begin)
    assert made.sentence.endswith("yaw rate never changes while the robot drives, so that it says nothing.")
    assert review(answer, NOWHERE).complete


def test_several_dead_channels_in_words() -> None:
    words = dead_in_words(["specific_force_x", "specific_force_y", "yaw_rate"])
    assert words.startswith("specific force x, specific force y and yaw rate never change ")
