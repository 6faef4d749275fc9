"""The third drawing: its record is of what ships, obeys its rule, and is what the page of results says."""

from __future__ import annotations

import json

import pytest

pytest.importorskip("matplotlib", reason="needs the extra report")
pytest.importorskip("pyarrow", reason="needs the extra io")

from benchmarks.second_sets import default_by_rule, table, title, version_of
from benchmarks.third_sets import READING, main
from ddagr_gym.config import configs_dir
from ddagr_gym.evaluation.claims import check_claims, load_claims
from ddagr_gym.evaluation.controllers import DEFAULT
from ddagr_gym.evaluation.scenarios import set_hash


@pytest.fixture(scope="module")
def committed():
    return json.loads(READING.result.read_text())


def test_the_record_is_of_what_ships(committed):
    assert committed["scenarios"] == {name: set_hash(name) for name in READING.sets}
    assert committed["controllers"] == {name: version_of(name) for name in READING.controllers}


def test_the_record_obeys_its_rules(committed):
    by_arm = {arm: {name: found[arm] for name, found in committed["sets"].items()} for arm in committed["controllers"]}
    assert default_by_rule(by_arm, READING)["chosen"] == committed["default"]["chosen"] == DEFAULT
    claims = check_claims(load_claims(configs_dir() / "evaluation" / READING.claims), by_arm)
    assert [claim.verdict for claim in claims] == [claim["verdict"] for claim in committed["claims"]]
    assert "not driven" not in {claim.verdict for claim in claims}


def test_the_page_of_results_says_what_the_record_says(committed, repository):
    assert table(committed) in (repository / "docs/results/row_turns.md").read_text()


def test_titles_say_what_a_plant_is():
    assert title("on_slope_3_c") == "on_slope_3_c: slope of 3 degrees"
    assert title("S2c") == "S2c: weaker soils than the training range"


def test_the_former_default_is_needed(capsys, tmp_path):
    with pytest.raises(SystemExit, match="2"):
        main([str(tmp_path), "--controllers", "B1,B4,B6_pose"])
    assert "lacks B6" in capsys.readouterr().err
