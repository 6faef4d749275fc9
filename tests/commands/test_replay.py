from __future__ import annotations

import json
from html.parser import HTMLParser

import numpy as np
import pytest

from ddagr_gym.cli import main
from ddagr_gym.config import config_from
from ddagr_gym.parameters import Imu, PoseReceiver, Sensors
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.channels import CHANNELS
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.recordings.storage import save_parquet
from ddagr_gym.replay_analysis.report import ReplayReport
from ddagr_gym.reporting.replay_text import summary
from ddagr_gym.simulator import simulate

RATE = 50.0
PNG = b"\x89PNG"


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Two short drives, and one that lasts a second."""
    folder = tmp_path_factory.mktemp("runs")
    robot = get_robot("ddagr")
    sensors = Sensors(imu=Imu(sample_rate=RATE), pose=PoseReceiver(rate=5.0))
    for name, seed, seconds in (("one", 0, 12), ("two", 1, 12), ("blink", 2, 1)):
        rng = np.random.default_rng(seed)
        commands = np.repeat(rng.uniform(-1.2, 1.3, (seconds // 2 + 1, 2)), 100, axis=0)[: round(seconds * RATE)]
        columns = simulate(robot, get_soil("thesis_a1"), commands, sensors=sensors, seed=seed)
        kept = {key: values for key, values in columns.items() if key == "t" or key in CHANNELS}
        save_parquet(Recording.from_columns(kept, robot, source=f"{name}.sim"), folder / f"{name}.parquet")
    return folder


@pytest.fixture(scope="module")
def replayed(runs, tmp_path_factory):
    """Output of a replay of two runs, each on its own."""
    output = tmp_path_factory.mktemp("replays") / "out"
    words = ["replay", str(runs / "one.parquet"), str(runs / "two.parquet"), "--soil", "thesis_a1", "-o", str(output)]
    assert main(words) == 0
    return output


class Links(HTMLParser):
    """Files that a page names, and the tags that are open at its end."""

    VOID = ("meta", "img", "br")

    def __init__(self, text: str) -> None:
        super().__init__()
        self.files: list[str] = []
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.files += [value for key, value in attributes if key in ("src", "href") and not value.startswith("#")]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_report_figures_and_page_are_written(replayed):
    names = {path.name for path in replayed.iterdir()} - {".ddagr-output"}
    runs_and_drives = [(run, drive) for run in ("1_one", "2_two") for drive in ("commands", "encoders")]
    stems = [f"{run}_{drive}{part}" for run, drive in runs_and_drives for part in ("", "_residuals")]
    figures = {f"{stem}.{kind}" for stem in stems for kind in ("png", "svg")}
    assert names == {"replay.json", "index.html"} | figures
    assert all((replayed / f"{stem}.png").read_bytes().startswith(PNG) for stem in stems)


def test_the_page_is_sound_and_names_only_files_that_are_there(replayed):
    text = (replayed / "index.html").read_text()
    page = Links(text)
    assert page.open == []
    assert len(page.files) > 8
    assert all((replayed / name).is_file() for name in page.files)
    assert "one.parquet" in text
    assert "two.parquet" in text
    assert "times as fast as the robot" in text


def report_in(folder):
    return config_from(json.loads((folder / "replay.json").read_text()), ReplayReport)


def test_the_report_holds_both_runs_and_the_speed(replayed):
    report = report_in(replayed)
    assert [run.sources for run in report.runs] == [("one.parquet",), ("two.parquet",)]
    for run in report.runs:
        for mode in run.arms:
            assert mode.speed.times_real_time >= 100.0
            assert {e.horizon for e in mode.horizons} <= {1.0, 5.0, 30.0}
            assert mode.rollouts


def test_tables_are_shown_in_text(replayed):
    text = "\n".join(summary(report_in(replayed)))
    assert text.count("driven by commands") == text.count("driven by wheel speeds") == 2
    assert "heading after 1 s" in text
    assert "times real time on one core" in text
    assert "note: no unseen stretch with a known drive lasts 30 s" in text


def test_runs_replayed_together_share_their_parameters(runs, tmp_path, capsys):
    output = tmp_path / "out"
    paths = [str(runs / f"{name}.parquet") for name in ("one", "two")]
    assert main(["replay", *paths, "--soil", "thesis_a1", "--together", "--refit", "-o", str(output)]) == 0
    content = json.loads((output / "replay.json").read_text())
    (run,) = content["runs"]
    assert run["sources"] == ["one.parquet", "two.parquet"]
    names = [p["name"] for p in run["arms"][0]["refit"]["parameters"]]
    assert names.count("soil_strength") == 1
    assert {"gyro_bias_1", "gyro_bias_2"} <= set(names)
    captured = capsys.readouterr()
    assert "replaying: 100 %" in captured.err
    assert "refitted" in captured.out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "name one or more files"),
        (["absent.parquet"], "absent.parquet"),
        (["RUNS/one.parquet", "--robot", "husky"], "'ddagr'"),
        (["RUNS/one.parquet", "--threads", "0"], "threads is 0"),
        (["RUNS/one.parquet", "--window", "0.01"], "the window is 0.01 s"),
        (["RUNS/one.parquet", "--effect", "magic=1"], "magic"),
        (["RUNS/one.parquet", "--maximum-rows", "10"], "10"),
        (["RUNS/blink.parquet"], "no window of 2 s has valid commands or wheel speeds"),
    ],
)
def test_bad_input_ends_with_exit_2_and_writes_nothing(runs, tmp_path, capsys, words, message):
    output = tmp_path / "out"
    words = [word.replace("RUNS", str(runs)) for word in words]
    assert main(["replay", *words, "--soil", "thesis_a1", "-o", str(output)]) == 2
    captured = capsys.readouterr()
    assert message in captured.err
    assert "Traceback" not in captured.err
    assert not output.exists()


def test_an_unknown_soil_is_refused_with_the_closest(runs, tmp_path, capsys):
    words = ["replay", str(runs / "one.parquet"), "--soil", "thesis_a2", "-o", str(tmp_path / "out")]
    assert main(words) == 2
    assert "thesis_a1" in capsys.readouterr().err


def test_a_recording_that_names_no_robot_needs_one(runs, tmp_path, capsys):
    columns = {"t": np.arange(0.0, 10.0, 0.05), "command_right": np.zeros(200), "command_left": np.zeros(200)}
    save_parquet(Recording.from_columns(columns), tmp_path / "nameless.parquet")
    words = ["replay", str(tmp_path / "nameless.parquet"), "--soil", "thesis_a1", "-o", str(tmp_path / "out")]
    assert main(words) == 2
    assert "name it with --robot" in capsys.readouterr().err


def test_an_earlier_output_is_kept_without_overwrite(replayed, runs, capsys):
    before = (replayed / "replay.json").read_bytes()
    assert main(["replay", str(runs / "one.parquet"), "--soil", "thesis_a1", "-o", str(replayed)]) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert (replayed / "replay.json").read_bytes() == before
