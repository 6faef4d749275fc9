"""``./ddagr freeze-scenarios`` and ``tune-controllers`` end to end on few episodes."""

import json

import tools
from benchmarks import gain_search
from ddagr_gym.cli import main
from ddagr_gym.evaluation import scenarios
from ddagr_gym.evaluation.scenarios import set_hash


def test_freezing_again_gives_the_shipped_set_and_replaces_nothing(tmp_path, capsys, monkeypatch):
    expected = set_hash("S0")
    assert main(["freeze-scenarios", "S0", "--output", str(tmp_path)], tools) == 0
    monkeypatch.setattr(scenarios, "scenario_folder", lambda: tmp_path)
    assert set_hash("S0") == expected
    before = (tmp_path / "S0.json.gz").read_bytes()
    assert main(["freeze-scenarios", "S0", "--output", str(tmp_path)], tools) == 2
    assert "exists" in capsys.readouterr().err
    assert (tmp_path / "S0.json.gz").read_bytes() == before
    assert main(["freeze-scenarios", "S9", "--output", str(tmp_path)], tools) == 2


def test_tuning_writes_gains_and_record(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(gain_search, "STAGES", ((2, 1),))
    monkeypatch.setattr(gain_search.GainSearch.__init__, "__kwdefaults__", {
        **gain_search.GainSearch.__init__.__kwdefaults__, "stages": ((2, 1),)
    })  # fmt: skip
    assert main(["tune-controllers", "--controllers", "B2", "--output", str(tmp_path)], tools) == 0
    record = json.loads((tmp_path / "gain_search.json").read_text())
    assert record[0]["controller"] == "B2"
    assert set(record[0]["best"]) == {"proportional", "integral", "derivative", "lead_factor"}
    assert (tmp_path / "ladder_gains.yaml").is_file()
    assert "B2" in capsys.readouterr().out
    assert main(["tune-controllers", "--controllers", "B1", "--output", str(tmp_path)], tools) == 2
