"""How compiled code calls an effect: through a pointer, so that adding one compiles nothing else.

An effect's function has the signature ``f(row, parameters, memory)`` over float64 arrays of ``layout.SIZE``,
``layout.EFFECT_PARAMETERS`` and ``layout.EFFECT_MEMORY`` entries, and changes ``row`` (and its memory) in place.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import carray, types  # type: ignore[attr-defined]
from numpy.typing import NDArray

from ddagr_gym.jit import callback_stamp, compile_callback, intrinsic, kernel
from ddagr_gym.physics.layout import EFFECT_MEMORY, EFFECT_PARAMETERS, SIZE

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

_FLOATS = types.CPointer(types.float64)
_SIGNATURE = types.void(_FLOATS, _FLOATS, _FLOATS)


class EffectActions(NamedTuple):
    """Compiled actions of the effects on one environment; on N of them parameters and memory have N in front.

    Attributes:
        points: (actions,) where each acts, ``layout.POINT_*``.
        addresses: (actions,) from :func:`compile_effect`.
        parameters: (actions, EFFECT_PARAMETERS).
        memory: (actions, EFFECT_MEMORY), which they update.
    """

    points: Integers
    addresses: Integers
    parameters: Array
    memory: Array


def _callback(row_pointer: Any, parameter_pointer: Any, memory_pointer: Any) -> None:
    row = carray(row_pointer, (SIZE,))
    parameters = carray(parameter_pointer, (EFFECT_PARAMETERS,))
    memory = carray(memory_pointer, (EFFECT_MEMORY,))
    action(row, parameters, memory)  # type: ignore[name-defined]  # noqa: F821 (bound by compile_effect)


def compile_effect(function: Callable[..., None]) -> int:
    """Address of the machine code of an effect function, kept on disk while its folder's sources stay the same.

    Args:
        function: takes (row, parameters, memory); compiled in nopython mode.
    """
    scope = {**globals(), "action": kernel(cached=False)(function)}
    callback = FunctionType(_callback.__code__, scope, "callback")
    callback.__qualname__ = f"callback_{function.__module__}_{function.__qualname__}"
    return compile_callback(callback, _SIGNATURE, callback_stamp(function))


@intrinsic
def _call(typing_context: Any, address: Any, row: Any, parameters: Any, memory: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pointer = ir.IntType(8).as_pointer()
        function_type = ir.FunctionType(ir.VoidType(), [pointer] * 3)
        function = builder.inttoptr(arguments[0], function_type.as_pointer())
        builder.call(function, [builder.inttoptr(argument, pointer) for argument in arguments[1:]])
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.int64, types.int64), generate


@kernel(inline=True)
def actions_on(actions: EffectActions, n: int) -> EffectActions:
    """Those of environment ``n`` out of a batch."""
    return EffectActions(actions.points, actions.addresses, actions.parameters[n], actions.memory[n])


@kernel()
def apply_effects(point: int, row: Array, actions: EffectActions) -> None:
    """Call, in order, the actions at ``point`` (one of ``layout.POINT_*``) on the row of one environment."""
    for k in range(actions.points.shape[0]):
        if actions.points[k] == point:
            parameters, memory = actions.parameters[k], actions.memory[k]
            _call(actions.addresses[k], row.ctypes.data, parameters.ctypes.data, memory.ctypes.data)
