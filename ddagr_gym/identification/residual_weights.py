"""Residuals of predicted samples and their weights: by the sensors' noise, then by what a fit leaves unexplained."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.frames import wrap_angle
from ddagr_gym.identification.recording_noise import RecordingNoise
from ddagr_gym.identification.windows import CHANNELS, WindowSet

Array = NDArray[np.float64]

UNFITTED = ("specific_force_x", "specific_force_y")
"""Not fitted: tilt of the ground, lever arm and vibration are all in them, and not in the nominal model."""

ROBUST = 2.0
"""Weighted residual from which the loss is linear (ours): what the model cannot explain must not bend it."""

UNKNOWN_GYRO_BIAS = 0.005
"""Prior where a robot never stood [rad/s]: that of a MEMS gyro (ours)."""

LEAST_GYRO_BIAS = 2e-4
"""Least prior [rad/s]: the bias of a gyro wanders by so much in a drive (ours)."""

MAD_TO_DEVIATION = 1.4826
"""Standard deviation of a normal variable over the median of its size."""

_STRONGEST = 0.98
"""Correlation of successive samples beyond which they are not weighed down further (ours): a hundred are worth one."""

_FEWEST = 20
"""Samples of a channel below which its residuals change no weight (ours)."""


@dataclass(frozen=True, eq=False)
class Weights:
    """Weights of a fit.

    Correlated samples count for less: with the correlation r of successive ones (1 + r)/(1 - r) of them are worth one
    (M. S. Bartlett 1946). Their standard deviation is enlarged by the root of that, the size from which the loss is
    linear reduced by it, so that outliers are judged by the size of single samples.

    Attributes:
        sigma: (W, 1, 8) enlarged standard deviations, (W, 1, 10) with the motors' currents; infinite for channels that
            are left out.
        robust: (8,) or (10,) weighted residuals from which the loss is linear.
    """

    sigma: Array
    robust: Array


def residuals(windows: WindowSet, prediction: Array) -> Array:
    """Measurement less prediction (W, T, 8), NaN where there is no sample; headings on the circle."""
    difference = windows.measured[..., : prediction.shape[-1]] - prediction
    difference[..., CHANNELS.index("pose_yaw")] = wrap_angle(difference[..., CHANNELS.index("pose_yaw")])
    return difference


def successive_correlation(values: Array) -> float:
    """Correlation of successive known samples inside the windows (W, T); 0 for none."""
    product, power = 0.0, 0.0
    for row in values:
        known = row[np.isfinite(row)]
        product += float(known[1:] @ known[:-1])
        power += 0.5 * float(known[1:] @ known[1:] + known[:-1] @ known[:-1])
    return product / power if power > 0.0 else 0.0


def noise_weights(
    noise: Sequence[RecordingNoise],
    windows: WindowSet,
    imposed: bool,
    dead: Sequence[str],
    unfitted: Sequence[str] = UNFITTED,
) -> Weights:
    """Weights by the recordings' noise.

    Args:
        noise: one per recording.
        windows: to be fitted.
        imposed: True where the encoders drive, and so cannot judge.
        dead: channels to leave out.
        unfitted: further ones; parameters are fitted without UNFITTED, initial states with all.
    """
    roots = np.stack([[_root(item.channels[name].correlation) for name in CHANNELS] for item in noise])
    sigma = (np.stack([item.sigma for item in noise]) * roots)[windows.recording][:, None, :]
    left_out = [*unfitted, *dead, *(("encoder_right", "encoder_left") if imposed else ())]
    sigma[..., [CHANNELS.index(name) for name in left_out]] = np.inf
    return Weights(sigma, ROBUST / roots.max(axis=0))


def misfit_weights(windows: WindowSet, prediction: Array, before: Weights) -> Weights:
    """Weights by the residuals of a fit: their robust size and their correlation, never below the noise's.

    Args:
        windows: that were fitted.
        prediction: (W, T, 8) of the fit.
        before: weights of the fit.
    """
    return weights_by_residuals(residuals(windows, prediction), before)


def weights_by_residuals(left: Array, before: Weights) -> Weights:
    """The same by residuals (W, T, 8), NaN where there is no sample."""
    sigma, robust = before.sigma.copy(), before.robust.copy()
    for k in range(left.shape[-1]):
        residual = left[..., k]
        known = np.isfinite(residual)
        if known.sum() < _FEWEST or not np.isfinite(sigma[..., k]).any():
            continue
        size = MAD_TO_DEVIATION * float(np.median(np.abs(residual[known])))
        limit = 3.0 * size
        root = _root(successive_correlation(np.clip(residual, -limit, limit)))
        sigma[..., k] = np.maximum(sigma[..., k], size * root)
        robust[k] = min(robust[k], ROBUST / root)
    return Weights(sigma, robust)


def _root(correlation: float) -> float:
    """Root of the samples that are worth one."""
    kept = min(max(correlation, 0.0), _STRONGEST)
    return float(np.sqrt((1.0 + kept) / (1.0 - kept)))
