"""All checks together: sound drives stay sound, and faults written into drives are found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.parameters import Imu, PoseReceiver, Sensors
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.checks.findings import Status
from ddagr_gym.recordings.checks.run import check_recording
from ddagr_gym.recordings.load import load_recording
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import simulate

OPEN = ("warthog_asphalt", "warthog_grass", "warthog_sand")


def suspicious(recording):
    report = check_recording(recording, np.random.default_rng(0))
    return {(f.check, f.channel) for f in report.suspicious} | {("validate", s) for s in report.sentences}


def load(folder, name):
    return load_recording(folder / "open" / f"{name}.csv.gz", robot="warthog")


@pytest.mark.parametrize("seed", range(4))
def test_sound_drives_that_were_written_down_pass(make_drive, seed):
    assert suspicious(make_drive(seed=seed)) == set()


@pytest.mark.parametrize("share", [0.4, 0.7])
@pytest.mark.parametrize("kind", ["yaw_rate", "encoder", "specific_force", "pose"])
def test_a_sensor_that_stops_is_not_accused_of_what_it_did_not_say(make_drive, kind, share):
    """Its last value was taken for the rest of the drive: a gyro then turned too much, wheels rolled too far."""
    made = make_drive(seconds=300.0)
    late = np.arange(len(made)) > share * len(made)
    channels = {n: np.where(late, np.nan, v) if n.startswith(kind) else v for n, v in made.channels.items()}
    assert {check for check, _ in suspicious(replace(made, channels=channels))} == {"wait"}


def test_a_gyro_that_hardly_turns_beside_poses_and_wheels_that_do_is_suspicious(make_drive):
    """Of rad/s that were taken for degrees."""
    found = suspicious(scaled("yaw_rate", np.pi / 180.0)(make_drive(seconds=300.0)))
    assert ("sign_and_scale", "yaw_rate to pose_yaw") in found


@pytest.mark.parametrize("soil", ["thesis_a1", "firm_ground"])
@pytest.mark.parametrize("seed", [0, 1])
def test_sound_simulated_drives_pass(soil, seed):
    rng = np.random.default_rng(seed)
    commands = np.repeat(rng.uniform(-1.2, 1.3, (20, 2)) * (rng.random((20, 1)) < 0.8), 150, axis=0)
    commands[:150] = commands[-150:] = 0.0
    robot = get_robot("ddagr")
    sensors = Sensors(imu=Imu(sample_rate=50.0), pose=PoseReceiver(rate=5.0))
    columns = simulate(robot, get_soil(soil), commands, sensors=sensors, seed=seed)
    assert suspicious(Recording.from_columns(columns, robot)) == set()


@pytest.mark.parametrize("name", OPEN)
def test_the_open_drives_pass(recordings_dir, name):
    assert suspicious(load(recordings_dir, name)) == set()


def scaled(name, scale, offset=0.0):
    return lambda r: replace(r, channels={**r.channels, name: scale * r[name] + offset})


def turned_imu(angle):
    def change(r):
        x, y = r["specific_force_x"], r["specific_force_y"]
        c, s = np.cos(angle), np.sin(angle)
        turned = {"specific_force_x": c * x + s * y, "specific_force_y": -s * x + c * y}
        return replace(r, channels={**r.channels, **turned})

    return change


def swapped_banks(r):
    return replace(r, channels={**r.channels, "encoder_right": r["encoder_left"], "encoder_left": r["encoder_right"]})


def late(names, seconds):
    """Channels that come later by whole rows inside each span."""

    def change(r):
        rows = round(seconds / r.period)
        moved = {}
        for name in names:
            moved[name] = np.full(len(r), np.nan)
            for span in r.spans():
                if span.stop - span.start > rows:
                    moved[name][span.start + rows : span.stop] = r[name][span.start : span.stop - rows]
        return replace(r, channels={**r.channels, **moved})

    return change


def held(name, rows):
    return lambda r: replace(r, channels={**r.channels, name: r[name][(np.arange(len(r)) // rows) * rows]})


POSE = ("pose_x", "pose_y", "pose_yaw", "roll", "pitch")

FAULTS = {
    "gyro sign": (scaled("yaw_rate", -1.0), ("sign_and_scale", "yaw_rate to pose_yaw")),
    "gyro scale": (scaled("yaw_rate", 0.88), ("sign_and_scale", "yaw_rate to pose_yaw")),
    "gyro bias": (scaled("yaw_rate", 1.0, 0.05), ("bias", "yaw_rate")),
    "forward axis": (scaled("specific_force_x", -1.0), ("accelerometer", "specific_force_x")),
    "right encoder": (scaled("encoder_right", 0.9), ("balance", "encoder_right to encoder_left")),
    "left encoder sign": (scaled("encoder_left", -1.0), ("sign_and_scale", "command_left to encoder_left")),
    "swapped banks": (swapped_banks, ("sign_and_scale", "encoder to yaw_rate")),
    "late encoders": (late(("encoder_right", "encoder_left"), 0.5), ("clock_offset", "yaw_rate to encoder")),
    "late pose": (late(POSE, 0.7), ("clock_offset", "yaw_rate to pose")),
    "held gyro": (held("yaw_rate", 4), ("held", "yaw_rate")),
    "accelerometer in g": (scaled("specific_force_x", 1 / 9.81), ("accelerometer", "specific_force_x")),
    "pose in millimetres": (scaled("pose_x", 1000.0), ("sign_and_scale", "encoder to pose")),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_written_into_an_open_drive_is_found(recordings_dir, fault):
    change, expected = FAULTS[fault]
    assert expected in suspicious(change(load(recordings_dir, "warthog_asphalt")))


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("name", ["warthog_grass", "warthog_sand"])
def test_a_fault_written_into_any_open_drive_is_found(recordings_dir, name, fault):
    change, expected = FAULTS[fault]
    assert expected in suspicious(change(load(recordings_dir, name)))


@pytest.mark.parametrize("angle", [-0.5, 0.5])
@pytest.mark.parametrize("name", ["warthog_asphalt", pytest.param("warthog_sand", marks=pytest.mark.slow)])
def test_a_turned_imu_is_found_on_drives_that_turn_at_speed(recordings_dir, name, angle):
    assert ("mounting", "specific_force") in suspicious(turned_imu(angle)(load(recordings_dir, name)))


SINGLE = tuple((row, row + 1) for row in range(100))


@pytest.mark.parametrize("ranges", [{"spans": SINGLE}, {"segments": SINGLE}, {"spans": ()}])
@pytest.mark.parametrize("robot", ["husky", None])
def test_rows_that_are_all_apart_are_one_question_that_cannot_be_answered(ranges, robot):
    columns = {name: np.arange(100.0) / 20.0 for name in ("t", "yaw_rate", "encoder_right", "encoder_left")}
    drive = Recording.from_columns(columns, None if robot is None else get_robot(robot), **ranges)
    (finding,) = check_recording(drive, np.random.default_rng(0)).findings
    assert finding.status is Status.NOT_TESTABLE
    assert finding.remedy == "Correct segment_columns or span_columns in the map."
