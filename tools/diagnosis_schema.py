"""``python -m tools diagnosis-schema``: the documents that follow from the types of a diagnosis."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ddagr_gym.diagnosis.result.schema import json_schema, schema_page, series_json_schema, series_schema_page
from tools import CHECKOUT

EXAMPLES = ("ddagr diagnosis-schema",)


@dataclass(frozen=True)
class Arguments:
    """Write the JSON Schemas and pages of diagnosis.json and drives.json in docs anew."""


def documents() -> dict[Path, str]:
    """Content of each document by its path."""
    docs = CHECKOUT / "docs"
    return {
        docs / "diagnosis.schema.json": json_schema(),
        docs / "diagnosis_schema.md": schema_page(),
        docs / "drive_series.schema.json": series_json_schema(),
        docs / "drive_series_schema.md": series_schema_page(),
    }


def run(arguments: Arguments) -> None:
    """Write them."""
    for path, content in documents().items():
        path.write_text(content)
        print(path)
