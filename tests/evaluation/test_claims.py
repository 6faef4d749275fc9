"""Claims against hand-made summaries."""

from dataclasses import fields

import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.campaign import run_campaign
from ddagr_gym.evaluation.claims import Bound, Claim, Claims, check_claims, claims_table, load_claims
from ddagr_gym.evaluation.controllers import controller_names
from ddagr_gym.evaluation.scenarios import scenario_names
from ddagr_gym.evaluation.summary import summaries


def metric(value, low=None, high=None):
    return {"value": value, "interval": None if low is None else [low, high]}


SUMMARY = {
    "ppo": {"S1": {"radius_error_median": metric(0.015, 0.012, 0.021), "success_rate": metric(0.96, 0.93, 0.98)}},
    "B4": {"S1": {"radius_error_median": metric(None, 0.02, None), "success_rate": metric(0.99, 0.97, 1.0)}},
}


def verdict(claim):
    return check_claims(Claims("ppo", (claim,)), SUMMARY)[0]


@pytest.mark.parametrize(
    ("relation", "bound", "number", "expected"),
    [
        ("at most", 0.02, "value", "held"),
        ("at most", 0.02, "high", "not held"),
        ("at most", 0.015, "value", "held"),
        ("less than", 0.015, "value", "not held"),
        ("at least", 0.012, "low", "held"),
        ("more than", 0.012, "low", "not held"),
    ],
)
def test_relations_and_ends(relation, bound, number, expected):
    found = verdict(Claim("c", "headline", ("S1",), "radius_error_median", relation, bound, number))
    assert found.verdict == expected
    assert found.arm == "ppo"


def test_bound_by_another_arm():
    claim = Claim("c", "headline", ("S1",), "success_rate", "at least", Bound("B4", offset=-0.05))
    found = verdict(claim)
    assert found.bound == pytest.approx(0.94)
    assert found.verdict == "held"
    harder = Claim("c", "headline", ("S1",), "success_rate", "at least", Bound("B4", factor=0.98))
    assert verdict(harder).verdict == "not held"


def test_a_failure_is_worse_than_any_bound():
    found = verdict(Claim("c", "B4", ("S1",), "radius_error_median", "at most", 1e9))
    assert found.measured is None
    assert found.verdict == "not held"
    assert claims_table([found])[1][0][3] == "failed"


def test_what_was_not_driven_is_neither_held_nor_not():
    for claim in (
        Claim("c", "B5", ("S1",), "success_rate", "at least", 0.0),
        Claim("c", "B4", ("S2",), "success_rate", "at least", 0.0),
        Claim("c", "B4", ("S1",), "improvement_over_B1", "at least", 0.0),
        Claim("c", "B4", ("S1",), "success_rate", "at least", Bound("B9")),
    ):
        assert verdict(claim).verdict == "not driven"


def test_a_claim_is_checked_on_each_of_its_sets():
    claim = Claim("c", "B4", ("S1", "S2"), "success_rate", "at least", 0.9)
    assert [item.verdict for item in check_claims(Claims("ppo", (claim,)), SUMMARY)] == ["held", "not driven"]


def test_mistakes_are_one_sentence(tmp_path):
    with pytest.raises(InputError, match="at most"):
        Claim("c", "B4", ("S1",), "success_rate", "at mots", 0.9)
    with pytest.raises(InputError, match="low"):
        Claim("c", "B4", ("S1",), "success_rate", "at most", 0.9, "lowest")
    with pytest.raises(InputError, match="no scenario set"):
        Claim("c", "B4", (), "success_rate", "at most", 0.9)
    file = tmp_path / "claims.yaml"
    file.write_text("headline: ppo\nclaims: [{name: c, arm: B4, sets: [S1], metric: m, relation: at most}]\n")
    with pytest.raises(InputError, match="bound"):
        load_claims(file)


def test_the_project_claims_name_what_exists(tmp_path):
    claims = load_claims()
    assert len({claim.name for claim in claims.claims}) == len(claims.claims)
    rows = run_campaign(["B1", "B4"], ["S0"], tmp_path / "journal", processes=1, count=2)
    metrics = {name for sets in summaries(rows).values() for name in sets["S0"]}
    for claim in claims.claims:
        assert set(claim.sets) <= set(scenario_names()) - {"V"}
        assert claim.arm == "headline" or claim.arm in controller_names()
        assert claim.metric in metrics
        if isinstance(claim.bound, Bound):
            assert claim.bound.of in controller_names()
    # the aims on S1 stand as they were set
    aims = {(c.metric, c.number): c.bound for c in claims.claims if c.arm == "headline" and c.sets == ("S1",)}
    assert aims["radius_error_median", "value"] == 0.02
    assert aims["radius_error_p95", "value"] == 0.06
    assert aims["success_rate", "value"] == 0.98
    for baseline in ("B1", "B4"):
        assert aims[f"improvement_over_{baseline}", "value"] == 0.75
        assert aims[f"improvement_over_{baseline}", "low"] == 0.5
    assert {field.name for field in fields(Claim)} >= {"name", "arm", "sets", "metric", "relation", "bound"}
