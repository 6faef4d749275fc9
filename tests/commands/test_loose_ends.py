"""Input that once ended in a traceback, or in minutes of work for nothing, ends in one sentence at once."""

from __future__ import annotations

import os
import time

import pytest

from ddagr_gym.cli import main
from ddagr_gym.config import DEEPEST, parse_config
from ddagr_gym.errors import InputError
from ddagr_gym.files import check_output_file, expanded
from ddagr_gym.parameters import Soil
from ddagr_gym.presets import get_robot, get_soil


def refused(words, capsys):
    """The one sentence of a command that is refused within 20 s of computing, imports included."""
    began = time.process_time()
    assert main(words) == 2
    assert time.process_time() - began < 20.0
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "Traceback" not in error
    return error


@pytest.mark.parametrize("command", ["simulate", "demo"])
def test_a_negative_seed(command, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "seed is -1: give at least 0" in refused([command, "--seed", "-1"], capsys)
    assert list(tmp_path.iterdir()) == []


def test_a_null_bank_whose_output_is_a_folder(capsys, tmp_path):
    assert "is a folder" in refused(["null-bank", "--output", str(tmp_path)], capsys)


def test_a_null_bank_whose_folder_is_a_file(capsys, tmp_path):
    (tmp_path / "gates.bank").write_text("")
    assert "a file is in the way" in refused(["null-bank", "--output", str(tmp_path / "gates.json")], capsys)


@pytest.mark.parametrize("load", [get_robot, get_soil])
def test_paths_of_presets(load, tmp_path):
    with pytest.raises(InputError, match="NUL"):
        load("soil\0.yaml")
    with pytest.raises(InputError, match="home folder of no user"):
        load("~nobody-of-this-name/soil.yaml")
    fifo = tmp_path / "pipe.yaml"
    os.mkfifo(fifo)
    with pytest.raises(InputError, match="not a regular file"):
        load(str(fifo))
    link = tmp_path / "device.yaml"
    link.symlink_to("/dev/zero")
    with pytest.raises(InputError, match="not a regular file"):
        load(str(link))


@pytest.mark.parametrize("text", ["[" * 400_000, "{a: " * 100_000, "- " * 400_000])
def test_deeply_nested_yaml_is_refused_at_once(text):
    began = time.process_time()
    with pytest.raises(InputError, match=f"nested deeper than {DEEPEST} levels"):
        parse_config(text, Soil)
    assert time.process_time() - began < 5.0


def test_outputs_and_homes(tmp_path):
    check_output_file(tmp_path / "new.json")
    with pytest.raises(InputError, match="not a regular file"):
        check_output_file("/dev/null")
    assert expanded("~/a").is_absolute()
