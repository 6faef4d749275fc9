"""Named drives and commands from CSV."""

import os

import numpy as np
import pytest

from ddagr_gym.control.manoeuvres import MANOEUVRES, Manoeuvre, find_manoeuvre, read_manoeuvre
from ddagr_gym.errors import InputError


def test_table_6_2_as_the_thesis_has_it():
    commands = find_manoeuvre("table_6_2").commands(125.0)
    assert commands.shape == (3125, 2)
    t = (np.arange(3125) + 0.5) / 125.0
    np.testing.assert_array_equal(commands[t < 5.0], np.full((625, 2), 0.701))
    np.testing.assert_array_equal(np.unique(commands[(t > 5.0) & (t < 22.5)], axis=0), [[0.0, 1.195]])
    np.testing.assert_array_equal(commands[t > 22.5][-1], [0.701, 0.701])


def test_every_manoeuvre_gives_its_length():
    for manoeuvre in MANOEUVRES.values():
        assert len(manoeuvre.commands(50.0)) == round(manoeuvre.duration * 50.0)


def test_csv_round_trip(tmp_path):
    path = tmp_path / "drive.csv"
    path.write_text("t,command_right,command_left\n0,0.5,0.5\n2,0.1,0.9\n4,0,0\n")
    manoeuvre = read_manoeuvre(path)
    assert manoeuvre.segments == ((2.0, 0.5, 0.5), (2.0, 0.1, 0.9), (2.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no column"),
        ("t,command_right\n0,1\n1,1\n", "command_left"),
        ("t,command_right,command_left\n0,1,x\n1,1,1\n", "no number"),
        ("t,command_right,command_left\n1,1,1\n0,1,1\n", "increasing"),
        ("t,command_right,command_left\n0,1,1\n", "two rows"),
        ("t,command_right,command_left\n0,nan,1\n1,1,1\n", "finite"),
        ("t,command_right,command_left\n0,500,1\n1,1,1\n", "rad/s"),
    ],
)
def test_bad_csv_is_one_sentence(tmp_path, text, words):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=words):
        read_manoeuvre(path)


def test_binary_file_is_one_sentence(tmp_path):
    path = tmp_path / "binary.csv"
    path.write_bytes(bytes(range(256)))
    with pytest.raises(InputError, match="CSV"):
        read_manoeuvre(path)


def test_a_pipe_or_a_device_is_no_ordinary_file(tmp_path):
    os.mkfifo(tmp_path / "drive.csv")
    for path in (tmp_path / "drive.csv", tmp_path, "/dev/zero"):
        with pytest.raises(InputError, match=r"cannot be read \(it is not a regular file\): give a CSV"):
            find_manoeuvre(str(path))
    with pytest.raises(InputError, match=r"absent\.csv does not exist: give a CSV with columns t"):
        find_manoeuvre(str(tmp_path / "absent.csv"))


def test_unknown_name_lists_the_closest():
    with pytest.raises(InputError, match="table_6_2"):
        find_manoeuvre("table_62")


def test_impossible_segments_are_refused():
    with pytest.raises(InputError, match="positive duration"):
        Manoeuvre("x", ((0.0, 1.0, 1.0),))
    with pytest.raises(InputError, match="no segments"):
        Manoeuvre("x", ())
