from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.cli import main
from ddagr_gym.commands import demo
from ddagr_gym.commands.demo import Arguments
from ddagr_gym.commands.output import Section
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.envs.options import make_settings
from ddagr_gym.evaluation.controllers import DEFAULT, find_controller
from ddagr_gym.evaluation.runs import drive_turn
from ddagr_gym.evaluation.shown import estimated_track
from ddagr_gym.parameters import Imu, PoseReceiver, Sensors
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.channels import CHANNELS
from ddagr_gym.recordings.load import load_recording
from ddagr_gym.recordings.schema import Recording
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
    # the row turn has its test below, the evaluation one beside its report
    left_out = "ddagr_gym.commands.demo_evaluation.evaluation_step"
    monkeypatch.setattr(left_out, lambda _: Section("Evaluation", "left out", "<p>left out</p>"))
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


@pytest.fixture(scope="module")
def driven():
    """A left turn at the wheel speeds of a robot that rolls without slip: wide, and cheap to drive."""
    settings = make_settings(radius=0.8, side="left", speed=0.2)
    return drive_turn(find_controller("B0", settings.turn(0.8, "left", 0.2)), settings, 1)


def test_the_estimate_is_judged_against_the_true_path(driven):
    turn = RowTurn(radius=0.8, side="left")
    distance = turn.distance_at(np.arange(0.0, turn.duration, 0.02))
    x, y = turn.position(distance).T
    episode = replace(driven.episode, turn=turn)
    run = replace(driven, columns={"true_x": x, "true_y": y}, episode=episode)
    # 1.25 times the true path about the world's origin, and moved so that it ends 30 and 40 mm off
    track = 1.25 * np.column_stack([x, y])
    track += [x[-1] - track[-1, 0] + 0.03, y[-1] - track[-1, 1] - 0.04]
    rows = dict(demo._estimate_rows(run, np.column_stack([track, turn.heading(distance)])))
    assert rows == {"radius estimated by the Kalman filter": "1.000 m", "estimated path off at the end": "50 mm"}
    straight = np.column_stack([x, 0.0 * x, 0.0 * x])
    assert list(dict(demo._estimate_rows(run, straight))) == ["estimated path off at the end"]


def test_figure_and_film_of_the_turn_show_the_estimate(monkeypatch, driven, tmp_path):
    class Renderer:
        def draw(self, scene):
            return scene

        def close(self):
            pass

    seen, filmed = [], []
    monkeypatch.setattr(demo, "_drive", lambda _: driven)
    monkeypatch.setattr("ddagr_gym.rendering.render.SceneRenderer", Renderer)
    monkeypatch.setattr("ddagr_gym.rendering.video.write_video", lambda path, frames: filmed.extend(frames))
    monkeypatch.setattr("ddagr_gym.reporting.figures.turn_figure", lambda columns, *_, **__: seen.append(columns))
    section = demo.turn_step(Arguments(), tmp_path)
    track = estimated_track(driven, DEFAULT)
    np.testing.assert_array_equal(np.column_stack([seen[0]["estimated_x"], seen[0]["estimated_y"]]), track[:, :2])
    np.testing.assert_array_equal(filmed[-1].estimated_track, track[:, :2])
    true = np.array([driven.columns[f"true_{axis}"][-1] for axis in "xy"])
    off = f"{1e3 * np.hypot(*(track[-1, :2] - true)):.0f} mm"
    assert section.text.splitlines()[-1].split("  ")[0] == "estimated path off at the end"
    assert section.text.endswith(off)
    # the recording stays one: readings and truth
    assert "estimated_x" not in (tmp_path / "row_turn.csv").read_text().splitlines()[0]


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
    printed = capsys.readouterr().out
    assert "every wheel fits its furrow" in printed
    assert "estimated path off at the end" in printed
