"""The loop of :mod:`ddagr_gym.diagnosis.search.sensor_effects`, compiled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel
from ddagr_gym.physics.callbacks import EffectActions, actions_on, apply_effects
from ddagr_gym.physics.layout import POINT_READINGS, READING

Array = NDArray[np.float64]


@kernel()
def read_again(record: Array, actions: EffectActions, readings: Array) -> None:
    """Readings with effects applied to recorded rows, sample by sample.

    Args:
        record: (W, T, layout.SIZE).
        actions: of W environments, the memory updated.
        readings: (W, T, 8), written.
    """
    for n in range(record.shape[0]):
        own = actions_on(actions, n)
        for k in range(record.shape[1]):
            row = record[n, k].copy()
            apply_effects(POINT_READINGS, row, own)
            for j in range(8):
                readings[n, k, j] = row[READING + j]
