"""The second drawing and the frozen plants: which controller becomes the default by the rule, and what is kept."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

pytest.importorskip("matplotlib", reason="needs the extra report")
pytest.importorskip("pyarrow", reason="needs the extra io")

from benchmarks import second_sets
from benchmarks.second_sets import READING, SETS, default_by_rule, table
from benchmarks.third_sets import READING as THIRD
from ddagr_gym.config import configs_dir
from ddagr_gym.evaluation.claims import check_claims, load_claims
from ddagr_gym.evaluation.scenarios import set_hash


@pytest.fixture(scope="module")
def committed():
    return json.loads(second_sets.RESULT.read_text())


def metrics(success, error, closer=(0.4, 0.6)):
    return {
        "success_rate": {"value": success},
        "radius_error_median": {"value": error},
        "improvement_over_B4": {"interval": list(closer)},
    }


def summary(**arms):
    return {arm: {"S1b": found, "S2b": found} for arm, found in arms.items()}


@pytest.mark.parametrize(
    ("arms", "chosen"),
    [
        # the most successful; within a point of it the closest one
        ({"B1": metrics(0.99, 0.01), "B4": metrics(0.9, 0.005), "B6": metrics(0.95, 0.01)}, "B1"),
        ({"B1": metrics(0.955, 0.03), "B4": metrics(0.9, 0.005), "B6": metrics(0.95, 0.01)}, "B6"),
        # one that is surely less close in range replaces nothing
        ({"B4": metrics(0.9, 0.005), "B6": metrics(0.95, 0.01, (0.3, 0.49))}, "B4"),
        # the true state is no option
        ({"B4": metrics(0.9, 0.005), "true_path": metrics(1.0, 0.001)}, "B4"),
        # no circle at all is the worst
        ({"B4": metrics(0.9, None), "B6": metrics(0.9, 0.5)}, "B6"),
    ],
)
def test_the_rule_for_the_default(arms, chosen):
    reading = replace(READING, sets=("S1b", "S2b"))
    assert default_by_rule(summary(**arms), reading)["chosen"] == chosen


def test_the_record_is_of_what_ships(committed):
    assert committed["scenarios"] == {name: set_hash(name) for name in SETS}
    for name, version in committed["controllers"].items():
        assert second_sets.version_of(name) == version


def test_the_record_obeys_its_rules(committed):
    by_arm = {arm: {name: found[arm] for name, found in committed["sets"].items()} for arm in committed["controllers"]}
    assert default_by_rule(by_arm)["chosen"] == committed["default"]["chosen"] == THIRD.former
    claims = check_claims(load_claims(configs_dir() / "evaluation" / "second_claims.yaml"), by_arm)
    assert [claim.verdict for claim in claims] == [claim["verdict"] for claim in committed["claims"]]
    assert "not driven" not in {claim.verdict for claim in claims}


def test_the_page_of_results_says_what_the_record_says(committed, repository):
    assert table(committed) in (repository / "docs/results/row_turns.md").read_text()
