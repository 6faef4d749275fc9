"""Policies that see the path beside B6: what is kept of which controllers, and that the page says the same."""

from __future__ import annotations

import json

import pytest

pytest.importorskip("matplotlib", reason="needs the extra report")
pytest.importorskip("pyarrow", reason="needs the extra io")

from benchmarks import path_policies
from benchmarks.path_policies import ALL_SETS, BASE, BEFORE, CLOSER, CONTROLLERS, VALIDATION, from_before, table
from benchmarks.scenario_sets import PLANS, draw_set
from benchmarks.second_sets import SETS, version_of
from ddagr_gym.errors import InputError
from ddagr_gym.evaluation import scenarios as scenario_module
from ddagr_gym.evaluation.scenarios import save_scenarios, set_hash


@pytest.fixture(scope="module")
def committed():
    return json.loads(path_policies.RESULT.read_text())


def test_the_record_is_of_what_ships(committed):
    assert list(committed["controllers"]) == [*BEFORE, *CONTROLLERS]
    for name, version in committed["controllers"].items():
        assert version_of(name) == version
    assert committed["scenarios"] == {name: set_hash(name) for name in ALL_SETS}
    assert set(committed["sets"][VALIDATION]) == set(CONTROLLERS)
    for name in SETS:
        assert all((CLOSER in found) == (arm in CONTROLLERS and arm != BASE)
                   for arm, found in committed["sets"][name].items())  # fmt: skip


def test_the_base_turns_as_in_the_record_of_the_second_sets(committed):
    """To a tenth of a percent: another machine's rounding changes single turns of B6."""
    second = json.loads(path_policies.SECOND_RESULT.read_text())
    for name in SETS:
        assert {arm: committed["sets"][name][arm] for arm in BEFORE} == {
            arm: second["sets"][name][arm] for arm in BEFORE
        }
        for metric in ("radius_error_median", "success_rate"):
            found, before = (record["sets"][name][BASE][metric]["value"] for record in (committed, second))
            assert found == pytest.approx(before, abs=1e-3)


def test_the_page_of_results_says_what_the_record_says(committed, repository):
    assert table(committed) in (repository / "docs/results/row_turns.md").read_text()


def test_a_record_of_another_controller_is_refused(tmp_path):
    record = json.loads(path_policies.SECOND_RESULT.read_text())
    record["controllers"]["B4"] = "other"
    (tmp_path / "second.json").write_text(json.dumps(record))
    with pytest.raises(InputError, match="another B4"):
        from_before(SETS, tmp_path / "second.json")


def test_turns_are_driven_and_compared(tmp_path, monkeypatch):
    monkeypatch.setattr(scenario_module, "scenario_folder", lambda: tmp_path / "scenarios")
    monkeypatch.setitem(PLANS, "V", PLANS["V"].__class__("two", 2, PLANS["V"].draw))
    save_scenarios("V", "two", draw_set("V"))
    (tmp_path / "episodes").mkdir()
    found = path_policies.driven(tmp_path / "episodes", (BASE, "ppo_path"), 1, ("V",))["V"]
    assert found[BASE]["episodes"] == found["ppo_path"]["episodes"] == 2
    assert 0.0 <= found["ppo_path"][CLOSER]["value"] <= 1.0
    assert CLOSER not in found[BASE]
