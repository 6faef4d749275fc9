"""``import ddagr_gym`` stays light: heavy libraries are imported where they are used."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from pathlib import Path

import pytest

import ddagr_gym
from ddagr_gym import commands

HEAVY = ("torch", "matplotlib", "pyarrow", "pandas", "scipy.stats", "sklearn", "numba", "stable_baselines3")


def loaded_after(statement: str) -> set[str]:
    program = f"{statement}\nimport json, sys\nprint(json.dumps(sorted(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return set(json.loads(done.stdout.splitlines()[-1]))


@pytest.mark.parametrize(
    "statement",
    [
        "import ddagr_gym",
        "import ddagr_gym; [getattr(ddagr_gym, name) for name in ddagr_gym.__all__]",
        "import ddagr_gym.cli",
        "from ddagr_gym import commands; [commands.load(name) for name in commands.NAMES]",
        "import tools; from ddagr_gym import commands; [commands.load(name, tools) for name in tools.NAMES]",
    ],
)
def test_heavy_libraries_stay_out(statement):
    assert loaded_after(statement) & set(HEAVY) == set()


def test_the_check_sees_a_heavy_library():
    assert "numba" in loaded_after("import numba")


PUBLIC = {name for name in ddagr_gym.__all__ if name not in ("__version__", "register_environments")}


def test_a_function_is_loaded_when_it_is_asked_for():
    assert not any(name.startswith("ddagr_gym.api") for name in loaded_after("import ddagr_gym"))
    assert "ddagr_gym.api.check" in loaded_after("import ddagr_gym; ddagr_gym.check")


def test_type_checkers_and_completion_see_every_name():
    tree = ast.parse(Path(ddagr_gym.__file__).read_text())
    (block,) = [node for node in tree.body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"]
    imported = {alias.name: node.module for node in block.body for alias in node.names}
    assert imported == {name: f"ddagr_gym.api.{module}" for name, module in ddagr_gym._MODULES.items()}
    assert set(imported) == PUBLIC
    assert set(dir(ddagr_gym)) >= PUBLIC
    assert (Path(ddagr_gym.__file__).parent / "py.typed").is_file()


def test_every_public_name_has_a_docstring_and_an_unknown_one_is_an_attribute_error():
    assert all(getattr(ddagr_gym, name).__doc__ for name in PUBLIC)
    with pytest.raises(AttributeError, match="has no attribute 'diagnosed'"):
        ddagr_gym.diagnosed  # noqa: B018  (the look-up is what fails)


@pytest.mark.parametrize("name", sorted(name for name in PUBLIC if name.islower()))
def test_no_module_that_is_imported_hides_a_function(name):
    """A sub-package of a function's name would take its place as soon as it is imported."""
    folder = Path(ddagr_gym.__file__).parent
    assert not (folder / name).exists()
    assert not (folder / f"{name}.py").exists()
    if name in commands.NAMES:
        assert commands.load(name).arguments.__doc__
