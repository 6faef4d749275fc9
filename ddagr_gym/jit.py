"""The one way this package compiles kernels.

numba's on-disk cache notices edits of a function's own file only, not of the kernels it calls. Every kernel here
is therefore cached under a stamp over all kernel sources of the package: edit one and all recompile.

A compiled kernel holds copies of the kernels that it calls, optimised in their place. numba shares such copies: of two
with one name a process runs the one that it met first. A process that compiles meets the kernel alone before its copy
in a larger one, a process that loads what was compiled does not, and with fused multiply-adds their last bits differ.
Here every kernel keeps its own copies, so that the same seed gives the same bits in the first process as in all others.
"""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numba
from llvmlite import ir
from llvmlite.binding import Linkage
from numba import types
from numba.core import cgutils
from numba.core.caching import IndexDataCacheFile
from numba.core.ccallback import CFunc
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.registry import CPUDispatcher
from numba.extending import intrinsic as numba_intrinsic
from numba.np.arrayobj import populate_array

_PACKAGE = Path(__file__).parent
_SHARED_SOURCES = ("jit.py", "simulator_kernel.py", "physics", "sensors")
_CALLED_BY_POINTER = _PACKAGE / "physics" / "effects"
"""Code that kernels call through pointers only: it is in no kernel, so its edits recompile nothing but itself."""


# numba's stub counts the typing context among the arguments of a call; no call gives it.
intrinsic: Callable[[Callable[..., Any]], Any] = numba_intrinsic


@lru_cache
def kernel_stamp(folder: str = "") -> str:
    """Hash over every source that a compiled kernel of ``folder`` (in the package) may contain."""
    digest = hashlib.sha256(numba.__version__.encode())
    for source in (*_SHARED_SOURCES, folder):
        path = _PACKAGE / source
        for file in sorted(path.rglob("*.py")) if path.is_dir() and source else [path]:
            if file.is_file() and _CALLED_BY_POINTER not in file.parents:
                digest.update(file.name.encode() + file.read_bytes())
    return digest.hexdigest()


@lru_cache
def _folder_stamp(folder: Path) -> str:
    digest = hashlib.sha256(kernel_stamp().encode())
    for file in sorted(folder.glob("*.py")):
        digest.update(file.name.encode() + file.read_bytes())
    return digest.hexdigest()


def callback_stamp(function: Callable[..., Any]) -> str | None:
    """Hash over the kernels' sources and those beside ``function``.

    None for a function without a file, and for one made inside another, whose captured values its text does not show.
    """
    if "<locals>" in function.__qualname__:
        return None
    try:
        file = Path(inspect.getfile(function))
    except TypeError:
        return None
    return _folder_stamp(file.parent) if file.is_file() else None


class _CacheFile(IndexDataCacheFile):
    """Machine code on disk, a file for each state of the sources and each signature.

    numba's own index is written before the file that it points to: of two processes that compile at the same time
    after an edit or an upgrade, one may read the new index and run the old code.
    """

    def save(self, key: Any, data: Any) -> None:
        """Keep what was compiled for a signature."""
        self._save_data(self._name(key), data)

    def load(self, key: Any) -> Any:
        """What was compiled for a signature, None where nothing was."""
        try:
            return self._load_data(self._name(key))
        except OSError:
            return None

    def _name(self, key: Any) -> str:
        state = repr((self._version, self._source_stamp, key))
        return f"{self._index_name.removesuffix('.nbi')}.{hashlib.sha256(state.encode()).hexdigest()[:16]}.nbc"


def _keep_apart(cache: Any, stamp: str) -> None:
    """Let a numba cache know the sources of all that its function may contain."""
    numbered = cache._cache_file
    name = numbered._index_name.removesuffix(".nbi")
    cache._cache_file = _CacheFile(numbered._cache_path, name, (numbered._source_stamp, stamp))


def _stamp(module: str) -> str:
    """Hash over the sources of kernels of a module."""
    parts = module.split(".")
    return kernel_stamp(parts[1] if parts[0] == _PACKAGE.name and len(parts) > 2 else "")


class _OwnCopies(JITCodeLibrary):
    """Machine code of a kernel that runs its own copies of what it calls; other kernels still inline from it."""

    def _finalize_final_module(self) -> None:
        self._shared_module = self._final_module.clone()
        for function in self._shared_module.functions:
            if not function.is_declaration and function.linkage == Linkage.external:
                function.linkage = Linkage.linkonce_odr
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == Linkage.linkonce_odr:
                function.linkage = Linkage.internal
        super()._finalize_final_module()


class _Kernel(CPUDispatcher):
    """numba's, whose calls by other kernels go to a twin without the code through which Python calls.

    Few kernels are called from Python, and without that code all of them compile in three quarters of the time.
    """

    def __init__(self, function: Callable[..., Any], local_types: Any, options: dict[str, Any]) -> None:
        # as numba calls it where a kernel is unpickled
        super().__init__(function, local_types, options, _Compiler)
        alone = {**options, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        self._twin = CPUDispatcher(function, local_types, alone, _Compiler)

    def keep_apart(self, stamp: str) -> None:
        """Keep machine code on disk while the stamp is the same."""
        kept: tuple[tuple[Any, str], ...] = ((self, "called from Python"), (self._twin, "called by kernels"))
        for dispatcher, name in kept:
            dispatcher.enable_caching()
            _keep_apart(dispatcher._cache, f"{stamp} {name}")

    @property
    def is_compiling(self) -> Any:
        """Whether either is being compiled; numba asks where a kernel calls itself."""
        return super().is_compiling or self._twin.is_compiling

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Types of a call by another kernel."""
        return self._twin.get_call_template(args, kws)

    def get_overload(self, sig: Any) -> Any:
        """Machine code for a call by another kernel."""
        return self._twin.get_overload(sig)


class _Compiler(Compiler):
    """numba's, into :class:`_OwnCopies`."""

    def __init__(self, typing: Any, target: Any, _: None, *rest: Any) -> None:
        own = _OwnCopies(target.codegen(), "kernel")
        own.enable_object_caching()
        super().__init__(typing, target, own, *rest)


def kernel(*, inline: bool = False, fused: bool = True, cached: bool = True) -> Callable[[Callable[..., Any]], Any]:
    """Decorator: nopython, no GIL, no divide checks, fused multiply-add, cached.

    Arithmetic is bit-reproducible on one machine: the compiled code does not depend on the batch, and NaN
    and infinity keep their meaning (no ``fastmath=True``).

    Args:
        inline: force LLVM to inline (its fast-math flags stay its own).
        fused: allow fused multiply-add. Without it a function gives the same bits wherever it is inlined.
        cached: keep the machine code on disk; not worth it for what is only compiled into something cached.
    """
    fastmath = {"contract"} if fused else False

    def decorate(function: Callable[..., Any]) -> Any:
        options: dict[str, Any] = {
            "nopython": True,
            "fastmath": fastmath,
            "error_model": "numpy",
            "nogil": True,
            "forceinline": inline,
        }
        compiled = _Kernel(function, {}, options)
        if cached:
            compiled.keep_apart(_stamp(function.__module__))
        return compiled

    return decorate


def compile_callback(function: Callable[..., None], signature: Any, stamp: str | None) -> int:
    """Compile ``function`` to machine code callable through a pointer and return its address.

    The returned address stays valid for the life of the process.

    Args:
        function: a plain function. One with a closure over a kernel would never be found in the cache again, because
            numba's key then holds the kernel's identity, which is new in every process.
        signature: C types.
        stamp: the machine code is kept on disk and taken from there while this is the same; None: not kept.
    """
    if function.__closure__ is not None:
        raise TypeError(f"{function.__qualname__} has a closure: bind what it needs as globals.")
    callback: Any = CFunc(function, numba.core.sigutils.normalize_signature(signature), locals={}, options={})
    if stamp is not None:
        callback.enable_caching()
        _keep_apart(callback._cache, stamp)
    callback.compile()
    _KEEP_ALIVE.append(callback)
    return int(callback.address)


_KEEP_ALIVE: list[Any] = []


@intrinsic
def stack_array(typing_context: Any, size: Any) -> Any:
    """Uninitialised float64 array of a constant size, on the stack of the kernel that calls this.

    The compiler knows that it overlaps nothing and keeps it in registers where it can; an array that is passed in
    allows neither. It must not outlive the call.
    """
    if not isinstance(size, types.IntegerLiteral):
        return None
    count = size.literal_value
    array_type = types.Array(types.float64, 1, "C")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        memory = cgutils.alloca_once(builder, ir.ArrayType(ir.DoubleType(), count))
        memory.align = 64
        array = context.make_array(array_type)(context, builder)
        itemsize = context.get_constant(types.intp, 8)
        shape = context.get_constant(types.intp, count)
        data = builder.bitcast(memory, array.data.type)
        populate_array(array, data=data, shape=(shape,), strides=(itemsize,), itemsize=itemsize, meminfo=None)
        return array._getvalue()

    return array_type(size), generate


@intrinsic
def borrowed(typing_context: Any, value: Any) -> Any:
    """The same array, or tuple with arrays in it, whose users are not counted; it must outlive the call.

    Every view of an array counts one user more, and one less when it ends. Threads that share an array would wait for
    each other at every count.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _uncounted(context, builder, value, arguments[0])

    return value(value), generate


def _uncounted(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    if isinstance(kind, types.BaseTuple):
        kinds: Any = kind  # iterable, which numba's annotations do not say
        items = [_uncounted(context, builder, k, builder.extract_value(value, i)) for i, k in enumerate(kinds)]
        return context.make_tuple(builder, kind, items)
    if not isinstance(kind, types.Array):
        return value
    array = context.make_array(kind)(context, builder, value)
    array.meminfo = cgutils.get_null_value(array.meminfo.type)
    array.parent = cgutils.get_null_value(array.parent.type)
    return array._getvalue()


@intrinsic
def claim(typing_context: Any, claims: Any, index: Any, turn: Any) -> Any:
    """Whether this thread is the first to ask for ``index`` in this turn: raises ``claims[index]`` to it, atomically.

    One that is late, and asks for a turn that has been and gone, gets nothing.

    Args:
        claims: (N,) int64, contiguous: the last turn in which somebody asked.
        index: from 0 to N - 1, unchecked.
        turn: int64, higher than all before.
    """
    if claims != _COUNTS or not isinstance(index, types.Integer) or turn != types.int64:
        return None

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        place = _place(context, builder, arguments[0], arguments[1])
        before = builder.atomic_rmw("max", place, arguments[2], "acq_rel")
        return builder.icmp_signed("<", before, arguments[2])

    return types.boolean(claims, index, turn), generate


@intrinsic
def count_up(typing_context: Any, counts: Any) -> Any:
    """Add 1 to ``counts[0]`` atomically: whoever reads it by :func:`count_of` sees all that was written before."""
    if counts != _COUNTS:
        return None

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        place = _place(context, builder, arguments[0], ir.Constant(ir.IntType(64), 0))
        builder.atomic_rmw("add", place, ir.Constant(ir.IntType(64), 1), "acq_rel")
        return context.get_dummy_value()

    return types.void(counts), generate


@intrinsic
def count_of(typing_context: Any, counts: Any) -> Any:
    """``counts[0]``, as the other threads have left it by now."""
    if counts != _COUNTS:
        return None

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        place = _place(context, builder, arguments[0], ir.Constant(ir.IntType(64), 0))
        return builder.load_atomic(place, "acquire", 8)

    return types.int64(counts), generate


_COUNTS = types.Array(types.int64, 1, "C")


def _place(context: Any, builder: Any, array: Any, index: Any) -> Any:
    """Pointer to an entry of one that is of type ``_COUNTS``."""
    return builder.gep(context.make_array(_COUNTS)(context, builder, array).data, [index])
