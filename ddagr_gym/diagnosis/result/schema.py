"""The form of ``diagnosis.json`` and ``drives.json`` from the types of the answer: JSON Schemas, and pages on them."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any, get_args, get_type_hints

import msgspec

from ddagr_gym.diagnosis.answer.drive_series import SERIES_SCHEMA, DriveSeries
from ddagr_gym.diagnosis.answer.verdict import SCHEMA, Diagnosis

_HEAD = f"""# diagnosis.json

What `ddagr diagnose` writes, schema `{SCHEMA}`. SI units and radians. This page and the JSON Schema in
`diagnosis.schema.json` are made of the docstrings and types of `ddagr_gym.diagnosis.answer` by
`python -m tools diagnosis-schema`. `ddagr_gym.diagnosis.result.files` reads a file into these types and refuses one of
another form or version. null stands for what is not known, and for a number that is not finite.
"""

_TAIL = """
# effects.json, effects.yaml, robot.yaml, soil.yaml

The named effects with values, units, intervals and the hash of the data, in the form of
`ddagr_gym.physics.effects.files`. Both load in `gym.make("DDAGR-Turn-v0", effects="effects.yaml")`,
`ddagr simulate --effect effects.yaml` and `ddagr replay --effect effects.yaml`. The list is empty where nothing, or
nothing with a name, was found; scales of encoders and gains of commands that were fitted beside a drivetrain are in it
even where they are too small for a name. `robot.yaml` and `soil.yaml` are the nominal ones with the refitted
`nuisances` (biases, clocks, headings and a difference between left and right soil are not in them): together with the
effects they are the corrected simulator, `gym.make("DDAGR-Turn-v0", robot="robot.yaml", soil="soil.yaml",
effects="effects.yaml")`.
"""


_SERIES_HEAD = f"""# drives.json

What `ddagr diagnose FOLDER --calibration CAL` writes on many drives of one robot, schema `{SERIES_SCHEMA}`. SI units
and radians. This page and the JSON Schema in `drive_series.schema.json` are made as that of
[diagnosis.json](diagnosis_schema.md); `ddagr_gym.diagnosis.series.files` reads the file. null stands for what is not
known, and for a number that is not finite.
"""


def json_schema() -> str:
    """JSON Schema of ``diagnosis.json``, with the docstrings' meanings."""
    return _json_schema(Diagnosis, SCHEMA)


def series_json_schema() -> str:
    """The same of ``drives.json``."""
    return _json_schema(DriveSeries, SERIES_SCHEMA)


def _json_schema(whole_kind: type[Any], title: str) -> str:
    (found,), parts = msgspec.json.schema_components([whole_kind], ref_template="#/$defs/{name}")
    kinds = {kind.__name__: kind for kind in answer_types(whole_kind)}
    for name, part in parts.items():
        summary, meanings = meanings_of(kinds[name])
        part["description"] = summary
        for entry, meaning in part["properties"].items():
            meaning["description"] = meanings[entry]
    whole = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": title, **found, "$defs": parts}
    return json.dumps(_with_null(whole), indent=1, ensure_ascii=False) + "\n"


def _with_null(part: Any) -> Any:
    """The same with null for numbers too, which stands for what is not finite."""
    if isinstance(part, dict):
        inner = {key: _with_null(item) for key, item in part.items()}
        return inner | {"type": ["number", "null"]} if inner.get("type") == "number" else inner
    return [_with_null(item) for item in part] if isinstance(part, list) else part


def schema_page() -> str:
    """Page that says what the entries mean, one table per type, the whole answer first."""
    return _HEAD + "".join(_table(kind) for kind in answer_types()) + _TAIL


def series_schema_page() -> str:
    """The same of ``drives.json``."""
    return _SERIES_HEAD + "".join(_table(kind) for kind in answer_types(DriveSeries))


def _table(kind: type[Any]) -> str:
    summary, meanings = meanings_of(kind)
    rows = "".join(f"| `{name}` | {meaning} |\n" for name, meaning in meanings.items())
    return f"\n## {kind.__name__}\n\n{summary}\n\n| entry | content |\n|---|---|\n{rows}"


def answer_types(whole: type[Any] = Diagnosis) -> tuple[type[Any], ...]:
    """An answer and the types that it is made of, in the order in which its entries name them."""
    return tuple(dict.fromkeys(_types(whole)))


def _types(kind: type[Any]) -> Iterator[type[Any]]:
    yield kind
    for hint in get_type_hints(kind).values():
        for inner in _dataclasses_in(hint):
            yield from _types(inner)


def _dataclasses_in(hint: Any) -> Iterator[type[Any]]:
    if isinstance(hint, type) and is_dataclass(hint):
        yield hint
    for argument in get_args(hint):
        yield from _dataclasses_in(argument)


def meanings_of(kind: type[Any]) -> tuple[str, dict[str, str]]:
    """Text above the attributes of a type's docstring, and the meaning of each of its entries.

    Raises:
        KeyError: the docstring leaves an entry out.
    """
    found: dict[str, str] = {}
    for owner in reversed(kind.__mro__[:-1]):
        above, _, attributes = (inspect.getdoc(owner) or "").partition("\nAttributes:\n")
        for name, meaning in re.findall(r"^    (\w+): (.*(?:\n        .*)*)", attributes, flags=re.MULTILINE):
            found[name] = " ".join(meaning.split())
    summary = "\n\n".join(" ".join(paragraph.split()) for paragraph in above.strip().split("\n\n"))
    return summary, {item.name: found[item.name] for item in fields(kind)}
