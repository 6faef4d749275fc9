"""The JSON form of a diagnosis, entry by entry; ``docs/diagnosis_schema.md`` says what they mean."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from ddagr_gym.errors import InputError

SCHEMA = "ddagr-diagnosis/4"
"""Name and version: raised whenever an entry is renamed, removed or changes its meaning."""


@dataclass(frozen=True)
class Each:
    """A mapping by name, every entry of one form."""

    of: Any


@dataclass(frozen=True)
class Items:
    """A list of one form."""

    of: Any


@dataclass(frozen=True)
class Maybe:
    """A form, or null."""

    of: Any


NUMBER = (int, float)
VALUE = Maybe(NUMBER)
"""A number that may be unknown, or that was not finite."""

ESTIMATE = {"value": VALUE, "interval": Maybe(Items(VALUE))}

_PARAMETER = {"value": NUMBER, "unit": str, "interval": Maybe(Items(VALUE))}
_REGIME = {
    "name": str, "unit": str, "edges": Items(VALUE), "time_share": Items(VALUE), "weight_share": Items(VALUE),
    **dict.fromkeys(("low", "high", "excess", "weight_inside", "time_inside", "p"), VALUE),
}  # fmt: skip
_SPAN = {"recording": int, **dict.fromkeys(("start", "end", "share", "size", "deviation"), VALUE)}
_WHERE = {
    "spans": Items(_SPAN), "time_share": VALUE, "regimes": Items(_REGIME),
    "places": Items({"x": VALUE, "y": VALUE, "radius": VALUE}), "uneven": Maybe(dict), "phrase": str,
}  # fmt: skip
_FINDING = {
    "name": str, "parameters": Each(_PARAMETER), "gain": NUMBER, "gate": NUMBER, "score": NUMBER, "held_out": NUMBER,
    "channels": Each(NUMBER), "equivalence_set": Each(NUMBER), "where": Maybe(_WHERE), "calibrated_p": VALUE,
}  # fmt: skip
_MODELS = ("raw", "refitted", "corrected", "black_box", "ceiling")
_SHARES = Each(Maybe(ESTIMATE))
_FIT = {
    "folds": str, "note": str, "horizons": Items(NUMBER), "level": NUMBER,
    "channels": Each(Each({"unit": str, "count": int, **dict.fromkeys(_MODELS, ESTIMATE)})),
    "gain_share": _SHARES, "gain_share_readings": _SHARES,
    "gain": Each(Maybe(Each(Maybe(ESTIMATE)))), "gain_readings": Each(Maybe(Each(Maybe(ESTIMATE)))),
}  # fmt: skip
_WRENCH = dict.fromkeys(("before", "after", "deviation", "chi_before", "chi_after"), VALUE)
_LOCALISATION = {
    "channels": Each(dict.fromkeys(("nominal", "corrected", "floor", "share"), VALUE)),
    "explained": VALUE, "mismatch": _WHERE, "remaining": _WHERE, "findings": Each(_WHERE),
    "wrench": Items({"component": str, "unit": str, **_WRENCH}),
}  # fmt: skip
_TERM = {
    "regressor": str, "target": str, "coefficient": VALUE, "unit": str, "interval": Items(VALUE),
    "stability": VALUE, "alternatives": Items(str),
}  # fmt: skip
_UNNAMED = {
    "equation": str, "terms": Items(_TERM), "equation_share": VALUE, "ceiling_share": VALUE, "where": str,
}  # fmt: skip
_NEXT_DRIVE = {
    "manoeuvre": str, "why": str, "separates": Items(Items(str)), "power": VALUE, "minutes": VALUE,
    "alternatives": Items(dict),
}  # fmt: skip
_CHECK = {"recording": str, "channel": str, "finding": str, "sentence": str, "suspects": Items(str)}

FORM: dict[str, Any] = {
    "schema": str, "verdict": Items(str), "complete": bool, "findings": list, "sentence": str,
    "misfit": Each(Each(VALUE)), "detectable": Each(Each(VALUE)), "nuisances": Each(NUMBER),
    "recordings": Items(str), "thresholds": {"nulls": int, "bank": str, "level": NUMBER, "gates": Each(NUMBER)},
    "robot": str, "soil": str, "options": dict, "checks": Items(_CHECK), "seconds": NUMBER, "version": str,
    "fit": Maybe(_FIT), "localisation": Maybe(_LOCALISATION), "unnamed": Maybe(_UNNAMED),
    "next_drive": Maybe(_NEXT_DRIVE), "data": list, "rejected": list,
}  # fmt: skip
_DATA = {"source": str, "sha256": str, "rows": int, "seconds": NUMBER}
_WORDS = {
    str: "a text", bool: "true or false", int: "a whole number", float: "a number", list: "a list",
    dict: "a mapping", type(None): "null",
}  # fmt: skip


def check_form(mapping: Mapping[str, Any]) -> None:
    """Check a mapping against the schema; further entries are allowed.

    Raises:
        InputError: a missing or wrong entry, with the place where it is.
    """
    _check("the diagnosis", mapping, FORM)
    for finding in (*mapping["findings"], *mapping["rejected"]):
        _check(f"finding {finding.get('name')!r}", finding, _FINDING)
    for number, source in enumerate(mapping["data"]):
        _check(f"data {number + 1}", source, _DATA)


def _check(place: str, value: Any, form: Any) -> None:
    """Entries of a mapping against their forms."""
    for key, inner in form.items():
        if key not in value:
            raise InputError(f"{place} has no entry {key!r}: make it again with `ddagr diagnose`.")
        check_entry(place, key, value[key], inner)


def check_entry(place: str, key: str, value: Any, form: Any) -> None:
    """One entry against its form.

    Args:
        place: where it is, for the sentence.
        key: of the entry.
        value: of the entry.
        form: that it should have, of :data:`FORM`.

    Raises:
        InputError: it has another.
    """
    kinds = _kinds(form)
    if (isinstance(value, bool) and bool not in kinds) or not isinstance(value, kinds):
        words = " or ".join(_WORDS[kind] for kind in kinds if not (kind is int and float in kinds))
        raise InputError(f"{place} has {key} = {value!r}: give {words}.")
    for name, inner, inner_form in _inside(value, form):
        check_entry(f"{place}, {key}", name, inner, inner_form)
    required = form.of if isinstance(form, Maybe) else form
    if value is not None and isinstance(required, dict):
        _check(f"{place}, {key}", value, required)


def _kinds(form: Any) -> tuple[type, ...]:
    """Python types of a form."""
    if isinstance(form, Maybe):
        return (*_kinds(form.of), type(None))
    if isinstance(form, Each | dict):
        return (dict,)
    if isinstance(form, Items):
        return (list,)
    return form if isinstance(form, tuple) else (form,)


def _inside(value: Any, form: Any) -> Iterator[tuple[str, Any, Any]]:
    """Names, values and forms of the entries of a mapping by name or a list."""
    form = form.of if isinstance(form, Maybe) else form
    if value is not None and isinstance(form, Each):
        yield from ((str(name), item, form.of) for name, item in value.items())
    elif value is not None and isinstance(form, Items):
        yield from ((f"item {number + 1}", item, form.of) for number, item in enumerate(value))
