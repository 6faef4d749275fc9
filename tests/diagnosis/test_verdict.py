"""The JSON form of a diagnosis is validated on the way out and in."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from ddagr_gym.diagnosis.verdict import DataSource, Diagnosis, Estimate, Finding, load, save
from ddagr_gym.errors import InputError

FINDING = Finding("slope", {"angle": Estimate(0.05, "rad", (0.04, 0.06))}, 30.0, 8.0, 4.0, 20.0)
GOOD = Diagnosis(
    ("slope",), True, (FINDING,), "Missing.", {"nominal": {"yaw_rate": 2.0}}, {"slope": {"angle": float("inf")}},
    {"mass": 0.0}, ("a.csv",), {"nulls": 60}, 1.0, "0",
)  # fmt: skip


def test_saved_and_loaded(tmp_path: Path) -> None:
    save(GOOD, tmp_path / "diagnosis.json")
    found = load(tmp_path / "diagnosis.json")
    assert found["verdict"] == ["slope"]
    assert found["findings"][0]["parameters"]["angle"]["interval"] == [0.04, 0.06]
    assert found["detectable"]["slope"]["angle"] is None


@pytest.mark.parametrize(
    ("change", "word"),
    [({"verdict": ("incline",)}, "incline"), ({"findings": ()}, "agree"), ({"verdict": ()}, "effects")],
)
def test_nothing_invalid_is_written(tmp_path: Path, change: dict, word: str) -> None:
    with pytest.raises(InputError, match=word):
        save(replace(GOOD, **change), tmp_path / "diagnosis.json")
    assert not any(tmp_path.iterdir())


def test_another_schema_is_refused(tmp_path: Path) -> None:
    save(GOOD, tmp_path / "d.json")
    body = json.loads((tmp_path / "d.json").read_text()) | {"schema": "ddagr-diagnosis/0"}
    (tmp_path / "d.json").write_text(json.dumps(body))
    with pytest.raises(InputError, match="schema"):
        load(tmp_path / "d.json")


def test_what_later_steps_add_is_kept(tmp_path: Path) -> None:
    source = DataSource("a.csv", "0" * 64, 1200, 23.98)
    finding = replace(FINDING, where={"phrase": "everywhere"}, calibrated_p=0.02)
    full = replace(GOOD, findings=(finding,), data=(source,), next_drive={"manoeuvre": "arcs"}, unnamed={"terms": ()})
    save(full, tmp_path / "d.json")
    found = load(tmp_path / "d.json")
    assert found["data"] == [{"source": "a.csv", "sha256": "0" * 64, "rows": 1200, "seconds": 23.98}]
    assert found["findings"][0]["where"] == {"phrase": "everywhere"}
    assert found["findings"][0]["calibrated_p"] == 0.02
    assert found["next_drive"] == {"manoeuvre": "arcs"}
    assert found["fit"] is None


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"fit": [1.0]}, "a mapping or null"),
        ({"fit": {"folds": "by recording"}}, "'note'"),
        ({"findings": (replace(FINDING, where="somewhere"),)}, "finding 'slope' has where"),
        ({"findings": (replace(FINDING, parameters={"angle": {"value": 0.1}}),)}, "angle has no entry 'unit'"),
        ({"data": (DataSource("a.csv", "0", "many", 1.0),)}, "data 1 has rows"),
    ],
)
def test_wrong_entries_are_named(tmp_path: Path, change: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        save(replace(GOOD, **change), tmp_path / "d.json")
