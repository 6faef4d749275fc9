"""``ddagr study filter`` end to end on a small plan."""

from __future__ import annotations

import json

import pytest

import tools
from ddagr_gym.cli import main

PLAN = """\
seed: 11
soil_sets: [thesis_a1_range]
drives: 2
radius: [0.8, 0.9]
matched_drives: 3
force_law_soils: 1
"""


def test_table_figure_and_progress(tmp_path, capsys, monkeypatch):
    pytest.importorskip("matplotlib")
    monkeypatch.delenv("DDAGR_RECORDINGS", raising=False)
    plan, folder = tmp_path / "plan.yaml", tmp_path / "out"
    plan.write_text(PLAN)
    assert main(["study", "filter", "--plan", str(plan), "--output", str(folder)], tools) == 0
    printed = capsys.readouterr()
    assert "our filter" in printed.out
    assert "No real drives" in printed.out
    assert "100 %" in printed.err
    document = json.loads((folder / "filter.json").read_text())
    shown = document["filter"]["thesis_a1_range"]["radius_error_median"]["value"]
    assert f"{100 * shown:.1f} %" in printed.out
    assert (folder / "filter.png").stat().st_size > 50_000
    assert sorted(path.name for path in folder.iterdir()) == ["filter.json", "filter.png"]


def test_a_bad_plan_is_one_sentence(tmp_path, capsys):
    plan = tmp_path / "plan.yaml"
    plan.write_text(PLAN.replace("drives: 2", "drives: 0"))
    assert main(["study", "filter", "--plan", str(plan), "--output", str(tmp_path / "out")], tools) == 2
    message = capsys.readouterr().err
    assert "drives is 0" in message
    assert message.count("\n") == 1
    assert not (tmp_path / "out").exists()
