"""Standard normal draws of numpy's generators inside compiled code.

numpy's own function is called by its address, as numpy's documentation shows for C code: the draws are those of
``generator.standard_normal``, bit for bit, and the generator goes on after them.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numpy.random import _generator
from numpy.typing import NDArray

from ddagr_gym.jit import intrinsic

GIVEN = 0
"""Instead of a generator's address: the numbers are given, none are drawn."""


def _address_of_fill() -> int:
    """Of numpy's ``random_standard_normal_fill(generator, count, values)``; 0 where its library does not show it."""
    function = getattr(ctypes.CDLL(_generator.__file__), "random_standard_normal_fill", None)
    return 0 if function is None else int(ctypes.cast(function, ctypes.c_void_p).value or 0)


FILL = _address_of_fill()


class NormalDraws:
    """Lets compiled code draw from numpy's generators, or draws from them here where numpy does not allow that."""

    def __init__(self) -> None:
        self._known: list[np.random.Generator] = []
        self._addresses = np.zeros(0, dtype=np.int64)

    def __reduce__(self) -> tuple[type[NormalDraws], tuple[()]]:
        return NormalDraws, ()  # a copy has other generators, at other addresses

    def prepare(
        self, generators: Sequence[np.random.Generator], chosen: NDArray[np.int64], values: NDArray[np.float64]
    ) -> NDArray[np.int64]:
        """Generators' addresses for :func:`draw_normals`.

        Args:
            generators: (N,), which must live until the draws are made.
            chosen: indices of those to draw from.
            values: (N, ...) what will be drawn; written here where compiled code cannot.

        Returns:
            (N,) addresses, ``GIVEN`` for those that are not chosen.
        """
        if not FILL:
            for n in chosen:
                generators[n].standard_normal(out=values[n])
            return np.full(len(generators), GIVEN, dtype=np.int64)
        if self._known != generators:
            self._known = list(generators)
            pointers = [generator.bit_generator.ctypes.bit_generator.value for generator in self._known]
            self._addresses = np.array(pointers, dtype=np.int64)
        if chosen.size == self._addresses.size:
            return self._addresses
        addresses = np.full(self._addresses.size, GIVEN, dtype=np.int64)
        addresses[chosen] = self._addresses[chosen]
        return addresses


@intrinsic
def draw_normals(typing_context: Any, function: Any, generator: Any, values: Any) -> Any:
    """Fill contiguous ``values`` with draws of a generator.

    Args:
        function: int64, :data:`FILL`.
        generator: int64, its address.
        values: float64 array.
    """
    if not isinstance(values, types.Array) or values.layout != "C" or values.dtype != types.float64:
        return None

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = context.make_array(values)(context, builder, arguments[2])
        pointer, word = ir.IntType(8).as_pointer(), ir.IntType(64)
        function_type = ir.FunctionType(ir.VoidType(), [pointer, word, pointer])
        called = builder.inttoptr(arguments[0], function_type.as_pointer())
        data = builder.bitcast(array.data, pointer)
        builder.call(called, [builder.inttoptr(arguments[1], pointer), array.nitems, data])
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, values), generate
