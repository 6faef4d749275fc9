"""Independent random streams by name, so that no draw for one purpose moves another."""

from __future__ import annotations

import zlib

import numpy as np


def stream(seed: int, *key: str | int) -> np.random.Generator:
    """Generator for one purpose.

    Args:
        seed: of the whole set, any non-negative integer.
        key: words and numbers that name the purpose, e.g. ("sealed", 7, "soil").
    """
    words = [part if isinstance(part, int) else zlib.crc32(part.encode()) for part in key]
    return np.random.default_rng(np.random.SeedSequence([seed, *words]))
