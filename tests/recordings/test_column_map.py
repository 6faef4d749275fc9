from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym import load_recording, simulate
from ddagr_gym.config import find_config, load_config
from ddagr_gym.errors import InputError
from ddagr_gym.recordings.channels import CHANNELS
from ddagr_gym.recordings.column_map import ColumnMap, load_column_map, most_specific_map, shipped_column_maps

STEPS = ["seq", "window", "t", "cmd_left", "cmd_right", "enc_left", "enc_right", "imu_gz", "imu_ax", "imu_ay", "imu_az"]
STEPS += ["x", "y", "z", "roll", "pitch", "yaw", "calib_step", "phase"]
CONCEALED = ["t", "cmd_right", "cmd_left", "enc_right", "enc_left", "imu_ax", "imu_ay", "imu_gz"]

BASIC = """
time: {column: t}
channels:
  yaw_rate: {column: gz}
"""


def write(tmp_path, text):
    path = tmp_path / "map.yaml"
    path.write_text(text)
    return str(path)


def test_shipped_maps_load_and_carry_their_name():
    assert set(shipped_column_maps()) == {"concealed", "drive_continuous", "drive_steps", "schema"}
    for name in shipped_column_maps():
        assert load_column_map(name).name == name


def test_what_simulate_writes_as_csv_is_read_without_a_map(tmp_path):
    drive = simulate("arcs", rate=50.0, pose_rate=5.0)
    path = tmp_path / "drive.csv"
    drive.save(path)
    read = load_recording(path)
    for name, values in drive.recording.channels.items():
        np.testing.assert_allclose(read[name], values, rtol=1e-8, atol=1e-9)
    assert set(load_column_map("schema").channels) == set(CHANNELS)


def test_the_commented_example_is_valid():
    example = load_config(find_config("recordings", "example"), ColumnMap)
    assert example.channels["encoder_left"].sign == -1


def test_two_channels_of_one_column_are_refused(tmp_path):
    text = BASIC + "  encoder_right: {column: enc}\n  encoder_left: {column: enc}\n"
    with pytest.raises(InputError, match=r"encoder_right and encoder_left both read the column 'enc'"):
        load_column_map(write(tmp_path, text))


def test_a_map_of_ones_own_takes_the_name_of_its_file(tmp_path):
    column_map = load_column_map(write(tmp_path, BASIC))
    assert column_map.name == "map"
    assert column_map.needed_columns() == ("t", "gz")


@pytest.mark.parametrize(("columns", "name"), [(STEPS, "drive_steps"), (CONCEALED, "concealed")])
def test_the_most_specific_shipped_map_is_found(columns, name):
    assert most_specific_map(tuple(columns), "file.csv").name == name


def test_no_fitting_map_says_what_there_is():
    with pytest.raises(InputError, match=r"alpha, beta.*drive_steps"):
        most_specific_map(("alpha", "beta"), "file.csv")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (BASIC + "include: other.yaml\n", "include"),
        (BASIC + "robot: !!python/object/apply:os.system ['true']\n", "not valid YAML"),
        (BASIC.replace("yaw_rate", "yawrate"), "yaw_rate"),
        (BASIC.replace("{column: gz}", "{column: gz, unit: furlong}"), "furlong"),
        (BASIC.replace("{column: gz}", "{column: gz, sign: 2}"), "sign"),
        (BASIC.replace("{column: gz}", "gz"), "yaw_rate"),
        (BASIC.replace("{column: t}", "{column: t, unit: fortnight}"), "fortnight"),
        ("channels: {}\n", "time"),
        (BASIC + "held:\n  - {channels: [pose_x]}\n", "pose_x"),
        (BASIC + "held:\n  - {channels: [yaw_rate], zero_period: -1}\n", "zero_period"),
        (BASIC + "pieces: {span_columns: [a], span_gap: 0}\n", "span_gap"),
        (BASIC + "delimiter: '::'\n", "delimiter"),
        (
            BASIC + "  command_right: {column: a}\nbody_commands: {forward: {column: v}, turn: {column: w}}\n",
            "keep one of them",
        ),
        (BASIC + "body_commands: {forward: {column: v, unit: deg}, turn: {column: w}}\n", "deg"),
        ("[" * 1200, "YAML|nested"),
        ("a: &a [1]\nb: *a\n", "anchors"),
    ],
)
def test_a_bad_map_gets_one_sentence(tmp_path, text, words):
    with pytest.raises(InputError, match=words) as caught:
        load_column_map(write(tmp_path, text))
    assert "\n" not in str(caught.value)


def test_a_name_that_leaves_the_folder_is_not_a_map():
    with pytest.raises(InputError, match="unknown"):
        load_column_map("../robots/husky")
