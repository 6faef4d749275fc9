"""Hash of the code on which thresholds and finished steps depend; docstrings, comments and prose do not count."""

from __future__ import annotations

import ast
import hashlib
import inspect
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache, partial
from pathlib import Path

from ddagr_gym.errors import InputError
from ddagr_gym.files import atomic_path
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
    "diagnosis/answer/amounts.py",
    "diagnosis/wording.py",
    "diagnosis/result/near_miss.py",
    "diagnosis/result/sentences.py",
    "diagnosis/series/sentences.py",
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


def code_digest(source: str | bytes) -> str:
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
    """Of this package; parsing takes seconds, so that the digest of the sources as they stand is remembered."""
    prose = {_PACKAGE / name for name in _PROSE}
    files = {path for folder in _FOLDERS for path in (_PACKAGE / folder).rglob("*.py")} - prose
    paths = sorted([*files, *(_PACKAGE / name for name in _FILES)])
    sources = [(path.relative_to(_PACKAGE).as_posix().encode(), path.read_bytes()) for path in paths]
    state = hashlib.sha256(sys.version.encode())
    for name, source in sources:
        state.update(b"%s %d " % (name, len(source)) + source)
    return _remembered(state.hexdigest(), partial(_digest_of, sources))


def _digest_of(sources: Sequence[tuple[bytes, bytes]]) -> str:
    digest = hashlib.sha256()
    for name, source in sources:
        digest.update(name)
        digest.update(code_digest(source).encode())
    return digest.hexdigest()


def _remembered(state: str, digest_of_it: Callable[[], str]) -> str:
    """Digest of a state of the sources, in one file of the user's cache folder for each place of this package.

    Args:
        state: hash of every byte that the digest depends on.
        digest_of_it: computes it; where the folder cannot be used, each time.
    """
    try:
        folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "ddagr-gym"
        file = folder / f"source_digest_{hashlib.sha256(str(_PACKAGE).encode()).hexdigest()[:16]}.txt"
        known = file.read_text().split() if file.is_file() else []
    except (OSError, RuntimeError, UnicodeDecodeError):
        return digest_of_it()
    if len(known) == 2 and known[0] == state:
        return known[1]
    digest = digest_of_it()
    with suppress(OSError, InputError), atomic_path(file) as part:
        part.write_text(f"{state} {digest}\n")
    return digest
