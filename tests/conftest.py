"""Fixtures and settings for all tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

REPOSITORY = Path(__file__).resolve().parents[1]

# tests/installed runs against the wheel, outside the checkout: `ddagr test` copies it away.
collect_ignore = ["installed"]

# The same examples every time: a failure here is a failure everywhere.
settings.register_profile("repeatable", derandomize=True, deadline=None, database=None)
settings.load_profile("repeatable")


@pytest.fixture(scope="session")
def repository() -> Path:
    """Root of the checkout."""
    return REPOSITORY


@pytest.fixture(scope="session")
def shared_dir() -> Path:
    """Folder with the reference data: DDAGR_SHARED, else ``shared`` beside the checkout; skips when absent."""
    folder = Path(os.environ.get("DDAGR_SHARED") or REPOSITORY.parent / "shared")
    if not (folder / "reference").is_dir():
        pytest.skip(f"reference data is not at {folder}: set DDAGR_SHARED to its folder")
    return folder
