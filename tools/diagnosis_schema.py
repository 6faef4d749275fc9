"""``python -m tools diagnosis-schema``: the documents that follow from the types of a diagnosis."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ddagr_gym.diagnosis.result.schema import json_schema, schema_page
from tools import CHECKOUT

EXAMPLES = ("ddagr diagnosis-schema",)


@dataclass(frozen=True)
class Arguments:
    """Write docs/diagnosis.schema.json and docs/diagnosis_schema.md anew."""


def documents() -> dict[Path, str]:
    """Content of each document by its path."""
    docs = CHECKOUT / "docs"
    return {docs / "diagnosis.schema.json": json_schema(), docs / "diagnosis_schema.md": schema_page()}


def run(arguments: Arguments) -> None:
    """Write both."""
    for path, content in documents().items():
        path.write_text(content)
        print(path)
