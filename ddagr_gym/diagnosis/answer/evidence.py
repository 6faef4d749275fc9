"""What the pictures of a diagnosis are drawn from: plain arrays, kept in one file without pickles.

W windows of B block means, Q pieces per window, K effects of the library, F effects of the chosen model, R operating
conditions;
channels in the order of :data:`ddagr_gym.identification.windows.CHANNELS`.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.files import DAMAGED_ARRAYS, atomic_path

Array = NDArray[np.float64]

VERSION = 1
"""Of the file: raised when an array goes or changes its meaning."""

NAME = "evidence.npz"
"""Of the file beside ``diagnosis.json``."""

_SHAPES = {
    "recording": "W", "time": "W", "path": "WB3", "measured": "WB8", "raw": "WB8", "nominal": "WB8", "corrected": "WB8",
    "sigma": "WB8", "effects": "K", "gains": "K", "left": "K", "gates": "K", "regime_names": "R", "regimes": "RWQ",
    "places": "WQ2", "findings": "F", "score": "FWQ", "information": "FWQ", "gain": "FWQ", "wrench_before": "W3",
    "wrench_after": "W3", "wrench_deviation": "W3",
}  # fmt: skip
_SINGLE = {"sigma", "regimes", "score", "information", "gain", "wrench_before", "wrench_after", "wrench_deviation"}


@dataclass(frozen=True, eq=False)
class Evidence:
    """Arrays behind a diagnosis.

    Attributes:
        block: length of a block [s].
        piece: length of a piece [s].
        recording: (W,) number of each window's recording.
        time: (W,) at its start [s].
        path: (W, B, 3) x, y [m] and heading [rad] by the corrected model.
        measured: (W, B, 8) block means, NaN where there is no sample.
        raw: (W, B, 8) the same of the nominal model as it stands, at the best of what is unknown in each window.
        nominal: (W, B, 8) the same of the refitted nominal model.
        corrected: (W, B, 8) the same of the chosen model.
        sigma: (W, B, 8) standard deviations, infinite where there is no sample.
        effects: (K,) names.
        gains: (K,) fall of the cost by each at the nominal model, over the dispersion.
        left: (K,) the same at the chosen model; NaN for its own effects.
        gates: (K,) what a gain has to pass: the end of the null band. NaN where there is none.
        regime_names: (R,) operating conditions, see :mod:`ddagr_gym.diagnosis.localisation.operating_conditions`.
        regimes: (R, W, Q) values of the operating conditions.
        places: (W, Q, 2) x, y [m].
        findings: (F,) names of the chosen model's effects.
        score: (F, W, Q) see :mod:`ddagr_gym.diagnosis.localisation.effect_timeline`.
        information: (F, W, Q) the same.
        gain: (F, W, Q) the same.
        wrench_before: (W, 3) F_x, F_y [N], M_z [N m] that the nominal model lacks as it stands.
        wrench_after: (W, 3) the same of the chosen model.
        wrench_deviation: (W, 3) standard deviations.
    """

    block: float
    piece: float
    recording: NDArray[np.int64]
    time: Array
    path: Array
    measured: Array
    raw: Array
    nominal: Array
    corrected: Array
    sigma: Array
    effects: tuple[str, ...]
    gains: Array
    left: Array
    gates: Array
    regime_names: tuple[str, ...]
    regimes: Array
    places: Array
    findings: tuple[str, ...]
    score: Array
    information: Array
    gain: Array
    wrench_before: Array
    wrench_after: Array
    wrench_deviation: Array

    def __post_init__(self) -> None:
        sizes = {"3": 3, "8": 8, "2": 2}
        for name, shape in _SHAPES.items():
            found = np.shape(getattr(self, name))
            wanted = tuple(sizes.setdefault(letter, size) for letter, size in zip(shape, found, strict=False))
            if len(found) != len(shape) or found != wanted:
                raise InputError(f"evidence has {name} of shape {found}: its shape is {', '.join(shape)}.")

    @property
    def duration(self) -> float:
        """Of a window [s]."""
        return float(self.path.shape[1] * self.block)

    def standardised(self, model: str) -> Array:
        """(W, B, 8) residual of "raw", "nominal" or "corrected" over its noise; NaN where there is no sample."""
        return np.asarray((self.measured - getattr(self, model)) / self.sigma)

    def lasting(self, model: str) -> Array:
        """(W, Q, 8) mean residual of each piece over the standard deviation of that mean; NaN without a sample.

        What lasts for half a second stands out of the noise of single blocks.
        """
        values = self.standardised(model)
        known = np.isfinite(values)
        filled = np.where(known, values, 0.0)
        length = max(round(self.piece / self.block), 1)
        piece = np.minimum(np.arange(values.shape[1]) // length, self.places.shape[1] - 1)
        pieces = range(self.places.shape[1])
        total = np.stack([filled[:, piece == q].sum(axis=1) for q in pieces], axis=1)
        count = np.stack([known[:, piece == q].sum(axis=1) for q in pieces], axis=1)
        return np.where(count > 0, total / np.sqrt(np.maximum(count, 1)), np.nan)

    def roughness(self, model: str) -> Array:
        """(W, Q) mean square of :meth:`lasting` over the channels; about 1 or less where only noise is left."""
        values = self.lasting(model)
        known = np.isfinite(values)
        return np.asarray(np.where(known, values**2, 0.0).sum(axis=2) / np.maximum(known.sum(axis=2), 1))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write all arrays to an NPZ file, which is whole or absent."""
        body = {item.name: _compact(item.name, np.asarray(getattr(self, item.name))) for item in fields(self)}
        with atomic_path(path) as temporary, temporary.open("wb") as stream:
            np.savez_compressed(stream, version=np.array(VERSION), **body)  # type: ignore[arg-type]

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Evidence:
        """Read what :meth:`save` wrote.

        Raises:
            InputError: no such file, no evidence in it, or of another version.
        """
        remedy = "make it with `ddagr diagnose`"
        try:
            with np.load(Path(path), allow_pickle=False) as stored:
                body = {name: stored[name] for name in stored.files}
        except (OSError, *DAMAGED_ARRAYS) as error:
            raise InputError(f"{os.fspath(path)} cannot be read as evidence ({error}): {remedy}.") from None
        version = body.pop("version", None)
        names = {item.name for item in fields(cls)}
        if getattr(version, "size", 0) != 1 or version.item() != VERSION or set(body) != names:
            raise InputError(f"{os.fspath(path)} holds no evidence of version {VERSION}: {remedy}.")
        restored: dict[str, Any] = {name: _restored(value) for name, value in body.items()}
        return cls(**restored)


def _compact(name: str, values: NDArray[np.generic]) -> NDArray[np.generic]:
    """Single precision, but for what may lie far from its origin."""
    return values.astype(np.float32) if name in _SINGLE else values


def _restored(values: NDArray[np.generic]) -> object:
    if values.dtype.kind == "U":
        return tuple(str(item) for item in values)
    if values.ndim == 0:
        return float(values)
    return values.astype(np.float64) if values.dtype.kind == "f" else values
