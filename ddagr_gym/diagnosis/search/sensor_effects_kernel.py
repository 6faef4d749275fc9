"""The loop of :mod:`ddagr_gym.diagnosis.search.sensor_effects`, compiled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel
from ddagr_gym.physics.callbacks import apply_effects
from ddagr_gym.physics.layout import POINT_READINGS, READING

Array = NDArray[np.float64]


@kernel()
def read_again(
    record: Array, points: NDArray[np.int64], addresses: NDArray[np.int64], parameters: Array, memory: Array,
    readings: Array,
) -> None:  # fmt: skip
    """Readings with effects applied to recorded rows, sample by sample.

    Args:
        record: (W, T, layout.SIZE).
        points: (effects,).
        addresses: (effects,).
        parameters: (effects, EFFECT_PARAMETERS).
        memory: (W, effects, EFFECT_MEMORY), updated.
        readings: (W, T, 8), written.
    """
    for n in range(record.shape[0]):
        for k in range(record.shape[1]):
            row = record[n, k].copy()
            apply_effects(POINT_READINGS, row, points, addresses, parameters, memory[n])
            for j in range(8):
                readings[n, k, j] = row[READING + j]
