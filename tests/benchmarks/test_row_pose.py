"""Pose errors at the next row: by hand, on one turn, and as files."""

import json
import math

import numpy as np
import pytest

from benchmarks.row_pose import RESULT, drive, in_row, main, plant_table, table


def test_errors_along_and_across_by_hand():
    # a robot that points to minus x: 3 cm ahead of it is -x, 4 cm to its left is -y
    np.testing.assert_allclose(in_row(np.array([-0.03, -0.04, 0.1]), math.pi), [0.03, 0.04, 0.1], atol=1e-15)


def turn(integrated, pose, nees=1.0):
    return {"integrated": [integrated**2] * 3, "pose": [pose**2] * 3, "nees": nees}


def test_figures_by_hand():
    found = plant_table([turn(0.03, 0.01, 0.5), turn(0.04, 0.02, 1.5), None])
    assert (found["turns"], found["reached"]) == (3, 2)
    assert found["integrated"]["along_mm"]["value"] == pytest.approx(1e3 * math.sqrt((9e-4 + 16e-4) / 2), rel=1e-3)
    assert found["pose_over_integrated"]["across"]["value"] == pytest.approx(math.sqrt(5.0 / 25.0), rel=1e-3)
    assert found["nees"]["value"] == pytest.approx(1.0)
    none = plant_table([None])
    assert "never reached" in table({"plants": {"slope_5": none}})


def test_on_a_slope_the_pose_knows_the_heading_better():
    found = [drive("slope_3", number) for number in range(4)]
    integrated, pose = (np.mean([item[name][2] for item in found]) for name in ("integrated", "pose"))
    assert pose < 0.25 * integrated


def test_files_are_written_and_bad_names_are_one_sentence(tmp_path, capsys):
    out = tmp_path / "row.json"
    assert main(["--plants", "level", "--scenarios", "2", "--output", str(out)]) == 0
    written = out.read_text()
    assert json.loads(written)["plants"]["level"]["turns"] == 2
    out.with_suffix(".png").unlink()
    assert main(["--summary", "--output", str(out)]) == 0
    assert out.with_suffix(".png").stat().st_size > 10_000
    assert out.read_text() == written
    for wrong in (["--plants", "moon"], ["--scenarios", "1"]):
        with pytest.raises(SystemExit) as stopped:
            main([*wrong, "--output", str(tmp_path / "none.json")])
        assert stopped.value.code == 2
    assert not (tmp_path / "none.json").exists()
    assert "moon" in capsys.readouterr().err


def test_kept_result_says_what_the_pose_gains():
    found = {name: own["pose_over_integrated"] for name, own in json.loads(RESULT.read_text())["plants"].items()}
    assert len(found) == 8
    assert all(own["across"]["value"] < 1.0 for own in found.values())
    assert all(own["along"]["interval"][0] < 1.0 for own in found.values())
    assert found["late"]["across"]["interval"][1] < 1.0
    assert found["slope_3"]["heading"]["interval"][1] < 0.5
