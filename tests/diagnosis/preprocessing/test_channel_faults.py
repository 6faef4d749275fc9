"""Readings in the wrong channels are named and put right; sound drives and contradictions without a remedy stay."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import ddagr_gym
from ddagr_gym.diagnosis.answer.amounts import amounts
from ddagr_gym.diagnosis.preprocessing.channel_faults import find_channel_faults
from ddagr_gym.diagnosis.preprocessing.mended_recordings import mend_recordings
from ddagr_gym.diagnosis.result.channel_fault_findings import channel_fault_findings, unexplained
from ddagr_gym.diagnosis.wording import describe
from ddagr_gym.recordings.checks.map_lines import with_channels
from ddagr_gym.recordings.schema import Recording

Write = Callable[[Recording], Recording]


@pytest.fixture(scope="module")
def sound() -> Recording:
    """Held commands back and forth and to both sides, with gravity."""
    rng = np.random.default_rng(5)
    steps = np.repeat(rng.uniform(-6.0, 7.0, (40, 2)), 40, axis=0)
    drive = ddagr_gym.simulate(steps, "warthog", rate=20.0, pose_rate=5.0, seed=5).recording
    up = 9.81 + 0.05 * rng.normal(size=len(drive))
    return replace(drive, channels={**drive.channels, "specific_force_z": up})


def negated(*names: str) -> Write:
    return lambda r: replace(r, channels={**r.channels, **{name: -r[name] for name in names}})


def exchanged(one: str, other: str) -> Write:
    return lambda r: replace(r, channels={**r.channels, one: r[other], other: r[one]})


def both(first: Write, second: Write) -> Write:
    return lambda r: second(first(r))


ROLLED = ("specific_force_y", "specific_force_z", "yaw_rate")
PITCHED = ("specific_force_x", "specific_force_z", "yaw_rate")
FAULTS = {
    "encoders_exchanged": (exchanged("encoder_right", "encoder_left"), "of the right and the left side are exchanged"),
    "commands_exchanged": (exchanged("command_right", "command_left"), "the commands of the right and the left side"),
    "encoders_reversed": (negated("encoder_right"), "the right encoders count backwards"),
    "commands_reversed": (negated("command_right", "command_left"), "the commands count backwards"),
    "imu_upside_down": (negated(*ROLLED), "the IMU is upside down (rolled over)"),
    "heading_reversed": (negated("pose_yaw"), "the pose's heading turns the wrong way"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_the_fault_is_named_and_mended(sound: Recording, name: str) -> None:
    write, words = FAULTS[name]
    found = mend_recordings([write(sound)])
    assert found.names == (name,)
    assert found.contradictions == ()
    (fault,) = found.channel_faults
    assert words in describe(fault.name, amounts(fault.sizes))
    assert set(fault.takes) <= set(sound.channels)
    for channel in sound.channels:
        np.testing.assert_array_equal(found.recordings[0][channel], sound[channel])


def test_a_sound_drive_has_none_and_an_imu_pitched_over_is_told_from_a_rolled_one(sound: Recording) -> None:
    assert mend_recordings([sound]).names == ()
    assert mend_recordings([sound]).contradictions == ()
    (fault,) = find_channel_faults([negated(*PITCHED)(sound)], np.random.default_rng(0))
    assert "pitched over" in describe(fault.name, amounts(fault.sizes))


def test_without_gravity_two_wrong_signs_are_left_to_the_library(sound: Recording) -> None:
    blind = {name: values for name, values in sound.channels.items() if name != "specific_force_z"}
    wrong = negated("specific_force_y", "yaw_rate")(replace(sound, channels=blind))
    assert mend_recordings([wrong]).names == ("gyro_sign",)


def test_a_reversed_gyro_beside_exchanged_encoders_is_found_too(sound: Recording) -> None:
    found = mend_recordings([both(negated("yaw_rate"), FAULTS["encoders_exchanged"][0])(sound)])
    assert found.names == ("encoders_exchanged", "gyro_sign")
    assert found.contradictions == ()


def test_readings_are_in_their_channels_with_their_signs(sound: Recording) -> None:
    """A fit of the drivetrain mends repeats by itself."""
    wrong = both(negated("yaw_rate"), FAULTS["encoders_exchanged"][0])(sound)
    (found,) = mend_recordings([wrong]).in_their_channels
    np.testing.assert_array_equal(found["encoder_right"], sound["encoder_right"])
    np.testing.assert_array_equal(found["encoder_left"], sound["encoder_left"])
    np.testing.assert_array_equal(found["yaw_rate"], sound["yaw_rate"])
    assert mend_recordings([sound]).in_their_channels == (sound,)


def test_drives_that_contradict_each_other_and_paths_that_no_sign_mends_are_left(sound: Recording) -> None:
    wrong = FAULTS["encoders_exchanged"][0](sound)
    mixed = mend_recordings([sound, wrong])
    assert mixed.names == ()
    assert {item.check for item in mixed.contradictions} == {"arbitration", "wheels"}
    mirrored = mend_recordings([negated("pose_y")(sound)])
    assert mirrored.names == ()
    assert [item.channel for item in mirrored.contradictions] == ["pose_x and pose_y, turning"]


def test_names_of_a_verdict_explain_contradictions(sound: Recording) -> None:
    left = mend_recordings([negated("specific_force_y")(sound)]).contradictions
    assert unexplained(left, ("motor_lag",)) == left != ()
    assert unexplained(left, ("accelerometer_sign",)) == ()


def test_the_finding_says_how_sure_it_is(sound: Recording) -> None:
    found = mend_recordings([FAULTS["encoders_reversed"][0](sound)])
    (finding,) = channel_fault_findings(found.channel_faults)
    assert (finding.parameters["right"].value, finding.parameters["left"].value) == (-1.0, 1.0)
    assert finding.gain == pytest.approx(0.5 * finding.score**2)
    assert finding.score > 5.0


def test_held_readings_move_with_their_channels(sound: Recording) -> None:
    held = sound.with_meta(held={"encoder_left": 0.25})
    moved = with_channels(held, {"encoder_right": ("encoder_left", 1.0), "encoder_left": ("encoder_right", 1.0)})
    assert moved.meta.held == {"encoder_right": 0.25}
