from __future__ import annotations

import json

import numpy as np
import pytest

from ddagr_gym.cli import main
from ddagr_gym.commands import demo
from ddagr_gym.commands.demo import Arguments, Section
from ddagr_gym.parameters import Imu, PoseReceiver, Sensors
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.load import load_recording
from ddagr_gym.recordings.schema import CHANNELS, Recording
from ddagr_gym.recordings.storage import save_parquet
from ddagr_gym.simulator import simulate


@pytest.fixture(scope="module")
def recording():
    """12 s of turns on the spot."""
    commands = np.repeat([(0.8, -0.8), (-0.8, 0.8)], 300, axis=0)
    sensors = Sensors(imu=Imu(sample_rate=50.0), pose=PoseReceiver(5.0))
    columns = simulate(get_robot("ddagr"), get_soil("thesis_a1"), commands, sensors=sensors, seed=0)
    kept = {name: values for name, values in columns.items() if name == "t" or name in CHANNELS}
    return Recording.from_columns(kept, get_robot("ddagr"), source="spin.sim")


def test_the_shipped_drive_is_sound_and_of_known_origin(repository):
    shipped = load_recording(repository / "ddagr_gym" / "data" / "replay_demo.parquet")
    assert shipped.meta.robot == "ddagr"
    assert shipped.validate() == ()
    assert not any(name.startswith("true_") for name in shipped.columns())
    assert "simulated by benchmarks/make_replay_demo.py." in shipped.meta.notes


def test_a_given_recording_is_replayed_and_linked(monkeypatch, recording, tmp_path, capsys):
    # the row turn has its test below
    monkeypatch.setattr(demo, "turn_step", lambda *_: Section("Turn", "left out", "<p>left out</p>"))
    path, output = tmp_path / "mine.parquet", tmp_path / "out"
    save_parquet(recording, path)
    assert main(["demo", "--recording", str(path), "--soil", "thesis_a1", "--output", str(output)]) == 0
    content = json.loads((output / "replay" / "replay.json").read_text())
    assert (content["soil"], content["refit"]) == ("thesis_a1", True)
    page = (output / "index.html").read_text()
    assert "left out" in page
    assert "mine.parquet" in page
    for name in ("replay/index.html", "replay/replay.json", "replay/spin_commands.png"):
        assert f'"{name}"' in page
        assert (output / name).is_file()
    text = capsys.readouterr().out
    assert "spin.sim" in text
    assert "effective track" in text


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--recording", "absent.csv"], "absent.csv"),
        (["--soil", "mud_pie"], "mud_pie"),
        (["--robot", "husky"], "'ddagr'"),
    ],
)
def test_bad_input_ends_before_anything_is_driven(monkeypatch, tmp_path, capsys, words, message):
    monkeypatch.setattr(demo, "turn_step", lambda *_: pytest.fail("the demonstration began"))
    output = tmp_path / "out"
    assert main(["demo", *words, "--output", str(output)]) == 2
    assert message in capsys.readouterr().err
    assert not output.exists()


def test_another_robot_starts_on_hard_ground(tmp_path):
    t = np.arange(0.0, 10.0, 0.05)
    save_parquet(Recording.from_columns({"t": t}, get_robot("husky")), tmp_path / "husky.parquet")
    drive = demo._drive_to_replay(Arguments(recording=tmp_path / "husky.parquet"))
    assert (drive.robot, drive.soil) == ("husky", "firm_ground")


@pytest.mark.slow
def test_the_whole_demonstration(tmp_path, capsys):
    output = tmp_path / "out"
    assert main(["demo", "--output", str(output)]) == 0
    for name in ("index.html", "row_turn.csv", "row_turn.mp4", "row_turn.svg", "replay/index.html"):
        assert (output / name).stat().st_size > 0
    arms = json.loads((output / "replay" / "replay.json").read_text())["runs"][0]["arms"]
    refit = {p["name"]: p["value"] for p in arms[0]["refit"]["parameters"]}
    # the factors of benchmarks/make_replay_demo.py
    assert refit["soil_strength"] == pytest.approx(np.log(0.8), abs=0.1)
    assert refit["motor_rate"] == pytest.approx(np.log(0.85), abs=0.02)
    assert "every wheel fits its furrow" in capsys.readouterr().out
