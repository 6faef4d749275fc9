"""The documents of a diagnosis follow from its types."""

import json

import pytest

from ddagr_gym.diagnosis.result.schema import answer_types, json_schema, meanings_of, schema_page
from tools.diagnosis_schema import documents


def test_the_committed_documents_are_up_to_date() -> None:
    stale = [path.name for path, content in documents().items() if path.read_text() != content]
    assert stale == [], "run `python -m tools diagnosis-schema`"


@pytest.mark.parametrize("kind", answer_types(), ids=lambda kind: kind.__name__)
def test_every_entry_has_a_meaning_of_its_own(kind: type) -> None:
    summary, meanings = meanings_of(kind)
    assert summary.endswith(".")
    assert all(meaning.endswith((".", ")", "]")) for meaning in meanings.values()), meanings


def test_the_schema_says_what_msgspec_checks() -> None:
    schema = json.loads(json_schema())
    finding = schema["$defs"]["Finding"]
    assert finding["required"] == ["name", "parameters", "gain", "gate", "score", "held_out"]
    assert finding["properties"]["gain"]["type"] == ["number", "null"]
    assert schema["$defs"]["Certificate"]["properties"]["folds"]["enum"] == ["by recording", "by time"]
    assert set(schema["$defs"]) == {kind.__name__ for kind in answer_types()}


def test_the_page_has_every_type_once() -> None:
    page = schema_page()
    for kind in answer_types():
        assert page.count(f"\n## {kind.__name__}\n") == 1
