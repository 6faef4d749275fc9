"""The full evaluation's plan and record: what it must drive, what is kept, and that the README says the same."""

from __future__ import annotations

import json
import math

import pytest

pytest.importorskip("matplotlib", reason="needs the extra report")
pytest.importorskip("jinja2", reason="needs the extra report")
pytest.importorskip("pyarrow", reason="needs the extra io")

from benchmarks import row_turns
from benchmarks.scenario_sets import PLANS, draw_set
from ddagr_gym.commands.evaluate import without_stars
from ddagr_gym.evaluation import scenarios as scenario_module
from ddagr_gym.evaluation.claims import HEADLINE, check_claims, load_claims
from ddagr_gym.evaluation.controllers import BOUNDS, controller_arm, controller_version, drives_on
from ddagr_gym.evaluation.dataset import EPISODES, EpisodeDataset
from ddagr_gym.evaluation.scenarios import save_scenarios, set_hash
from ddagr_gym.evaluation.summary import BASELINES, summaries

SEEDS = 10
"""Training seeds of the headline at least (theory: control, section 5)."""


@pytest.fixture(scope="module")
def committed():
    return json.loads(row_turns.RESULT.read_text())


def planned():
    """Runs by arm and set."""
    runs = {}
    for patterns, sets in row_turns.PLAN:
        for name in without_stars(patterns):
            arm, run = controller_arm(name)
            for set_name in sets:
                if drives_on(name, PLANS[set_name].law):
                    runs.setdefault((arm, set_name), set()).add(run)
    return runs


def test_the_plan_drives_what_the_claims_are_about():
    claims, runs = load_claims(), planned()
    for claim in claims.claims:
        arm = claims.headline if claim.arm == HEADLINE else claim.arm
        for set_name in claim.sets:
            assert len(runs[arm, set_name]) >= (SEEDS if arm == claims.headline else 1)
            assert all((baseline, set_name) in runs for baseline in BASELINES)


def test_numbers_are_rounded_and_written_one_metric_a_line():
    metric = {"value": 0.0123456789, "interval": [None, math.inf]}
    kept = row_turns.rounded({"B1": {"S1": {"episodes": 200, "radius_error_median": metric}}})
    assert kept["B1"]["S1"]["radius_error_median"]["value"] == 0.012346
    content = {"_run": {"command": "x"}, **kept}
    text = row_turns.as_lines(content)
    assert json.loads(text) == content
    assert sum("radius_error_median" in line for line in text.splitlines()) == 1


def test_an_evaluation_is_driven_kept_and_not_driven_again(tmp_path, monkeypatch):
    monkeypatch.setattr(scenario_module, "scenario_folder", lambda: tmp_path / "scenarios")
    monkeypatch.setitem(PLANS, "V", PLANS["V"].__class__("two", 2, PLANS["V"].draw))
    save_scenarios("V", "two", draw_set("V"))
    monkeypatch.setattr(row_turns, "SETS", ("V",))
    monkeypatch.setattr(row_turns, "PLAN", ((("true_path", "B4"), ("V",)), (("B1",), ("V",))))
    folder = tmp_path / "evaluation"
    folder.mkdir()
    rows = row_turns.drive(folder, 1)
    assert [(row["controller"], row["number"]) for row in rows] == [
        (name, number) for name in ("B1", "B4", "true_path") for number in (0, 1)
    ]
    parts = {part: part.stat().st_mtime_ns for part in EpisodeDataset(folder / EPISODES).parts()}
    assert len(parts) == 3 + len(set(BOUNDS) - {"true_path"})
    assert row_turns.drive(folder, 1) == rows
    assert {part: part.stat().st_mtime_ns for part in EpisodeDataset(folder / EPISODES).parts()} == parts
    result, figure = tmp_path / "kept.json", tmp_path / "figure.png"
    row_turns.keep(folder, rows, "the command", ["abc"], result=result, figure=figure, films=False)
    content = json.loads(result.read_text())
    assert (content["_run"]["command"], content["_run"]["commits"]) == ("the command", ["abc"])
    assert content["_run"]["sources"]["scenarios V"] == f"sha256 {set_hash('V')[:16]}"
    assert content["B4"] == row_turns.rounded(summaries(rows))["B4"]
    assert figure.read_bytes()[:4] == b"\x89PNG"
    for name in ("report.html", "summary.json", "claims.json", "episodes.parquet"):
        assert (folder / name).is_file()
    assert "| B4 |" in row_turns.results_table(content, "V")


def test_every_commit_is_remembered_once(tmp_path, monkeypatch):
    commits = iter(["first", "second", "first"])
    monkeypatch.setattr(row_turns, "commit_of", lambda checkout: next(commits))
    found = [row_turns.remembered_commits(tmp_path) for _ in range(3)]
    assert found == [["first"], ["first", "second"], ["first", "second"]]


def test_the_record_is_of_what_ships(committed):
    """Scenarios, gains and policies of the record are those of this checkout."""
    sources = committed["_run"]["sources"]
    for name in row_turns.SETS:
        assert sources[f"scenarios {name}"] == f"sha256 {set_hash(name)[:16]}"
    headline = load_claims().headline
    seeds = [f"{headline}_seed_{k}" for k in range(committed[headline]["S1"]["runs"])]
    assert len(seeds) >= SEEDS
    versions = ", ".join(controller_version(seed)[:16] for seed in seeds)
    assert sources[f"policy {headline}"] == f"sha256 {versions}"


def test_the_record_has_the_form_of_a_summary(committed):
    for (arm, set_name), runs in planned().items():
        found = committed[arm][set_name]
        assert found["runs"] == len(runs)
        for metric in ("radius_error_median", "radius_error_p95", "success_rate"):
            value, interval = found[metric]["value"], found[metric]["interval"]
            low, high = (math.inf if end is None else end for end in interval)
            assert low <= (math.inf if value is None else value) <= high


def test_the_claims_of_the_record_are_those_of_today(committed):
    summary = {arm: sets for arm, sets in committed.items() if arm != "_run"}
    verdicts = [item["verdict"] for item in committed["_run"]["claims"]]
    assert [item.verdict for item in check_claims(load_claims(), summary)] == verdicts
    assert "not driven" not in verdicts


def test_the_page_of_results_says_what_the_record_says(committed, repository):
    assert row_turns.results_table(committed) in (repository / "docs/results/row_turns.md").read_text()
