"""The study: its plan, its journal, its document."""

from __future__ import annotations

import json

import numpy as np
import pytest

from benchmarks.filter_study import study as filter_study
from benchmarks.filter_study.estimators import ESTIMATORS
from benchmarks.filter_study.settings import FilterStudySettings, load_filter_study
from benchmarks.filter_study.study import DRIVE, FORCE_LAWS, MATCHED, Part, run_study, study_parts
from benchmarks.filter_study.summary import interval, summarise_study
from ddagr_gym.errors import InputError

SMALL = FilterStudySettings(
    seed=3, soil_sets=("thesis_a1_range",), drives=3, radius=(0.8, 1.0), matched_drives=4, force_law_soils=1
)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    return run_study(SMALL, tmp_path_factory.mktemp("study") / "journal.jsonl")


@pytest.fixture(scope="module")
def document(results):
    return summarise_study(SMALL, results)


def test_the_shipped_plan_reads():
    plan = load_filter_study()
    assert plan.drives >= 100
    assert plan.fingerprint != SMALL.fingerprint


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"drives": 1}, "at least 2"),
        ({"soil_sets": ()}, "name at least one"),
        ({"soil_sets": ("fiel",)}, "did you mean 'field'"),
        ({"radius": (1.0, 0.8)}, "0 < low <= high"),
    ],
)
def test_bad_plans_are_refused(change, message):
    values = {name: getattr(SMALL, name) for name in SMALL.__dataclass_fields__}
    with pytest.raises(InputError, match=message):
        FilterStudySettings(**(values | change))


def test_parts_without_recordings():
    parts = study_parts(SMALL, None)
    counts = {kind: sum(part.kind == kind for part in parts) for kind in (DRIVE, MATCHED, FORCE_LAWS)}
    assert counts == {DRIVE: 3, MATCHED: 8, FORCE_LAWS: 2}
    assert len(parts) == len(set(parts)) == 13


def test_an_interrupted_study_goes_on(tmp_path, monkeypatch):
    journal, made = tmp_path / "journal.jsonl", []

    def runner(settings, part, recordings):
        made.append(part)
        if len(made) == 5:
            raise KeyboardInterrupt
        return {"number": part.number}

    monkeypatch.setattr(filter_study, "_RUNNERS", dict.fromkeys(filter_study.KINDS, runner))
    with pytest.raises(KeyboardInterrupt):
        run_study(SMALL, journal)
    with journal.open("a") as file:
        file.write('["drive", "thesis_a1')  # what a kill leaves behind
    counted = []
    results = run_study(SMALL, journal, progress=counted.append)
    assert len(results) == 13
    assert sum(counted) == 13
    assert counted[0] == 4
    assert len(made) == 5 + 9
    assert results[Part(DRIVE, "thesis_a1_range", 2)] == {"number": 2}


def test_parts_repeat_with_the_seed(results):
    part = Part(DRIVE, "thesis_a1_range", 1)
    again = filter_study._run_drive(SMALL, part, None)
    assert json.loads(json.dumps(again)) == results[part]
    assert again != results[Part(DRIVE, "thesis_a1_range", 2)]


def test_the_document_has_every_figure(document):
    text = json.dumps(document, allow_nan=False)
    assert json.loads(text)["schema"] == "ddagr-gym/filter-study"
    for estimator in ESTIMATORS:
        item = document[estimator]["thesis_a1_range"]
        assert item["drives"] == 3
        for name in ("radius_error_median", "radius_error_p95", "speed_rmse", "slip_rmse"):
            low, high = item[name]["interval"]
            assert low <= item[name]["value"] <= high
    assert set(document["filter"]["thesis_a1_range"]["nis"]) == set(document["aims"]["nis_inside_band"]["channels"])
    assert document["aims"]["radius_error_median"]["met"]
    for channel, item in document["filter"]["thesis_a1_range"]["nis"].items():
        matched = document["nis_of_matched_drives"]["soil_known_to_15_percent"][channel]
        assert item["band"] == matched["band"]
        assert item["inside"] == (item["band"][0] <= item["value"] <= item["band"][1])
        assert item["cautious"] == (item["interval"][1] < matched["mean"])
    assert document["force_laws"]["thesis_a1_range"]["drives"]["coupled"]["peak_error_x"] < 0.3
    assert document["real_drives"] == {}


def test_a_broken_down_drive_counts_as_worst(results):
    broken = dict(results)
    part = Part(DRIVE, "thesis_a1_range", 0)
    estimators = {name: dict(item) for name, item in results[part]["arms"].items()}
    estimators["filter"] |= dict.fromkeys(
        ("radius_error", "radius_error_momentary", "speed_square", "slip_square", "speed_coverage")
    )
    broken[part] = {**results[part], "arms": estimators}
    item = summarise_study(SMALL, broken)["filter"]["thesis_a1_range"]
    assert item["broke_down"] == 1
    assert item["radius_error_p95"]["value"] is None
    assert item["radius_error_median"]["value"] is not None


def test_interval_of_a_mean_covers_as_it_says():
    rng = np.random.default_rng(1)
    inside = 0
    for _ in range(200):
        low, high = interval(rng.standard_normal(60), np.mean, rng)["interval"]
        inside += low <= 0.0 <= high
    assert 0.88 <= inside / 200 <= 0.99
