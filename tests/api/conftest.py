from __future__ import annotations

import pytest

import ddagr_gym


@pytest.fixture(scope="session")
def drive() -> ddagr_gym.SimulationResult:
    """A sound drive of 36 s at 50 Hz with poses."""
    return ddagr_gym.simulate("arcs", rate=50.0, pose_rate=5.0)
