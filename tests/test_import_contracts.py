"""Import direction: the contracts of pyproject.toml hold, and would notice if they did not."""

from __future__ import annotations

import ast
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = """
import sys
from importlinter.cli import lint_imports

sys.path.insert(0, ".")
sys.exit(lint_imports(no_cache=True, no_logo=True))
"""
FORBIDDEN_TO_THE_GENERATOR = ("ddagr_gym.diagnosis", "ddagr_gym.physics.effects")


def lint_imports(folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-P", "-c", PROGRAM], cwd=folder, capture_output=True, text=True)


@pytest.fixture
def package_copy(repository, tmp_path) -> Path:
    """The package's sources and contracts in a folder where they may be broken."""
    shutil.copy(repository / "pyproject.toml", tmp_path)
    ignore = shutil.ignore_patterns("__pycache__")
    shutil.copytree(repository / "ddagr_gym", tmp_path / "ddagr_gym", ignore=ignore)
    return tmp_path


def test_contracts_hold(repository):
    done = lint_imports(repository)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(
    ("module", "line", "complaint"),
    [
        ("parameters.py", "import ddagr_gym.config", "ddagr_gym.parameters->ddagr_gym.config"),
        ("physics/broken.py", "import ddagr_gym.sensors", "ddagr_gym.physics.broken->ddagr_gym.sensors"),
        ("sensors/broken.py", "import gymnasium", "ddagr_gym.sensors.broken->gymnasium"),
        ("physics/broken.py", "def f():\n    import torch", "ddagr_gym.physics.broken->torch"),
        ("control/broken.py", "from matplotlib import pyplot", "ddagr_gym.control.broken->matplotlib"),
        ("estimation/broken.py", "import ddagr_gym.physics", "ddagr_gym.estimation.broken->ddagr_gym.physics"),
        ("recordings/broken.py", "import stable_baselines3", "ddagr_gym.recordings.broken->stable_baselines3"),
        ("diagnosis/broken.py", "import gymnasium", "ddagr_gym.diagnosis.broken->gymnasium"),
        ("diagnosis/broken.py", "import ddagr_gym.envs", "ddagr_gym.diagnosisisnotallowedtoimportddagr_gym.envs"),
        ("unknown_layer.py", "", "-ddagr_gym.unknown_layer"),
        (
            "diagnosis/search/scan.py",
            "import ddagr_gym.diagnosis.planning",
            "ddagr_gym.diagnosis.search.scan->ddagr_gym.diagnosis.planning",
        ),
        (
            "identification/windows.py",
            "import ddagr_gym.identification.gauss_newton",
            "ddagr_gym.identification.windows->ddagr_gym.identification.gauss_newton",
        ),
        (
            "rendering/palette.py",
            "import ddagr_gym.rendering.ruts",
            "ddagr_gym.rendering.palette->ddagr_gym.rendering.ruts",
        ),
    ],
)
def test_contracts_notice(package_copy, module, line, complaint):
    file = package_copy / "ddagr_gym" / module
    for folder in (file.parent, package_copy / "ddagr_gym" / "envs"):
        folder.mkdir(exist_ok=True)
        (folder / "__init__.py").touch()
    file.write_text((file.read_text() if file.exists() else "") + f"\n{line}\n")
    done = lint_imports(package_copy)
    assert done.returncode == 1
    assert complaint in "".join(done.stdout.split())


def imported_modules(source: str, package: str) -> set[str]:
    """Full names of everything that ``source``, a module in ``package``, imports anywhere in its text."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            parts = package.split(".")[: -node.level + 1 or None] if node.level else []
            base = ".".join([*parts, *([node.module] if node.module else [])])
            names |= {base} | {f"{base}.{alias.name}" for alias in node.names}
    return names


def is_shared_code(name: str) -> bool:
    return any(name == module or name.startswith(f"{module}.") for module in FORBIDDEN_TO_THE_GENERATOR)


def test_generator_of_concealed_effects_shares_no_code_with_what_it_judges(repository):
    folder = repository / "benchmarks" / "concealed"
    if not folder.is_dir():
        pytest.skip("benchmarks/concealed does not exist yet")
    files = sorted(folder.rglob("*.py"))
    assert files
    for file in files:
        shared = {name for name in imported_modules(file.read_text(), "benchmarks.concealed") if is_shared_code(name)}
        assert shared == set(), file


@pytest.mark.parametrize(
    "source",
    [
        "import ddagr_gym.diagnosis.windows",
        "from ddagr_gym import diagnosis",
        "def f():\n    from ddagr_gym.physics import effects",
        "from ddagr_gym.physics.effects.drag import towed_drag",
    ],
)
def test_shared_code_would_be_seen(source):
    assert any(is_shared_code(name) for name in imported_modules(source, "benchmarks.concealed"))
    assert not any(is_shared_code(name) for name in imported_modules("from ddagr_gym.physics import wheel_force", "b"))
