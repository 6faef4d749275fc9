"""Coloured noise of the sensors."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter


def first_order(rng: np.random.Generator, samples: int, correlation: float) -> np.ndarray:
    """Unit-variance AR(1) noise with the given correlation of neighbouring samples, (samples,)."""
    drive = rng.standard_normal(samples) * np.sqrt(1.0 - correlation**2)
    drive[0] = rng.standard_normal()
    return np.asarray(lfilter([1.0], [1.0, -correlation], drive))


def pink(rng: np.random.Generator, samples: int, octaves: int = 8) -> np.ndarray:
    """Unit-variance noise with a spectrum close to 1/f: equal AR(1) parts, one per octave, (samples,)."""
    parts = [first_order(rng, samples, float(np.exp(-(0.5**k)))) for k in range(octaves)]
    return np.sum(parts, axis=0) / np.sqrt(octaves)
