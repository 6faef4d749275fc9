"""What the physics tests share: the thesis's wheel and soil, and the independent reference of tests/golden."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

from ddagr_gym.parameters import Soil, TorusWheel
from ddagr_gym.presets import get_robot, get_soil

GOLDEN = Path(__file__).resolve().parents[1] / "golden"


@pytest.fixture(scope="session")
def golden() -> Path:
    """Folder of the golden files."""
    return GOLDEN


@pytest.fixture(scope="session")
def reference() -> ModuleType:
    """The vector-form reference that wrote ``tests/golden/wheel_forces.csv``."""
    name = "ddagr_golden_wheel_reference"
    if name not in sys.modules:
        specification = importlib.util.spec_from_file_location(name, GOLDEN / "wheel_reference.py")
        module = importlib.util.module_from_spec(specification)
        sys.modules[name] = module
        specification.loader.exec_module(module)
    return sys.modules[name]


@pytest.fixture(scope="session")
def wheel() -> TorusWheel:
    """The DDAGR's tyre."""
    return get_robot("ddagr").wheels[0]


@pytest.fixture(scope="session")
def soil() -> Soil:
    """Table A.1."""
    return get_soil("thesis_a1")
