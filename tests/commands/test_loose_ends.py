"""Input that once ended in a traceback, or in minutes of work for nothing, ends in one sentence at once."""

from __future__ import annotations

import os
import time

import pytest

from ddagr_gym.calibration import files as calibration_files
from ddagr_gym.calibration.ordinary_files import load_ordinary
from ddagr_gym.cli import main
from ddagr_gym.config import DEEPEST, find_config, parse_config
from ddagr_gym.diagnosis.change.measured_scatter import measured_scatter
from ddagr_gym.diagnosis.gates.threshold_files import load_thresholds
from ddagr_gym.diagnosis.gates.thresholds import VERSION
from ddagr_gym.diagnosis.result import files as diagnosis_files
from ddagr_gym.diagnosis.series import files as series_files
from ddagr_gym.errors import InputError
from ddagr_gym.files import MAXIMUM_JSON, check_output_file, expanded
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


JSON_READERS = {
    "thresholds": load_thresholds,
    "diagnosis": diagnosis_files.load,
    "calibration": calibration_files.load,
    "bank": load_ordinary,
    "drives": series_files.load,
    "scatter": measured_scatter,
}


def write_bad_json(path, kind):
    """Something at ``path`` that has no end, no bottom or no sense."""
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "size":
        with path.open("wb") as stream:
            stream.truncate(MAXIMUM_JSON + 1)
    elif kind != "absence":
        texts = {"lists": b"[" * 300_000, "mappings": b'{"a":' * 300_000, "bytes": b'"\xff"', "digits": b"1" * 10_000}
        path.write_bytes(texts[kind])


@pytest.mark.parametrize("reader", JSON_READERS)
@pytest.mark.parametrize(
    ("kind", "reason"),
    [
        ("pipe", "it is not a regular file"),
        ("device", "it is not a regular file"),
        ("size", "it has 50000001 bytes and may have 50000000 at most"),
        ("lists", "it is nested too deeply"),
        ("mappings", "it is nested too deeply"),
        ("bytes", "it is not UTF-8 text, at byte 1"),
        ("digits", "4300 digits"),
        ("absence", "no such file or directory"),
    ],
)
def test_json_without_end_or_sense(reader, kind, reason, tmp_path):
    path = tmp_path / "input.json"
    write_bad_json(path, kind)
    began = time.process_time()
    with pytest.raises(InputError, match=reason) as refusal:
        JSON_READERS[reader](path)
    assert time.process_time() - began < 5.0
    assert str(refusal.value).startswith(f"{path} ")
    assert str(refusal.value).count("input.json") == 1
    assert ": make it " in str(refusal.value)


@pytest.mark.parametrize("kind", ["pipe", "lists"])
def test_next_drive_after_a_diagnosis_that_is_none(kind, capsys, tmp_path):
    write_bad_json(tmp_path / "diagnosis.json", kind)
    assert "cannot be read as a diagnosis" in refused(["next-drive", str(tmp_path)], capsys)


def test_export_of_a_calibration_that_is_none(capsys, tmp_path):
    write_bad_json(tmp_path / "calibration.json", "lists")
    words = ["export", str(tmp_path), "--to", "mujoco", "--output", str(tmp_path / "out")]
    assert "cannot be read as a calibration (it is nested too deeply)" in refused(words, capsys)


@pytest.mark.parametrize("entries", ['"nulls": 1e999', f'"nulls": 9, "duration": {10**400}'])
def test_thresholds_with_numbers_beyond_all_bounds(entries, tmp_path):
    path = tmp_path / "gates.json"
    path.write_text(f'{{"version": {VERSION}, "gates": {{}}, "misfit": {{}}, "bank": "", "level": 0.1, {entries}}}')
    with pytest.raises(InputError, match="entry of another form"):
        load_thresholds(path)


@pytest.mark.parametrize("option", ["--output=a.parquet", "--output=a.csv", "--figure=a.png", "--video=a.mp4"])
def test_a_drive_whose_output_is_a_pipe(option, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    name = option.split("=")[1]
    os.mkfifo(name)
    monkeypatch.setattr("ddagr_gym.simulate", lambda *_, **__: pytest.fail("drove before it looked"))
    assert f"{name} is not a regular file" in refused(["simulate", option], capsys)
    assert [file.name for file in tmp_path.iterdir()] == [name]
    assert (tmp_path / name).is_fifo()


def test_pipes_as_effects_and_maps(capsys, tmp_path):
    pipe = tmp_path / "pipe.yaml"
    os.mkfifo(pipe)
    assert "not a regular file" in refused(["simulate", "--effects", str(pipe)], capsys)
    with pytest.raises(InputError, match="not a regular file"):
        find_config("recordings", pipe)
    with pytest.raises(InputError, match="no such configuration file"):
        find_config("recordings", tmp_path / "none.yaml")


def test_outputs_and_homes(tmp_path):
    check_output_file(tmp_path / "new.json")
    with pytest.raises(InputError, match="not a regular file"):
        check_output_file("/dev/null")
    assert expanded("~/a").is_absolute()
