"""A diagnosis as ``diagnosis.json``: written and read by its types, the one place where it is no object."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import Any

import msgspec
from msgspec import inspect

from ddagr_gym.diagnosis.answer.channel_faults import CHANNEL_FAULT_TITLES
from ddagr_gym.diagnosis.answer.drivetrain import PART_TITLES
from ddagr_gym.diagnosis.answer.verdict import NONE, SCHEMA, UNKNOWN, Diagnosis
from ddagr_gym.errors import InputError
from ddagr_gym.files import atomic_path, read_json

_ABSENT_WHERE_UNKNOWN = ("options", "thresholds")
"""Entries whose own entries are left out instead of null."""


_ABSENT_WHERE_NOT_ASKED = ("drivetrain", "change", "nuisance_spread", "incomplete_for")
"""Entries that are left out instead of null or empty: files of before have none."""


_FINDINGS = ("findings", "rejected")
"""Lists of findings."""

_ABSENT_IN_FINDINGS = ("onset", "soil")
"""Entries of findings that are left out instead of null for the same reason."""


def as_mapping(diagnosis: Diagnosis) -> dict[str, Any]:
    """Plain mapping as it stands in ``diagnosis.json``; null stands for numbers that are not finite."""
    mapping = plain(diagnosis)
    for name in _ABSENT_WHERE_UNKNOWN:
        mapping[name] = {key: value for key, value in mapping[name].items() if value is not None}
    for name in _FINDINGS:
        mapping[name] = [_without_null(item) for item in mapping[name]]
    return {
        name: value for name, value in mapping.items() if value not in (None, []) or name not in _ABSENT_WHERE_NOT_ASKED
    }


def _without_null(finding: Mapping[str, Any]) -> dict[str, Any]:
    """A finding without those entries that are null."""
    return {key: value for key, value in finding.items() if value is not None or key not in _ABSENT_IN_FINDINGS}


def plain(value: Any) -> dict[str, Any]:
    """Frozen dataclass of a diagnosis as JSON knows it: mappings, lists, texts and finite numbers."""
    mapping: dict[str, Any] = json.loads(json.dumps(finite_or_null(asdict(value))))
    return mapping


def finite_or_null(value: Any) -> Any:
    """Infinite and undefined numbers as None, which JSON can hold."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): finite_or_null(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite_or_null(item) for item in value]
    return value


def validate(mapping: Mapping[str, Any], source: str = "the diagnosis") -> Diagnosis:
    """Check a mapping as it stands in ``diagnosis.json`` and read it; further entries are allowed.

    Args:
        mapping: to be read.
        source: what holds it, for messages: the path of its file.

    Raises:
        InputError: another schema, a missing or wrong entry, names that no library has.
    """
    if mapping.get("schema") != SCHEMA:
        schema = mapping.get("schema")
        raise InputError(f"{source} has schema {schema!r} instead of {SCHEMA!r}: make it again with `ddagr diagnose`.")
    try:
        diagnosis = msgspec.convert(with_nan(mapping, _form()), Diagnosis)
    except msgspec.ValidationError as error:
        raise InputError(f"{source} {_sentence(str(error))}: make it again with `ddagr diagnose`.") from None
    _check_names(diagnosis, source)
    return diagnosis


@cache
def _form() -> inspect.Type:
    return inspect.type_info(Diagnosis)


def with_nan(value: Any, form: inspect.Type) -> Any:
    """The same with NaN for null where a number is asked for: JSON has no other word for what is not finite."""
    if isinstance(form, inspect.UnionType):
        inner = [item for item in form.types if not isinstance(item, inspect.NoneType)]
        return value if value is None or len(inner) != 1 else with_nan(value, inner[0])
    if value is None:
        return math.nan if isinstance(form, inspect.FloatType) else None
    if isinstance(form, inspect.DataclassType) and isinstance(value, Mapping):
        forms = {item.encode_name: item.type for item in form.fields}
        return {key: with_nan(item, forms[key]) if key in forms else item for key, item in value.items()}
    if isinstance(form, inspect.DictType) and isinstance(value, Mapping):
        return {key: with_nan(item, form.value_type) for key, item in value.items()}
    if isinstance(form, inspect.VarTupleType) and isinstance(value, list | tuple):
        return [with_nan(item, form.item_type) for item in value]
    if isinstance(form, inspect.TupleType) and isinstance(value, list | tuple) and len(value) == len(form.item_types):
        return [with_nan(item, kind) for item, kind in zip(value, form.item_types, strict=True)]
    return value


def _sentence(message: str) -> str:
    """What msgspec says ("Expected `str`, got `int` - at `$.robot`") with the place first."""
    what, _, place = message.partition(" - at ")
    where = place.strip("`").removeprefix("$").removeprefix(".")
    what = what[:1].lower() + what[1:]
    return f"is wrong at {where}: {what}" if where else f"is wrong: {what}"


def _check_names(diagnosis: Diagnosis, source: str) -> None:
    """Names that exist, and findings on all of them."""
    from ddagr_gym.physics.effects.registry import effect_kinds

    known = {NONE, UNKNOWN, *effect_kinds(), *PART_TITLES, *CHANNEL_FAULT_TITLES}
    verdict = list(diagnosis.verdict)
    if not verdict or not known.issuperset(verdict):
        raise InputError(
            f"{source} has the verdict {verdict!r}: give names of effects, of parts of the drivetrain or of "
            f"faults of channels ({', '.join(CHANNEL_FAULT_TITLES)}), none or unknown."
        )
    named = [finding.name for finding in diagnosis.findings]
    if sorted(named) != sorted(name for name in verdict if name not in (NONE, UNKNOWN)):
        raise InputError(f"{source} names {verdict!r} and has findings on {named!r}: make them agree.")


def save(diagnosis: Diagnosis, path: Path) -> None:
    """Write ``diagnosis.json``, all or nothing, after validation.

    Raises:
        InputError: an entry is wrong.
    """
    mapping = as_mapping(diagnosis)
    validate(mapping)
    with atomic_path(path) as part:
        part.write_text(json.dumps(mapping, indent=1, allow_nan=False) + "\n")


def load(path: Path) -> Diagnosis:
    """Read and validate a ``diagnosis.json``.

    Raises:
        InputError: no such file, no JSON, or not of this schema.
    """
    mapping = read_json(path, "cannot be read as a diagnosis", "make it with `ddagr diagnose`")
    if not isinstance(mapping, dict):
        raise InputError(f"{path} holds no mapping: make it with `ddagr diagnose`.")
    return validate(mapping, str(path))
