"""``import ddagr_gym`` stays light: heavy libraries are imported where they are used."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

HEAVY = ("torch", "matplotlib", "pyarrow", "pandas", "scipy.stats", "sklearn", "numba", "ray", "stable_baselines3")


def loaded_after(statement: str) -> set[str]:
    program = f"{statement}\nimport json, sys\nprint(json.dumps(sorted(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return set(json.loads(done.stdout.splitlines()[-1]))


@pytest.mark.parametrize(
    "statement",
    [
        "import ddagr_gym",
        "import ddagr_gym.cli",
        "from ddagr_gym import commands; [commands.load(name) for name in commands.NAMES]",
        "import tools; from ddagr_gym import commands; [commands.load(name, tools) for name in tools.NAMES]",
    ],
)
def test_heavy_libraries_stay_out(statement):
    assert loaded_after(statement) & set(HEAVY) == set()


def test_the_check_sees_a_heavy_library():
    assert "numba" in loaded_after("import numba")
