"""A diagnosis is validated on the way out and in, and files of before are read."""

import gzip
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from ddagr_gym.diagnosis.answer.certificate import Measured
from ddagr_gym.diagnosis.answer.location import EffectLocation
from ddagr_gym.diagnosis.answer.next_drive_plan import NextDrivePlan
from ddagr_gym.diagnosis.answer.unnamed_terms import UnnamedTerms
from ddagr_gym.diagnosis.answer.verdict import (
    DataDoubt,
    DataSource,
    Diagnosis,
    Estimate,
    Finding,
    GatesUsed,
    Options,
)
from ddagr_gym.diagnosis.result.files import as_mapping, load, save, validate
from ddagr_gym.errors import InputError

BEFORE = Path(__file__).parents[2] / "golden" / "diagnosis" / "diagnosis_4.json.gz"
"""Of three simulated drives, by the code from before the answer had types."""

FINDING = Finding("slope", {"angle": Estimate(0.05, "rad", (0.04, 0.06))}, 30.0, 8.0, 4.0, 20.0)
GOOD = Diagnosis(
    ("slope",), True, (FINDING,), "Missing.", {"nominal": {"yaw_rate": 2.0}}, {"slope": {"angle": math.inf}},
    {"mass": 0.0}, ("a.csv",), GatesUsed(nulls=60, bank="f", level=0.05, gates={"slope": 8.0}), 1.0, "0",
)  # fmt: skip

WHERE = EffectLocation((), 1.0, (), (), None, "everywhere")
NEXT = NextDrivePlan("arcs", "It turns.", (("slope", "imu_tilt"),), 0.1, None)
UNNAMED = UnnamedTerms("", (), 0.0, 0.2, "everywhere")


def entries(**changes: Any) -> dict[str, Any]:
    """The good one as it stands in its file, with some entries changed."""
    return as_mapping(GOOD) | changes


def test_saved_and_loaded(tmp_path: Path) -> None:
    save(GOOD, tmp_path / "diagnosis.json")
    found = load(tmp_path / "diagnosis.json")
    assert found == replace(GOOD, detectable={"slope": {"angle": None}})


@pytest.fixture(scope="module")
def before(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("before") / "diagnosis.json"
    path.write_bytes(gzip.decompress(BEFORE.read_bytes()))
    return path


def test_a_file_of_before_is_written_again_bit_for_bit(before: Path, tmp_path: Path) -> None:
    found = load(before)
    save(found, tmp_path / "again.json")
    assert (tmp_path / "again.json").read_bytes() == before.read_bytes()


def test_a_file_of_before_has_its_types(before: Path) -> None:
    found = load(before)
    body = json.loads(before.read_text())
    assert found.fit is not None
    assert found.localisation is not None
    assert found.next_drive is not None
    assert found.fit.channels["yaw_rate"]["5"].corrected == Measured(
        body["fit"]["channels"]["yaw_rate"]["5"]["corrected"]["value"],
        tuple(body["fit"]["channels"]["yaw_rate"]["5"]["corrected"]["interval"]),
    )
    place = found.findings[0].where
    assert place is not None
    assert place.regimes[0].stands_out == (body["findings"][0]["where"]["regimes"][0]["p"] < 0.05)
    assert found.thresholds.kind == "simulated"
    assert found.options.seed == 0


def test_a_number_that_is_not_finite_is_null_in_the_file_and_not_a_number_in_the_answer(tmp_path: Path) -> None:
    odd = replace(GOOD, misfit={"nominal": {"yaw_rate": math.nan}}, next_drive=replace(NEXT, power=math.inf))
    save(odd, tmp_path / "d.json")
    assert json.loads((tmp_path / "d.json").read_text())["next_drive"]["power"] is None
    found = load(tmp_path / "d.json")
    assert found.next_drive is not None
    assert math.isnan(found.misfit["nominal"]["yaw_rate"])
    assert math.isnan(found.next_drive.power)
    assert found.next_drive.minutes is None


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
    [
        ({"verdict": ("incline",)}, "incline"),
        ({"findings": ()}, "agree"),
        ({"verdict": ()}, "effects"),
        ({"robot": 3}, "robot: expected `str`, got `int`"),
    ],
)
def test_nothing_invalid_is_written(tmp_path: Path, change: dict[str, Any], word: str) -> None:
    with pytest.raises(InputError, match=word):
        save(replace(GOOD, **change), tmp_path / "diagnosis.json")
    assert not any(tmp_path.iterdir())


def test_another_schema_is_refused() -> None:
    with pytest.raises(InputError, match="schema 'ddagr-diagnosis/0'"):
        validate(entries(schema="ddagr-diagnosis/0"))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"schema": "ddagr-diagnosis/0"}, "d.json has schema 'ddagr-diagnosis/0' .*: make it again with `ddagr diag"),
        ({"robot": 3}, "d.json is wrong at robot: .*: make it again with `ddagr diagnose`"),
        ({"verdict": ["incline"]}, r"d.json has the verdict \['incline'\]: give names of effects"),
        ({"findings": []}, r"d.json names \['slope'\] and has findings on \[\]: make them agree"),
    ],
)
def test_a_wrong_file_is_named(tmp_path: Path, change: dict[str, Any], words: str) -> None:
    (tmp_path / "d.json").write_text(json.dumps(entries(detectable={}, **change)))
    with pytest.raises(InputError, match=words):
        load(tmp_path / "d.json")


def test_what_later_steps_add_is_kept(tmp_path: Path) -> None:
    full = replace(
        GOOD,
        findings=(replace(FINDING, where=WHERE, calibrated_p=0.02),),
        data=(DataSource("a.csv", "0" * 64, 1200, 23.98),),
        next_drive=NEXT,
        unnamed=UNNAMED,
        robot="warthog",
        soil="sandy_loam",
        checks=(DataDoubt("a.csv", "yaw_rate", "stuck", "It never changes.", ("sensor_hold",)),),
        options=Options(seed=3),
        detectable={},
    )
    save(full, tmp_path / "d.json")
    assert load(tmp_path / "d.json") == full
    body = json.loads((tmp_path / "d.json").read_text())
    assert body["options"] == {"seed": 3}
    assert body["fit"] is None
    assert "kind" not in body["thresholds"]


def test_entries_of_a_later_version_are_passed_over() -> None:
    assert validate(entries(weather="dry", detectable={})) == replace(GOOD, detectable={})


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"fit": [1.0]}, "fit: expected `object . null`, got `array`"),
        ({"fit": {"folds": "by recording"}}, "fit: object missing required field `note`"),
        ({"findings": [{**entries()["findings"][0], "where": "here"}]}, r"findings\[0\]\.where: expected"),
        (
            {"data": [{"source": "a", "sha256": "0", "rows": "many", "seconds": 1.0}]},
            r"data\[0\]\.rows: expected `int`",
        ),
        ({"next_drive": {"manoeuvre": "arcs"}}, "next_drive: object missing required field `why`"),
        ({"detectable": {"slope": {"angle": "small"}}}, "expected `float . null`, got `str`"),
        ({"detectable": {"slope": {"angle": True}}}, "expected `float . null`, got `bool`"),
        ({"thresholds": {"nulls": 60}}, "thresholds: object missing required field `bank`"),
        ({"localisation": {"channels": {}}}, "localisation: object missing required field `explained`"),
    ],
)
def test_wrong_entries_are_named_in_one_sentence(change: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        validate(entries(**change))
    assert str(caught.value).endswith(": make it again with `ddagr diagnose`.")
    assert "\n" not in str(caught.value)
