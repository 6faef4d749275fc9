from __future__ import annotations

import gzip

import numpy as np
import pytest

from ddagr_gym.cli import main
from ddagr_gym.recordings.storage import load_parquet

ROWS = "".join(f"{0.05 * i:.2f},calib,0,0.5,0.2,{i % 7},{i % 5},0.1,0.2,9.8\n" for i in range(40))
MAP = """
time: {column: t}
body_commands: {forward: {column: v}, turn: {column: w}}
command_valid: {column: state, values: [calib]}
channels:
  encoder_left: {column: left, unit: rpm}
  encoder_right: {column: right, unit: rpm}
  specific_force_x: {column: ax}
  specific_force_y: {column: ay}
  specific_force_z: {column: az}
"""


@pytest.fixture
def source(tmp_path):
    path = tmp_path / "drive.csv.gz"
    path.write_bytes(gzip.compress(("t,state,step,v,w,left,right,ax,ay,az\n" + ROWS).encode()))
    (tmp_path / "map.yaml").write_text(MAP)
    return path


def test_a_csv_becomes_a_recording(source, tmp_path, capsys):
    output = tmp_path / "run.parquet"
    words = ["import", str(source), "--map", str(tmp_path / "map.yaml"), "--robot", "husky", "--output", str(output)]
    assert main(words) == 0
    recording = load_parquet(output)
    assert len(recording) == 40
    assert recording.meta.robot == "husky"
    np.testing.assert_allclose(recording["encoder_left"][3], 3 * 2 * np.pi / 60)
    text = capsys.readouterr().out
    assert "note: bank speed commands are (v +- w W)/R" in text
    assert "doubt: yaw_rate holds no samples" in text


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (["--robot", "huskey"], "husky"),
        (["--robot", ""], "--robot"),
        (["--map", "drive_step"], "drive_steps"),
        (["--map", "absent.yaml"], "absent.yaml"),
        (["--output", "run.csv"], ".parquet"),
        (["--output", "map.yaml/run.parquet"], "a file is in the way"),
        (["--maximum-rows", "10"], "--maximum-rows"),
    ],
)
def test_bad_input_is_one_sentence_exit_2_and_no_file(source, tmp_path, capsys, monkeypatch, change, words):
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.iterdir())
    base = ["import", str(source), "--map", "map.yaml", "--robot", "husky", "--output", "run.parquet"]
    assert main([*base, *change]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1
    assert "Traceback" not in error
    assert sorted(tmp_path.iterdir()) == before


def test_a_truncated_source_leaves_an_earlier_import_alone(source, tmp_path, capsys):
    output = tmp_path / "run.parquet"
    words = ["import", str(source), "--map", str(tmp_path / "map.yaml"), "--robot", "husky", "--output", str(output)]
    assert main(words) == 0
    before = output.read_bytes()
    source.write_bytes(source.read_bytes()[:-20])
    assert main(words) == 2
    assert "damaged or truncated" in capsys.readouterr().err
    assert output.read_bytes() == before
