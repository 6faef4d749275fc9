"""A ring of past values in an effect's memory, for delays; at every sample, never at trial states.

The ring holds ``nodes`` nodes of ``width`` values, one every ``stride`` samples, so that it spans the same time at any
sample rate; then the index of the newest node, the samples since it was stored, and whether the ring is filled.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel

Array = NDArray[np.float64]


@kernel(inline=True)
def ring_stride(span: float, period: float, nodes: int) -> int:
    """Samples between nodes so that the ring reaches back ``span`` [s] at the sample ``period`` [s]."""
    return max(math.ceil(span / (period * (nodes - 2)) - 1e-9), 1)


@kernel(inline=True)
def ring_is_empty(memory: Array, width: int, nodes: int) -> bool:
    """True until :func:`fill_node` has been called; the caller then fills all nodes, 1 to ``nodes - 1`` strides ago."""
    return memory[width * nodes + 2] == 0.0


@kernel(inline=True)
def fill_node(memory: Array, width: int, nodes: int, strides_ago: int, stride: int, channel: int, value: float) -> None:
    """Set one value of the time before the first sample, seen from that sample; :func:`push` stores it next."""
    memory[width * ((1 - strides_ago) % nodes) + channel] = value
    memory[width * nodes + 1] = stride - 1.0
    memory[width * nodes + 2] = 1.0


@kernel(inline=True)
def push(memory: Array, width: int, nodes: int, stride: int, values: Array) -> None:
    """Count one sample; where a node is due, store ``values[:width]`` in it."""
    cursor = width * nodes
    memory[cursor + 1] += 1.0
    if memory[cursor + 1] >= stride:
        memory[cursor] = (int(memory[cursor]) + 1) % nodes
        memory[cursor + 1] = 0.0
        for channel in range(width):
            memory[width * int(memory[cursor]) + channel] = values[channel]


@kernel(inline=True)
def recall(
    memory: Array, width: int, nodes: int, stride: int, channel: int, samples_ago: float, present: float
) -> float:
    """Value of ``channel`` at an age in samples after :func:`push`, linear between nodes and the present value."""
    newest = int(memory[width * nodes])
    since = memory[width * nodes + 1]
    if samples_ago < since:
        last = memory[width * newest + channel]
        return present + samples_ago / since * (last - present)
    age = min((samples_ago - since) / stride, nodes - 2.0)
    whole = int(age)
    newer = memory[width * ((newest - whole) % nodes) + channel]
    older = memory[width * ((newest - whole - 1) % nodes) + channel]
    return newer + (age - whole) * (older - newer)
