"""Hash of the code on which thresholds and finished steps depend; docstrings, comments and prose do not count."""

from __future__ import annotations

import ast
import hashlib
import inspect
from functools import cache
from pathlib import Path

from ddagr_gym.physics.effects.registry import effect_kinds

_PACKAGE = Path(__file__).resolve().parents[2]
_FOLDERS = ("diagnosis", "identification", "physics", "sensors", "recordings", "control")
_FILES = (
    "simulator.py",
    "simulator_kernel.py",
    "parameters.py",
    "frames.py",
    "jit.py",
)
_PROSE = (
    "diagnosis/wording.py",
    "diagnosis/result/sentences.py",
)
"""Modules that only turn results into words, at the end and anew each time. Phrases that finished steps keep, as those
of a localisation, are not among them."""


def source_digest() -> str:
    """SHA-256 over the code of diagnosis, physics, sensors, recordings and simulator, and of effects from elsewhere."""
    digest = hashlib.sha256(_own_digest().encode())
    files = {inspect.getsourcefile(kind) for kind in effect_kinds().values()}
    for path in sorted(Path(name) for name in files if name is not None):
        if not path.resolve().is_relative_to(_PACKAGE):
            digest.update(code_digest(path.read_text()).encode())
    return digest.hexdigest()


def code_digest(source: str) -> str:
    """SHA-256 of a module's syntax tree without docstrings, the texts below constants, comments and layout.

    Args:
        source: of a Python module.
    """
    tree = ast.parse(source)
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [item for item in body if not _is_text(item)]  # type: ignore[attr-defined]
    return hashlib.sha256(ast.dump(tree).encode()).hexdigest()


def _is_text(statement: ast.AST) -> bool:
    """Whether a statement is a text that nothing reads."""
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )


@cache
def _own_digest() -> str:
    prose = {_PACKAGE / name for name in _PROSE}
    files = {path for folder in _FOLDERS for path in (_PACKAGE / folder).rglob("*.py")} - prose
    digest = hashlib.sha256()
    for path in sorted([*files, *(_PACKAGE / name for name in _FILES)]):
        digest.update(path.relative_to(_PACKAGE).as_posix().encode())
        digest.update(code_digest(path.read_text()).encode())
    return digest.hexdigest()
