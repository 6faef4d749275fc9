"""``ddagr_gym.simulate``: drives from names, files, objects and arrays."""

from __future__ import annotations

import numpy as np
import pytest

import ddagr_gym
from ddagr_gym.control.manoeuvres import Manoeuvre
from ddagr_gym.errors import InputError
from ddagr_gym.physics.effects.slope import Slope
from ddagr_gym.presets import get_robot, get_soil

TURN = Manoeuvre("turn", ((2.0, 1.0, 0.4),))


def test_a_manoeuvre_comes_as_object_file_and_array(tmp_path):
    path = tmp_path / "turn.csv"
    path.write_text("t,command_right,command_left\n0,1.0,0.4\n1,1.0,0.4\n")
    drives = [ddagr_gym.simulate(given, rate=50.0) for given in (TURN, path, str(path), TURN.commands(50.0))]
    assert [drive.title for drive in drives] == ["turn", "turn", "turn", "own commands"]
    for drive in drives:
        np.testing.assert_array_equal(drive.columns["true_x"], drives[0].columns["true_x"])


def test_names_and_objects_of_robot_soil_and_effects_are_the_same():
    named = ddagr_gym.simulate(TURN, "husky", "firm_ground", "slope=0.1", rate=50.0)
    given = ddagr_gym.simulate(TURN, get_robot("husky"), get_soil("firm_ground"), (Slope(0.1),), rate=50.0)
    assert (given.soil_name, given.robot.name) == ("firm_ground", "husky")
    for name, values in named.columns.items():
        np.testing.assert_array_equal(values, given.columns[name])
    level = ddagr_gym.simulate(TURN, "husky", "firm_ground", rate=50.0)
    assert not np.array_equal(level.columns["true_x"], named.columns["true_x"])


def test_noise_poses_and_rate_are_as_asked():
    quiet = [ddagr_gym.simulate(TURN, noise=False, seed=seed, rate=100.0, pose_rate=10.0) for seed in (0, 1)]
    np.testing.assert_array_equal(quiet[0].columns["yaw_rate"], quiet[1].columns["yaw_rate"])
    np.testing.assert_allclose(quiet[0].columns["yaw_rate"], quiet[0].truth["yaw_rate"], atol=1e-12)
    assert len(quiet[0].columns["t"]) == 200
    assert np.isfinite(quiet[0].columns["pose_x"]).sum() == 1 + 20  # at the start, and every 0.1 s
    noisy = ddagr_gym.simulate(TURN, rate=100.0)
    assert np.std(noisy.columns["yaw_rate"] - noisy.truth["yaw_rate"]) > 0.0


def test_the_recording_has_the_truth_beside_it(drive):
    assert drive.recording.meta.robot == "ddagr"
    assert drive.recording.t[0] == 0.0
    np.testing.assert_array_equal(drive.recording.extras["true_x"], drive.truth["x"])


def test_text_notebook_and_name_say_where_it_ended(drive):
    assert "largest sinkage" in str(drive)
    assert repr(drive).startswith("<SimulationResult: arcs, ddagr on thesis_a1: 36.0 s")
    assert "largest sinkage" in drive._repr_html_()


def test_files_are_written_and_wrong_endings_refused(drive, tmp_path):
    drive.save(tmp_path / "run.csv")
    assert (tmp_path / "run.csv").read_text().startswith("t,command_right,command_left,")
    for write, ending in ((drive.save, ".csv"), (drive.figure, ".png"), (drive.video, ".mp4")):
        with pytest.raises(InputError, match=f"ends in .*{ending}"):
            write(tmp_path / "run.doc")
    assert [path.name for path in tmp_path.iterdir()] == ["run.csv"]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"manoeuvre": "strait"}, "straight"),
        ({"manoeuvre": [1.0, 2.0]}, "give \\(T, 2\\)"),
        ({"soil": "mud"}, "unknown soil 'mud'"),
        ({"effects": "slop=0.1"}, "slope"),
        ({"rate": -1.0}, "rate"),
        ({"rate": 0.0}, "rate"),
    ],
)
def test_bad_input_is_one_sentence(given, message):
    with pytest.raises(InputError, match=message):
        ddagr_gym.simulate(**given)
