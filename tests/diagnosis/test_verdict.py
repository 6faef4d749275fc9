"""The JSON form of a diagnosis is validated on the way out and in."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from ddagr_gym.diagnosis.verdict import Diagnosis, Estimate, Finding, load, save
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
