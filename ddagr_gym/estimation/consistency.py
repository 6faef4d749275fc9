"""Consistency of a filter: NEES, NIS and whiteness, each with the band in which a consistent filter stays.

Theory: filter, section 6.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.estimation.layout import CHANNELS

Array = NDArray[np.float64]

BLOCKS: dict[str, slice] = {
    "velocity": slice(0, 3),
    "bank_speeds": slice(3, 5),
    "parameters": slice(5, 9),
    "biases": slice(9, 12),
}
"""Blocks of the state whose errors are judged apart: a huge error in one hides in the sum."""


class Band(NamedTuple):
    """Interval that holds a statistic of a consistent filter with the stated probability."""

    low: float
    high: float

    def contains(self, value: ArrayLike) -> NDArray[np.bool_]:
        """Whether values lie inside."""
        values = np.asarray(value, dtype=np.float64)
        return np.asarray((values >= self.low) & (values <= self.high))


def chi_square_band(degrees: int, count: int = 1, probability: float = 0.95) -> Band:
    """Band of the mean of ``count`` independent chi-square values of ``degrees`` degrees of freedom, over ``degrees``.

    Raises:
        InputError: counts below 1 or a probability outside (0, 1).
    """
    if degrees < 1 or count < 1 or not 0.0 < probability < 1.0:
        raise InputError(
            f"degrees {degrees}, count {count}, probability {probability:g}: give counts of at least 1 and a "
            "probability between 0 and 1."
        )
    from scipy.special import chdtri

    total = degrees * count
    tail = 0.5 * (1.0 - probability)
    return Band(float(chdtri(total, 1.0 - tail)) / total, float(chdtri(total, tail)) / total)


def normalised_estimation_error(errors: ArrayLike, covariances: ArrayLike, block: slice | str = slice(None)) -> Array:
    """NEES over its degrees of freedom, 1 on average for a consistent filter (theory: filter, eq. (10)).

    Args:
        errors: (..., n) truth less estimate.
        covariances: (..., n, n).
        block: entries to judge, or one of ``BLOCKS``.

    Returns:
        (...,).
    """
    chosen = BLOCKS[block] if isinstance(block, str) else block
    e = np.asarray(errors, dtype=np.float64)[..., chosen]
    p = np.asarray(covariances, dtype=np.float64)[..., chosen, chosen]
    return np.asarray(np.einsum("...i,...i->...", e, np.linalg.solve(p, e[..., None])[..., 0]) / e.shape[-1])


class ChannelStatistics(NamedTuple):
    """Standardised innovations of one channel.

    Attributes:
        samples: how many were used.
        nis: mean of their squares.
        band: where ``nis`` lies for white, consistent innovations.
        mean: of the innovations themselves, 0 when unbiased.
        correlation: autocorrelation at lags 1 to L.
        correlation_bound: of each of them for white innovations.
    """

    samples: int
    nis: float
    band: Band
    mean: float
    correlation: Array
    correlation_bound: float


def channel_statistics(
    standardised: ArrayLike, lags: int = 20, probability: float = 0.95
) -> dict[str, ChannelStatistics]:
    """NIS and whiteness of each channel.

    Args:
        standardised: (T, 5) standardised innovations, NaN where nothing was measured.
        lags: L, in used samples.
        probability: of the bands.

    Returns:
        By channel name; channels with no more than ``lags`` samples are left out.
    """
    values = np.asarray(standardised, dtype=np.float64)
    if values.ndim != 2 or values.shape[1] != len(CHANNELS):
        raise InputError(f"standardised innovations have shape {values.shape}: give (T, {len(CHANNELS)}).")
    result = {}
    for name, column in zip(CHANNELS, values.T, strict=True):
        used = column[np.isfinite(column)]
        if used.size > lags:
            result[name] = ChannelStatistics(
                samples=used.size,
                nis=float(np.mean(used**2)),
                band=chi_square_band(1, used.size, probability),
                mean=float(np.mean(used)),
                correlation=autocorrelation(used, lags),
                correlation_bound=white_bound(used.size, probability),
            )
    return result


def autocorrelation(series: ArrayLike, lags: int) -> Array:
    """Autocorrelation of a zero-mean series at lags 1 to ``lags``; zero for a series of zeros."""
    x = np.asarray(series, dtype=np.float64)
    if x.ndim != 1 or not 1 <= lags < x.size:
        raise InputError(f"series of shape {x.shape} and {lags} lags: give a series longer than the lags.")
    power = float(x @ x)
    products = np.array([x[lag:] @ x[:-lag] for lag in range(1, lags + 1)])
    return products / power if power > 0.0 else np.zeros(lags)


def white_bound(count: int, probability: float = 0.95) -> float:
    """Bound on the size of a white series' autocorrelation at one lag, from ``count`` samples."""
    from scipy.special import ndtri

    return float(ndtri(0.5 * (1.0 + probability)) / np.sqrt(count))
