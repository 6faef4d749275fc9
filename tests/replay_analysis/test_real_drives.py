"""Every real drive, open and concealed, goes through import, check and replay as it is."""

from __future__ import annotations

import json

import numpy as np
import pytest

from ddagr_gym.cli import main
from ddagr_gym.config import config_from
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.load import load_recording
from ddagr_gym.replay_analysis.drive_mode import ReplaySettings
from ddagr_gym.replay_analysis.report import NO_SLIP, NOMINAL, ReplayReport, save_report
from ddagr_gym.replay_analysis.run import make_report, replay_run

FOLDERS = {"open": 3, "concealed": 9}
"""Files in each folder."""


def drives(folder):
    found = sorted(folder.glob("*.csv.gz"))
    assert len(found) == FOLDERS[folder.name]
    return [(path, path.name.split("_")[0]) for path in found]


@pytest.mark.slow
@pytest.mark.parametrize("folder", FOLDERS)
def test_every_file_is_imported_and_checked(recordings_dir, tmp_path, folder):
    for path, robot in drives(recordings_dir / folder):
        imported = tmp_path / "drive.parquet"
        assert main(["import", str(path), "--robot", robot, "-o", str(imported)]) == 0, path.name
        # 1: something is suspicious; 2 would be a refusal
        assert main(["check", str(imported)]) in (0, 1), path.name


@pytest.mark.slow
@pytest.mark.parametrize("folder", FOLDERS)
def test_every_file_is_replayed(recordings_dir, tmp_path, folder):
    for path, robot in drives(recordings_dir / folder):
        recording = load_recording(path, None, robot)
        result = replay_run([recording], get_robot(robot), get_soil("firm_ground"))
        report = tmp_path / "replay.json"
        # refuses numbers that are not finite
        save_report(make_report([result], robot, "firm_ground", ReplaySettings()), report)
        (run,) = config_from(json.loads(report.read_text()), ReplayReport).runs
        assert [mode.drive for mode in run.arms] == ["commands", "encoders"], path.name
        for mode in run.arms:
            assert {NOMINAL, NO_SLIP} <= {e.model for e in mode.horizons if e.error.count}, path.name
            assert mode.residuals[0].channels, path.name
            assert mode.speed.times_real_time >= 100.0


@pytest.mark.slow
def test_a_drive_with_few_commands_is_judged_in_both_arms_with_a_refit(recordings_dir):
    """Commands are known in 30 s of 363 s only, and encoders come at 4 Hz."""
    recording = load_recording(recordings_dir / "concealed" / "warthog_6.csv.gz", None, "warthog")
    assert np.mean(recording.command_valid) < 0.1
    settings = ReplaySettings(refit=True)
    result = replay_run([recording], get_robot("warthog"), get_soil("firm_ground"), settings)
    for mode in result.report.arms:
        assert mode.training_windows > 0
        assert mode.evaluation_windows > 0
        assert all(np.isfinite(p.value) for p in mode.refit.parameters)
