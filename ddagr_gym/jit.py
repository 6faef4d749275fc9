"""The one way this package compiles kernels.

numba's on-disk cache notices edits of a function's own file only, not of the kernels it calls. Every kernel here
is therefore cached under a stamp over all kernel sources of the package: edit one and all recompile.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numba
from numba.core.ccallback import CFunc

_PACKAGE = Path(__file__).parent
_SHARED_SOURCES = ("jit.py", "simulator_kernel.py", "physics", "sensors")


@lru_cache
def kernel_stamp(folder: str = "") -> str:
    """Hash over every source that a compiled kernel of ``folder`` (in the package) may contain."""
    digest = hashlib.sha256(numba.__version__.encode())
    for source in (*_SHARED_SOURCES, folder):
        path = _PACKAGE / source
        for file in sorted(path.rglob("*.py")) if path.is_dir() and source else [path]:
            if file.is_file():
                digest.update(file.name.encode() + file.read_bytes())
    return digest.hexdigest()


def _stamp(compiled: Any, module: str) -> None:
    parts = module.split(".")
    folder = parts[1] if parts[0] == _PACKAGE.name and len(parts) > 2 else ""
    cache_file = getattr(getattr(compiled, "_cache", None), "_cache_file", None)
    if cache_file is not None:
        cache_file._source_stamp = (cache_file._source_stamp, kernel_stamp(folder))


def kernel(*, inline: bool = False, reassociate: bool = False) -> Callable[[Callable[..., Any]], Any]:
    """Decorator: nopython, no GIL, no divide checks, fused multiply-add, cached.

    Arithmetic is bit-reproducible on one machine: the compiled code does not depend on the batch, and NaN
    and infinity keep their meaning (no ``fastmath=True``).

    Args:
        inline: force LLVM to inline (its fast-math flags stay its own).
        reassociate: allow sums to be reordered, which vectorises reductions.
    """
    fastmath = {"contract", "reassoc", "nsz"} if reassociate else {"contract"}

    def decorate(function: Callable[..., Any]) -> Any:
        compiled = numba.njit(
            fastmath=fastmath, error_model="numpy", nogil=True, cache=True, forceinline=inline
        )(function)
        _stamp(compiled, function.__module__)
        return compiled

    return decorate


def compile_callback(function: Callable[..., None], signature: Any) -> int:
    """Compile ``function`` to machine code callable through a pointer and return its address.

    The returned address stays valid for the life of the process.
    """
    callback = CFunc(function, numba.core.sigutils.normalize_signature(signature), locals={}, options={})
    callback.enable_caching()
    _stamp(callback, function.__module__)
    callback.compile()
    _KEEP_ALIVE.append(callback)
    return int(callback.address)


_KEEP_ALIVE: list[Any] = []
