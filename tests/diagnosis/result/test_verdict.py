"""The JSON form of a diagnosis is validated on the way out and in."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from ddagr_gym.diagnosis.preprocessing.data_checks import DataDoubt
from ddagr_gym.diagnosis.result.verdict import DataSource, Diagnosis, Estimate, Finding, load, save
from ddagr_gym.errors import InputError

FINDING = Finding("slope", {"angle": Estimate(0.05, "rad", (0.04, 0.06))}, 30.0, 8.0, 4.0, 20.0)
GOOD = Diagnosis(
    ("slope",), True, (FINDING,), "Missing.", {"nominal": {"yaw_rate": 2.0}}, {"slope": {"angle": float("inf")}},
    {"mass": 0.0}, ("a.csv",), {"nulls": 60, "bank": "f", "level": 0.05, "gates": {"slope": 8.0}}, 1.0, "0",
)  # fmt: skip

WHERE = {"spans": [], "time_share": 1.0, "regimes": [], "places": [], "uneven": None, "phrase": "everywhere"}
NEXT = {"manoeuvre": "arcs", "why": "It turns.", "separates": [], "power": 0.1, "minutes": None, "alternatives": []}
UNNAMED = {"equation": "", "terms": [], "equation_share": 0.0, "ceiling_share": 0.2, "where": "everywhere"}


def test_saved_and_loaded(tmp_path: Path) -> None:
    save(GOOD, tmp_path / "diagnosis.json")
    found = load(tmp_path / "diagnosis.json")
    assert found["verdict"] == ["slope"]
    assert found["findings"][0]["parameters"]["angle"]["interval"] == [0.04, 0.06]
    assert found["detectable"]["slope"]["angle"] is None


def test_saving_takes_no_other_file_for_its_own(tmp_path: Path) -> None:
    (tmp_path / ".d.json.part").write_text("of another process")
    save(GOOD, tmp_path / "d.json")
    assert sorted(path.name for path in tmp_path.iterdir()) == [".d.json.part", "d.json"]


@pytest.mark.parametrize("content", [b"\x89PNG\r\n\xff\xfe", b"{", b"[]"])
def test_other_files_are_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "d.json").write_bytes(content)
    with pytest.raises(InputError, match=r"d\.json .*: make it with `ddagr diagnose`"):
        load(tmp_path / "d.json")


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
    finding = replace(FINDING, where=WHERE, calibrated_p=0.02)
    doubt = DataDoubt("a.csv", "yaw_rate", "stuck", "It never changes.", ("sensor_hold",))
    full = replace(
        GOOD, findings=(finding,), data=(source,), next_drive=NEXT, unnamed=UNNAMED, robot="warthog", soil="sandy_loam",
        checks=(doubt,), options={"seed": 3},
    )  # fmt: skip
    save(full, tmp_path / "d.json")
    found = load(tmp_path / "d.json")
    assert found["data"] == [{"source": "a.csv", "sha256": "0" * 64, "rows": 1200, "seconds": 23.98}]
    assert found["findings"][0]["where"] == WHERE
    assert found["findings"][0]["calibrated_p"] == 0.02
    assert found["next_drive"] == NEXT
    assert (found["robot"], found["soil"], found["options"]) == ("warthog", "sandy_loam", {"seed": 3})
    assert found["checks"][0]["suspects"] == ["sensor_hold"]
    assert found["fit"] is None


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"fit": [1.0]}, "a mapping or null"),
        ({"fit": {"folds": "by recording"}}, "'note'"),
        ({"findings": (replace(FINDING, where="somewhere"),)}, "finding 'slope' has where"),
        ({"findings": (replace(FINDING, parameters={"angle": {"value": 0.1}}),)}, "angle has no entry 'unit'"),
        ({"data": (DataSource("a.csv", "0", "many", 1.0),)}, "data 1 has rows"),
        ({"next_drive": {"manoeuvre": "arcs"}}, "next_drive has no entry 'why'"),
        ({"unnamed": UNNAMED | {"terms": [{"regressor": "v"}]}}, "unnamed, terms, item 1 has no entry 'target'"),
        ({"detectable": {"slope": {"angle": "small"}}}, "detectable, slope has angle = 'small'"),
        ({"detectable": {"slope": {"angle": True}}}, "angle = True: give a number or null"),
        ({"thresholds": {"nulls": 60}}, "thresholds has no entry 'bank'"),
        ({"localisation": {"channels": {}}}, "localisation has no entry 'explained'"),
    ],
)
def test_wrong_entries_are_named(tmp_path: Path, change: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        save(replace(GOOD, **change), tmp_path / "d.json")
