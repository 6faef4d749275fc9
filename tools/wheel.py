"""The wheel in an environment of its own, outside the checkout: what a user of the package gets.

No network is needed after the first time: the wheels of the core dependencies are kept in ``wheels`` of the
environment that runs this, under a key over pyproject.toml and constraints.txt.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path


def install(root: Path, folder: Path) -> Path:
    """Build the wheel of the checkout ``root`` and install it in ``folder``/environment with core dependencies only.

    Returns:
        The interpreter of the new environment; it also has pytest.

    Raises:
        subprocess.CalledProcessError: a step failed; it has the step's output.
    """
    # A build removes nothing that it did not make, so it runs on a folder of its own.
    _call(root, sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder / "dist")
    (wheel,) = (folder / "dist").glob("*.whl")
    wheels = _dependencies(root, wheel)
    environment = folder / "environment"
    _call(folder, sys.executable, "-m", "venv", "--without-pip", environment)
    python = environment / "bin" / "python"
    offline = ("--no-index", "--find-links", wheels, "--no-compile", "-q")
    _call(folder, sys.executable, "-m", "pip", "--python", python, "install", *offline, wheel, "pytest")
    return python


def copy_tests(root: Path, folder: Path) -> Path:
    """Copy tests/installed into ``folder``, away from the sources, and return where it stands."""
    return Path(shutil.copytree(root / "tests" / "installed", folder / "tests", ignore=_no_caches))


def _no_caches(_: str, names: list[str]) -> list[str]:
    return [name for name in names if name == "__pycache__"]


def _dependencies(root: Path, wheel: Path) -> Path:
    """Folder with the wheels of everything that ``wheel`` needs, and of pytest; downloaded when absent."""
    constraints = root / "constraints.txt"
    key = hashlib.sha256((root / "pyproject.toml").read_bytes() + constraints.read_bytes()).hexdigest()[:16]
    store = Path(sys.prefix) / "wheels"
    complete = store / key
    if complete.is_dir():
        return complete
    shutil.rmtree(store, ignore_errors=True)
    store.mkdir()
    partial = Path(tempfile.mkdtemp(dir=store))
    words = ("download", "-q", "--only-binary", ":all:", "-d", partial, "-c", constraints, wheel, "pytest")
    _call(root, sys.executable, "-m", "pip", *words)
    (partial / wheel.name).unlink(missing_ok=True)
    partial.rename(complete)
    return complete


def _call(folder: Path, *words: object) -> None:
    environment = {**os.environ, "PIP_DISABLE_PIP_VERSION_CHECK": "1", "PIP_NO_INPUT": "1", "PIP_USER": "0"}
    command = [str(word) for word in words]
    # told where it fails only: the tests print at the same time
    pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    subprocess.run(command, cwd=folder, env=environment, check=True, text=True, **pipes)  # type: ignore[call-overload]
