"""Simulated drives of a robot that is not as its data sheet says, on two grounds."""

from __future__ import annotations

import pytest

from benchmarks.simulated_robots import CASES, case_drives
from ddagr_gym.recordings.schema import Recording


@pytest.fixture(scope="session")
def drives() -> list[Recording]:
    """Two drives on the field and one on the track."""
    return case_drives(CASES["slower motors, late"])
