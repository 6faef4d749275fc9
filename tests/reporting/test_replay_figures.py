from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.control.manoeuvres import MANOEUVRES
from ddagr_gym.parameters import Imu, PoseReceiver, Sensors
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.channels import CHANNELS
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.replay_analysis.drive_mode import ReplaySettings
from ddagr_gym.replay_analysis.run import replay_run
from ddagr_gym.reporting.replay_figures import (
    CELLS,
    _chosen,
    _fitted_to_cells,
    _in_body_frame,
    replay_overview,
    replay_residuals,
)


@pytest.fixture(scope="module")
def drive():
    commands = np.concatenate([MANOEUVRES["spin"].commands(50.0), MANOEUVRES["table_6_2"].commands(50.0)])
    sensors = Sensors(imu=Imu(sample_rate=50.0), pose=PoseReceiver(5.0))
    columns = simulate_columns(commands, sensors)
    return Recording.from_columns(columns, get_robot("ddagr"))


def simulate_columns(commands, sensors):
    from ddagr_gym.simulator import simulate

    columns = simulate(get_robot("ddagr"), get_soil("thesis_a1"), commands, sensors=sensors, seed=0)
    return {name: values for name, values in columns.items() if name == "t" or name in CHANNELS}


def replayed(recording, window=2.0):
    return replay_run([recording], get_robot("ddagr"), get_soil("thesis_a1"), ReplaySettings(window)).drive_modes


@pytest.fixture(scope="module")
def mode(drive):
    return replayed(drive)[0]


@pytest.mark.parametrize("draw", [replay_overview, replay_residuals])
def test_figures_are_written_as_png_and_svg(mode, tmp_path, draw):
    from matplotlib.image import imread

    png, svg = draw(mode, tmp_path / "figure", "A title & more")
    image = imread(png)
    assert image.shape[1] == 2200
    assert image.std() > 0.02
    assert svg.read_text().lstrip().startswith("<?xml")


@pytest.mark.parametrize("lacking", [("pose_x", "pose_y", "pose_yaw"), ("yaw_rate",)])
def test_what_is_lacking_leaves_the_other_panels(drive, tmp_path, lacking):
    channels = {name: values for name, values in drive.columns().items() if name not in lacking}
    modes = replayed(Recording.from_columns(channels, get_robot("ddagr")))
    png, _ = replay_overview(modes[0], tmp_path / "figure", "title")
    assert png.stat().st_size > 20_000


def test_paths_are_seen_from_their_start():
    start = np.array([2.0, 1.0, np.pi / 2.0])
    seen = _in_body_frame(np.array([[2.0, 4.0], [1.0, 1.0]]), start)
    np.testing.assert_allclose(seen, [[3.0, 0.0], [0.0, 1.0]], atol=1e-12)


def test_cells_hold_their_paths_at_their_scale():
    paths = [[np.array([[0.0, 0.0], [10.0, 5.0]])], [np.array([[0.0, 0.0], [0.1, 0.0]])]]
    fitted, cells = _fitted_to_cells(paths)
    for group, (left, bottom, metres), original in zip(fitted, cells, paths, strict=True):
        path = group[0]
        assert (path >= np.array([left, bottom])).all()
        assert (path <= np.array([left, bottom]) + 0.92 + 1e-9).all()
        length = np.linalg.norm(np.diff(original[0], axis=0))
        assert np.linalg.norm(np.diff(path, axis=0)) * metres == pytest.approx(length)


def test_at_most_twelve_roll_outs_are_chosen(drive):
    rows = [(k, k + 100) for k in range(0, 2000, 100)]
    columns = {name: values[:2000] for name, values in drive.columns().items()}
    modes = replayed(Recording.from_columns(columns, get_robot("ddagr"), spans=rows, segments=rows), 1.0)
    chosen = _chosen(modes[0])
    assert len(chosen) == CELLS
    assert sum(windows.count for windows, _ in modes[0].rollouts) == 20
