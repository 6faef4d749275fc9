"""``ddagr import --guess``: shows, writes the map, asks, and imports only with consent."""

from __future__ import annotations

import shutil
import sys

import numpy as np
import pytest

from ddagr_gym.cli import main
from ddagr_gym.presets import get_robot
from ddagr_gym.recordings.schema import RobotGeometry
from ddagr_gym.recordings.storage import load_parquet
from ddagr_gym.recordings.topic_map import load_topic_map
from tests.recordings.bags import TWIST, Drive, write
from tests.recordings.conftest import drive


@pytest.fixture(scope="module")
def sent():
    geometry = RobotGeometry.of(get_robot("warthog"))
    recording = drive(geometry, seconds=40.0)
    return Drive(recording.columns(), geometry.wheel_radius, geometry.half_track).messages()


@pytest.fixture(scope="module")
def bag(tmp_path_factory, sent):
    return write(tmp_path_factory.mktemp("sent") / "my bag", sent, "mcap", "file")


@pytest.fixture
def folder(tmp_path, monkeypatch, bag):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(bag, tmp_path / "my bag")
    return tmp_path


WORDS = ["import", "my bag", "--guess", "--robot", "warthog", "--output", "run.parquet"]


def at_terminal(monkeypatch, answer):
    monkeypatch.setattr(sys.stdin, "isatty", lambda: True, raising=False)
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)

    def answered(question):
        if isinstance(answer, Exception):
            raise answer
        print(question)
        return answer

    monkeypatch.setattr("builtins.input", answered)


def test_nobody_to_ask_writes_the_map_and_says_how_to_go_on(folder, capsys):
    assert main(WORDS) == 2
    out, error = capsys.readouterr()
    assert error.count("\n") == 1
    go_on = "ddagr import 'my bag' --map run.topics.yaml --robot warthog --output run.parquet"
    assert f"read run.topics.yaml, correct it where it is wrong, and go on with `{go_on}`, or add --yes." in error
    assert "/odometry/gps" in out
    assert "its heading goes with the gyro" in out
    assert sorted(path.name for path in folder.iterdir()) == ["my bag", "run.topics.yaml"]
    assert "# imu: gravity is in z" in (folder / "run.topics.yaml").read_text()
    assert load_topic_map("run.topics.yaml").topics["pose"].topic == "/odometry/gps"
    # What the sentence says is what works.
    assert main(["import", "my bag", "--map", "run.topics.yaml", "--robot", "warthog", "--output", "run.parquet"]) == 0
    recording = load_parquet(folder / "run.parquet")
    assert recording.has("yaw_rate", "encoder_right", "command_left", "pose_yaw")
    assert recording.meta.column_map == "run.topics"


@pytest.mark.parametrize("answer", ["y", " YES "])
def test_yes_at_a_terminal_imports(folder, capsys, monkeypatch, answer):
    at_terminal(monkeypatch, answer)
    assert main(WORDS) == 0
    assert "import with this map? [y/N]" in capsys.readouterr().out
    assert len(load_parquet(folder / "run.parquet")) == 2000


@pytest.mark.parametrize("answer", ["", "n", "maybe", EOFError()])
def test_anything_else_at_a_terminal_imports_nothing(folder, capsys, monkeypatch, answer):
    at_terminal(monkeypatch, answer)
    assert main(WORDS) == 1
    assert "not imported: correct run.topics.yaml" in capsys.readouterr().out
    assert sorted(path.name for path in folder.iterdir()) == ["my bag", "run.topics.yaml"]


def test_accepted_beforehand_with_a_map_elsewhere(folder, capsys):
    assert main([*WORDS, "--yes", "--map-output", "maps/own.yaml"]) == 0
    assert "proposed map: maps/own.yaml" in capsys.readouterr().out
    recording = load_parquet(folder / "run.parquet")
    assert (recording.meta.robot, recording.meta.column_map) == ("warthog", "own")
    assert np.isfinite(recording["pose_x"]).sum() == 200
    assert not (folder / "run.topics.yaml").exists()
    assert main([*WORDS, "--yes", "--map-output", "maps/own.yaml"]) == 0  # the same proposal again


@pytest.mark.parametrize("content", [b"topics: {imu: {}}\n", b"\xff\xfe topics"])
def test_a_map_that_somebody_edited_stays(folder, capsys, content):
    (folder / "run.topics.yaml").write_bytes(content)
    assert main([*WORDS, "--yes"]) == 2
    assert "run.topics.yaml exists and differs from the proposal: go on with `ddagr import" in capsys.readouterr().err
    assert (folder / "run.topics.yaml").read_bytes() == content
    assert not (folder / "run.parquet").exists()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (["--map", "topics_default"], "--map topics_default and --guess are both given"),
        (["--map-output", "own.txt"], "ends in .yaml"),
        (["--output", "run.csv"], ".parquet"),
        (["--namespace", "/gamma"], "below '/gamma'"),
        (["--robot", "huskey"], "husky"),
        (["--maximum-rows", "100"], "--maximum-rows"),
    ],
)
def test_bad_input_is_one_sentence(folder, capsys, change, words):
    assert main([*WORDS, "--yes", *change]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1
    assert [path.name for path in folder.iterdir()] == ["my bag"]


@pytest.mark.parametrize("option", [["--yes"], ["--map-output", "own.yaml"], ["--namespace", "/a"]])
def test_options_of_a_guess_need_one(folder, capsys, option):
    assert main(["import", "my bag", "--output", "run.parquet", *option]) == 2
    assert f"{option[0]} is given without --guess" in capsys.readouterr().err


def test_a_table_is_no_bag(folder, capsys):
    (folder / "drive.csv").write_text("t,a\n0,1\n")
    assert main(["import", "drive.csv", "--guess", "--output", "run.parquet"]) == 2
    assert "drive.csv is no bag (text)" in capsys.readouterr().err


def test_a_command_without_a_robot_asks_for_it(folder, capsys):
    assert main(["import", "my bag", "--guess", "--yes", "--output", "run.parquet"]) == 2
    out, error = capsys.readouterr()
    assert "missing: no robot (--robot)" in out
    assert "name the robot (--robot)" in error


def test_a_drive_without_commands_is_imported_with_its_cost(tmp_path, monkeypatch, sent, capsys):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "my bag", [message for message in sent if message.kind != TWIST])
    assert main([*WORDS, "--yes"]) == 0
    assert "missing: no command" in capsys.readouterr().out
    assert not load_parquet(tmp_path / "run.parquet").command_valid.any()
