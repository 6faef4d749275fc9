"""``ddagr validate`` end to end on the shared reference data, and refused where there is none."""

import json

import pytest

from ddagr_gym.cli import main


def test_tables_json_and_figures(shared_dir, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    folder = tmp_path / "out"
    assert main(["validate", "--data", str(shared_dir / "reference"), "--output", str(folder)]) == 0
    printed = capsys.readouterr().out
    assert "slip >= 0, angle <= 60 deg" in printed
    assert "FIT" in printed
    results = json.loads((folder / "validation.json").read_text())
    first = results["single_wheel"]["published soil values"]["regions"][0]
    assert first["trials"] == 75
    assert first["drawbar"] <= 0.15
    assert f"{first['drawbar']:.3f}" in printed
    assert len(results["chrono"]["model"]["yaw_rate_ratio"]) == 18
    for name in ("single_wheel", "chrono"):
        assert (folder / f"{name}.png").stat().st_size > 50_000
        assert (folder / f"{name}.svg").is_file()


def test_folder_without_data_leaves_nothing_behind(tmp_path, capsys):
    assert main(["validate", "--data", str(tmp_path / "none"), "--output", str(tmp_path / "out")]) == 2
    message = capsys.readouterr().err
    assert "does not exist" in message
    assert message.count("\n") == 1
    assert not (tmp_path / "out").exists()
    assert not list(tmp_path.iterdir())
