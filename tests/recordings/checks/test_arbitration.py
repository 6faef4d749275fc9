"""Which channel is named: on drives whose physics is written down in conftest, with faults written into them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ddagr_gym
from ddagr_gym.recordings.checks.arbitration import arbitrated, arbitration
from ddagr_gym.recordings.checks.findings import Status
from ddagr_gym.recordings.load import load_recording

IMU = ("specific_force_x", "specific_force_y", "specific_force_z")


def findings(recording):
    return arbitration(recording, np.random.default_rng(0))


def suspicious(recording):
    return {(f.check, f.channel): f for f in findings(recording) if f.status is Status.SUSPICIOUS}


def scaled(recording, factor, *names):
    return replace(recording, channels={**recording.channels, **{name: factor * recording[name] for name in names}})


def exchanged(recording, kind):
    right, left = f"{kind}_right", f"{kind}_left"
    return replace(recording, channels={**recording.channels, right: recording[left], left: recording[right]})


def mounted(recording, x, y, z):
    """IMU whose axes point along these directions of the robot; right angles only, z up or down."""
    force = np.array([x, y, z], dtype=float) @ np.stack([recording[name] for name in IMU])
    channels = {**recording.channels, **dict(zip(IMU, force, strict=True)), "yaw_rate": z[2] * recording["yaw_rate"]}
    return replace(recording, channels=channels)


def without(recording, *names):
    return replace(recording, channels={k: v for k, v in recording.channels.items() if k not in names})


def stopped(recording, share, *names):
    """Channels without a reading from a share of the drive on."""
    late = np.arange(len(recording)) > share * len(recording)
    return replace(
        recording, channels={**recording.channels, **{n: np.where(late, np.nan, recording[n]) for n in names}}
    )


POSE = ("pose_x", "pose_y", "pose_yaw")


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("missing", [(), POSE, ("specific_force_z",), ("specific_force_x", "specific_force_y")])
def test_nothing_is_said_of_a_sound_drive(make_drive, seed, missing):
    assert suspicious(without(make_drive(seed=seed), *missing)) == {}


def test_every_source_answers_on_a_sound_drive(make_drive):
    answered = {f.channel for f in findings(make_drive()) if f.status is Status.PASS}
    assert {"yaw_rate, turning", "pose_yaw, turning", "encoders, driving", "encoder_right", "command_left"} <= answered
    assert "specific_force and yaw_rate" in answered


def test_a_reversed_gyro_is_named_and_nothing_else(make_drive):
    found = suspicious(scaled(make_drive(), -1.0, "yaw_rate"))
    assert found["arbitration", "yaw_rate, turning"].suspects == ("gyro_sign",)
    assert "the gyro goes against the heading" in found["arbitration", "yaw_rate, turning"].meaning
    assert set(found) == {("arbitration", "yaw_rate, turning"), ("imu_mounting", "specific_force and yaw_rate")}
    assert "yaw_rate has the wrong sign" in found["imu_mounting", "specific_force and yaw_rate"].meaning


def test_the_gyro_is_named_without_a_pose_by_the_centripetal_force(make_drive):
    found = suspicious(without(scaled(make_drive(), -1.0, "yaw_rate"), *POSE))
    finding = found["arbitration", "yaw_rate, turning"]
    assert "the sideways specific force" in finding.meaning
    assert finding.interval[1] < 0


@pytest.mark.parametrize(
    ("names", "channel", "motion"),
    [
        (("pose_yaw",), "pose_yaw", "turning"),
        (("pose_y",), "pose_x and pose_y", "turning"),
        (("encoder_right", "encoder_left"), "encoders", "driving"),
        (("command_right", "command_left"), "commands", "driving"),
    ],
)
def test_the_reversed_source_is_named(make_drive, names, channel, motion):
    finding = suspicious(scaled(make_drive(), -1.0, *names))["arbitration", f"{channel}, {motion}"]
    assert "which agree with each other" in finding.meaning
    assert finding.remedy


@pytest.mark.parametrize("kind", ["encoder", "command"])
@pytest.mark.parametrize("missing", [(), POSE])
def test_exchanged_wheels_are_named_and_told_from_a_reversed_gyro(make_drive, kind, missing):
    found = suspicious(without(exchanged(make_drive(), kind), *missing))
    assert ("arbitration", f"{kind}s, turning") in found
    assert ("arbitration", "yaw_rate, turning") not in found
    if kind == "encoder" or not missing:
        assert "moves as the left wheels do: " in found["wheels", f"{kind}_right"].meaning
        assert "moves as the right wheels do: " in found["wheels", f"{kind}_left"].meaning


@pytest.mark.parametrize("kind", ["encoder", "command"])
def test_exchanged_wheels_come_with_the_lines_of_the_map(make_drive, kind):
    finding = suspicious(exchanged(make_drive(), kind))["wheels", f"{kind}_right"]
    assert f"{kind}_right: {{column: that of {kind}_left}}" in finding.remedy
    assert ("patterns right and left of the wheels" in finding.remedy) == (kind == "encoder")


@pytest.mark.parametrize("kind", ["encoder", "command"])
@pytest.mark.parametrize("fault", ["exchanged", "right reversed"])
def test_forward_weaves_tell_by_what_encoders_and_commands_say_of_each_other(kind, fault):
    weave = ddagr_gym.simulate("s_weave", rate=20.0, pose_rate=5.0, seed=2).recording
    assert suspicious(weave) == {}
    wrong = exchanged(weave, kind) if fault == "exchanged" else scaled(weave, -1.0, f"{kind}_right")
    found = suspicious(wrong)
    named = {name for check, name in found if check == "wheels"}
    assert named == ({f"{kind}_right", f"{kind}_left"} if fault == "exchanged" else {f"{kind}_right"})
    assert f"not with the {kind}s" in found["wheels", f"{kind}_right"].meaning


@pytest.mark.parametrize("channel", ["encoder_right", "encoder_left", "command_right", "command_left"])
def test_a_wheel_that_counts_backwards_is_named_alone(make_drive, channel):
    found = suspicious(scaled(make_drive(), -1.0, channel))
    assert {name for check, name in found if check == "wheels"} == {channel}
    assert "counts backwards" in found["wheels", channel].meaning


@pytest.mark.parametrize(
    ("axes", "words", "remedy"),
    [
        (
            ((0, 1, 0), (-1, 0, 0), (0, 0, 1)),
            "by 90 degrees about the vertical to the left",
            "specific_force_x: {column: that of specific_force_y, sign: -1}, specific_force_y: {column: that",
        ),
        (
            ((0, -1, 0), (1, 0, 0), (0, 0, 1)),
            "by 90 degrees about the vertical to the right",
            "specific_force_y: {column: that of specific_force_x, sign: -1}",
        ),
        (
            ((-1, 0, 0), (0, -1, 0), (0, 0, 1)),
            "by 180 degrees about the vertical",
            "signs: {specific_force_x: -1, specific_force_y: -1}",
        ),
        (((1, 0, 0), (0, -1, 0), (0, 0, -1)), "upside down (rolled over)", "yaw_rate: {sign: -1}"),
        (((-1, 0, 0), (0, 1, 0), (0, 0, -1)), "upside down (pitched over)", "yaw_rate: {sign: -1}"),
    ],
)
def test_a_turned_imu_is_named_with_what_to_write_into_the_map(make_drive, axes, words, remedy):
    finding = suspicious(mounted(make_drive(), *axes))["imu_mounting", "specific_force and yaw_rate"]
    assert words in finding.meaning
    assert remedy in finding.remedy


def test_the_remedy_of_a_turned_imu_mends_it(make_drive):
    sound = make_drive()
    turned = mounted(sound, (0, 1, 0), (-1, 0, 0), (0, 0, 1))
    (finding,) = [f for f in findings(turned) if f.check == "imu_mounting"]
    assert "specific_force_x: {column: that of specific_force_y, sign: -1}" in finding.remedy
    assert "specific_force_y: {column: that of specific_force_x}" in finding.remedy
    mended = {"specific_force_x": -turned["specific_force_y"], "specific_force_y": turned["specific_force_x"]}
    assert mended["specific_force_x"] == pytest.approx(sound["specific_force_x"])
    assert suspicious(replace(turned, channels={**turned.channels, **mended})) == {}


def test_without_a_pose_gravity_tells_an_imu_upside_down_from_exchanged_sides(make_drive):
    down = without(mounted(make_drive(), (1, 0, 0), (0, -1, 0), (0, 0, -1)), *POSE)
    found = suspicious(down)
    assert "upside down" in found["imu_mounting", "specific_force and yaw_rate"].meaning
    assert {channel for check, channel in found if check == "arbitration"} == {"yaw_rate, turning"}
    both = without(exchanged(exchanged(make_drive(), "encoder"), "command"), *POSE)
    found = suspicious(both)
    assert "as gravity confirms" in found["arbitration", "encoders, turning"].meaning
    assert ("imu_mounting", "specific_force and yaw_rate") not in found


@pytest.mark.parametrize("share", [0.4, 0.7])
def test_a_turned_imu_is_named_where_its_accelerometer_stops(make_drive, share):
    turned = stopped(mounted(make_drive(), (0, 1, 0), (-1, 0, 0), (0, 0, 1)), share, *IMU)
    assert ("imu_mounting", "specific_force and yaw_rate") in suspicious(turned)


def test_a_long_rest_hides_nothing_of_how_the_imu_is_mounted(make_drive, rested):
    found = arbitrated(rested(make_drive(effective_track=12.0), 600.0), np.random.default_rng(0))
    assert found.mounting.gyro[0] == pytest.approx(1.0, abs=0.05)
    assert np.isfinite(found.mounting.errors[1, 1])


def test_two_sources_that_disagree_decide_nothing(make_drive):
    drive = without(scaled(make_drive(), -1.0, "yaw_rate"), *POSE, "specific_force_y", "command_right", "command_left")
    finding = suspicious(drive)["arbitration", "turning"]
    assert "no further source decides" in finding.meaning


def test_an_imu_askew_by_20_degrees_is_none_of_the_right_angles(make_drive):
    assert suspicious(make_drive(mounting_yaw=0.35)) == {}


def test_without_the_robot_it_is_not_testable(make_drive):
    (finding,) = findings(make_drive().with_meta(geometry=None))
    assert finding.status is Status.NOT_TESTABLE
    assert "--robot" in finding.remedy


def test_a_straight_drive_tells_an_imu_upside_down_from_the_right_way_up(make_drive):
    drive = make_drive()
    same = {"command_left": drive["command_right"], "encoder_left": drive["encoder_right"]}
    # straight: the difference of the banks and what comes of it are left out, dv/dt and gravity stay
    noise = 0.003 * np.random.default_rng(0).normal(size=len(drive))
    speed = 0.3 * 0.95 * drive["encoder_right"]
    force = {"specific_force_x": np.gradient(speed, drive.t) + noise, "specific_force_y": noise, "yaw_rate": noise}
    straight = without(replace(drive, channels={**drive.channels, **same, **force}), *POSE)
    assert suspicious(straight) == {}


@pytest.mark.parametrize(
    ("change", "check", "channel", "words"),
    [
        (lambda r: r, None, None, None),
        (lambda r: scaled(r, -1.0, "yaw_rate"), "arbitration", "yaw_rate, turning", "the gyro goes against"),
        (lambda r: exchanged(r, "encoder"), "wheels", "encoder_left", "moves as the right wheels do: "),
        (
            lambda r: mounted(r, (1, 0, 0), (0, -1, 0), (0, 0, -1)),
            "imu_mounting", "specific_force and yaw_rate", "upside down (rolled over)",
        ),
    ],
)  # fmt: skip
@pytest.mark.parametrize("name", ["warthog_grass", "warthog_sand"])
def test_faults_written_into_open_drives_are_named(recordings_dir, name, change, check, channel, words):
    found = suspicious(change(load_recording(recordings_dir / "open" / f"{name}.csv.gz", robot="warthog")))
    assert (found == {}) if check is None else (words in found[check, channel].meaning)


@pytest.mark.parametrize(("name", "reversed_gyro"), [("warthog_2", False), ("warthog_4", True), ("warthog_5", False)])
def test_of_the_ordinary_drives_only_the_reversed_gyro_is_named(recordings_dir, name, reversed_gyro):
    found = suspicious(load_recording(recordings_dir / "concealed" / f"{name}.csv.gz", robot="warthog"))
    assert {channel for check, channel in found if check == "arbitration"} == (
        {"yaw_rate, turning"} if reversed_gyro else set()
    )
