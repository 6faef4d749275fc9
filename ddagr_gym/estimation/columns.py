"""Columns of a recording as the arrays that the filters take."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.estimation.layout import COMMANDS

Array = NDArray[np.float64]


def sample_times(columns: Mapping[str, ArrayLike], sample_period: float) -> tuple[Array, Array]:
    """Times ``t`` (T,) and the durations (T,) since the sample before; the first is one ``sample_period`` [s].

    Raises:
        InputError: no time column, or one that does not increase.
    """
    t = np.asarray(columns["t"], dtype=np.float64) if "t" in columns else np.empty(0)
    durations = np.diff(t, prepend=t[:1] - sample_period)
    if not t.size or not (durations > 0).all():
        raise InputError("columns need a time column t that increases: sort the recording and drop repeated samples.")
    return t, durations


def known_commands(columns: Mapping[str, ArrayLike], user: str) -> Array:
    """Commands (T, 2) for a filter that cannot go on without one.

    Raises:
        InputError: rows without a command, or columns of other lengths than ``t``.
    """
    commands = stack_columns(columns, COMMANDS, np.nan)
    unknown = np.flatnonzero(~np.isfinite(commands).all(axis=1))
    if unknown.size:
        raise InputError(
            f"{unknown.size} of {len(commands)} rows have no command, row {unknown[0] + 1} the first: {user} needs one "
            "in every row; cut the recording to begin with its first command."
        )
    return commands


def stack_columns(columns: Mapping[str, ArrayLike], names: tuple[str, ...], missing: float) -> Array:
    """Columns side by side, (T, len(names)); those that are not there are filled with ``missing``.

    Raises:
        InputError: columns of other lengths than ``t``.
    """
    shape = np.shape(columns["t"])
    series = [np.asarray(columns.get(name, np.full(shape, missing)), dtype=np.float64) for name in names]
    for name, values in zip(names, series, strict=True):
        if values.shape != shape:
            raise InputError(f"column {name} has shape {values.shape}, t {shape}: give columns of one length.")
    return np.ascontiguousarray(np.stack(series, axis=1))
