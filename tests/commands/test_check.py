from __future__ import annotations

import json

import numpy as np
import pytest

from ddagr_gym.cli import main
from ddagr_gym.parameters import Imu, PoseReceiver, Sensors
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.checks.findings import judge, not_testable
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.recordings.storage import save_parquet
from ddagr_gym.reporting.check_text import findings_text
from ddagr_gym.simulator import simulate


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A sound simulated run, another one, and one with the gyro upside down."""
    folder = tmp_path_factory.mktemp("runs")
    robot = get_robot("ddagr")
    sensors = Sensors(imu=Imu(sample_rate=50.0), pose=PoseReceiver(rate=5.0))
    for name, seed, sign in (("sound", 0, 1.0), ("other", 1, 1.0), ("flipped", 0, -1.0)):
        rng = np.random.default_rng(seed)
        commands = np.repeat(rng.uniform(-1.2, 1.3, (16, 2)) * (rng.random((16, 1)) < 0.8), 150, axis=0)
        commands[:150] = 0.0
        columns = simulate(robot, get_soil("thesis_a1"), commands, sensors=sensors, seed=seed)
        columns["yaw_rate"] = sign * columns["yaw_rate"]
        save_parquet(Recording.from_columns(columns, robot, source=f"{name}.sim"), folder / f"{name}.parquet")
    return folder


def test_a_sound_run_passes_with_exit_0(runs, capsys):
    assert main(["check", str(runs / "sound.parquet")]) == 0
    text = capsys.readouterr().out
    assert "0 suspicious" in text
    assert "->" not in text


def test_a_flipped_gyro_is_named_with_what_to_do_and_exit_1(runs, capsys):
    assert main(["check", str(runs / "flipped.parquet")]) == 1
    text = capsys.readouterr().out
    assert "The gyro turns the wrong way." in text
    assert "-> sign_and_scale, yaw_rate to pose_yaw: Correct the gyro's sign" in text


def test_figures_and_reports_are_written(runs, tmp_path, capsys):
    output = tmp_path / "checked"
    words = ["check", str(runs / "sound.parquet"), str(runs / "other.parquet"), "--output", str(output)]
    assert main(words) == 0
    names = {p.name for p in output.iterdir()} - {".ddagr-output"}
    assert names == {"sound.json", "sound.png", "other.json", "other.png", "together.json"}
    content = json.loads((output / "sound.json").read_text())
    assert content["schema_version"] == 1
    assert content["verdict"] == "pass"
    assert json.loads((output / "together.json").read_text())["findings"]
    assert "all 2 runs together" in capsys.readouterr().out


def test_passes_are_listed_on_request(runs, capsys):
    assert main(["check", str(runs / "sound.parquet"), "--all"]) == 0
    assert "gravity" in capsys.readouterr().out


def test_a_broken_run_stops_everything_before_anything_is_written(runs, tmp_path, capsys):
    broken = tmp_path / "broken.parquet"
    broken.write_bytes((runs / "sound.parquet").read_bytes()[:-100])
    output = tmp_path / "checked"
    assert main(["check", str(runs / "sound.parquet"), str(broken), "--output", str(output)]) == 2
    captured = capsys.readouterr()
    assert "broken.parquet is a damaged Parquet file" in captured.err
    assert captured.out == ""
    assert not output.exists()


def test_runs_of_two_robots_are_refused(runs, tmp_path, capsys):
    other = Recording.from_columns({"t": np.arange(10.0)}, get_robot("husky"))
    save_parquet(other, tmp_path / "husky.parquet")
    assert main(["check", str(runs / "sound.parquet"), str(tmp_path / "husky.parquet")]) == 2
    assert "one robot at a time" in capsys.readouterr().err


def test_no_run_is_refused(capsys):
    assert main(["check"]) == 2
    assert "name one or more files" in capsys.readouterr().err


def test_the_table_counts_what_it_does_not_show():
    findings = [
        judge("a", "x", 1.0, (0.9, 1.1), (0, 2), "s", meaning="fine", remedy="none"),
        judge("b", "y", 5.0, (4.0, 6.0), (0, 2), "s", meaning="far out", remedy="mend it"),
        not_testable("c", "z", "too short", "drive on"),
        not_testable("d", "z", "too short", "drive on"),
    ]
    text = findings_text(findings)
    assert "fine" not in text
    assert "5 (4 to 6) s" in text
    assert "  -> b, y: mend it" in text
    assert text.count("  to test more: drive on") == 1
    assert text.endswith("1 pass, 1 suspicious, 2 not testable")
    assert "fine" in findings_text(findings, everything=True)


@pytest.mark.parametrize(
    ("interval", "said"), [((4.0, np.inf), "5 (4 or more) s"), ((-np.inf, 6.0), "5 (6 or less) s")]
)
def test_an_interval_with_an_open_end_is_said_in_words(interval, said):
    finding = judge("b", "y", 5.0, interval, (0, 2), "s", meaning="far out", remedy="mend it")
    assert said in findings_text([finding], everything=True)
