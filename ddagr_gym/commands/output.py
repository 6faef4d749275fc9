"""What the commands share for writing: files that are whole or absent, output folders, tables.

Progress bars are in :mod:`ddagr_gym.progress`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import MISSING, Field, fields, is_dataclass
from typing import Any, NamedTuple

from ddagr_gym.files import (
    FOLDER_MARK,
    atomic_path,
    check_output_folder,
    make_folder,
    output_folder,
    write_bytes,
    write_json,
    write_text,
)
from ddagr_gym.reporting.text_table import format_table, format_value

__all__ = [
    "FOLDER_MARK",
    "Section",
    "atomic_path",
    "check_output_folder",
    "format_fields",
    "format_table",
    "format_value",
    "make_folder",
    "output_folder",
    "write_bytes",
    "write_json",
    "write_text",
]


class Section(NamedTuple):
    """What one step of the demonstration shows: a title, a text that is printed too, and HTML below it."""

    title: str
    text: str
    html: str


def format_fields(instance: Any) -> str:
    """A parameter dataclass as lines of name, value and unit; nested ones are indented."""
    return "\n".join(_field_lines(instance, ""))


def _field_lines(instance: Any, indent: str) -> Iterator[str]:
    width = max(len(item.name) for item in fields(instance))
    for item in fields(instance):
        value = getattr(instance, item.name)
        children = value if isinstance(value, tuple) else (value,)
        if children and is_dataclass(children[0]):
            # Equal parts (four wheels of one kind) are shown once.
            for number, child in enumerate(dict.fromkeys(children), 1):
                yield f"{indent}{item.name} {number}" if len(set(children)) > 1 else f"{indent}{item.name}"
                yield from _field_lines(child, indent + "  ")
        else:
            unit = item.metadata.get("unit", "-")
            shown = f"{format_value(value)} {unit if unit != '-' else ''}".rstrip()
            yield f"{indent}{item.name:<{width}}  {'no limit' if _is_no_limit(item, value) else shown}"


def _is_no_limit(item: Field[Any], value: object) -> bool:
    """Whether a field is at the highest number that it may have, where that is what it usually has."""
    return item.default is not MISSING and value == item.default == item.metadata.get("high")
