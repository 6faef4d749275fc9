"""Compiled kernels whose cache on disk is dropped whenever any kernel source changes.

numba keys a cached kernel on the file that defines it and does not notice a change in a kernel it calls.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import njit

FOLDER = Path(__file__).resolve().parent
KERNEL_FILES = (
    "jit.py", "soil.py", "wheel.py", "externals.py", "ground.py", "plant.py", "mechanics.py", "drive.py",
    "terrain_memory.py", "motors.py",
)  # fmt: skip


def source_digest(names: tuple[str, ...] = KERNEL_FILES) -> str:
    """SHA-256 over the named source files of this folder."""
    digest = hashlib.sha256()
    for name in names:
        digest.update(name.encode() + b"\0" + (FOLDER / name).read_bytes() + b"\0")
    return digest.hexdigest()


def _drop_stale_cache() -> None:
    cache = FOLDER / "__pycache__"
    stamp = cache / "kernels.stamp"
    digest = source_digest()
    if stamp.exists() and stamp.read_text() == digest:
        return
    cache.mkdir(exist_ok=True)
    for compiled in (*cache.glob("*.nbi"), *cache.glob("*.nbc")):
        compiled.unlink(missing_ok=True)
    stamp.write_text(digest)


_drop_stale_cache()


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile ``function`` without fast-math, so that the same seed gives the same bytes."""
    return njit(cache=True, error_model="numpy", nogil=True)(function)
