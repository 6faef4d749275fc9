"""What the training of a learned estimator minimises, and how a turn to one side becomes one to the other."""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray

from ddagr_gym.estimation.learned_network import LARGEST_CORRELATION, LARGEST_LOG, LEAST_LOG, OUTPUTS

Tensor = torch.Tensor

_GATE = 5.0  # standard deviations beyond which an error counts linearly (P. Huber, 1964)


def gaussian_loss(outputs: Tensor, wanted: Tensor, weights: Tensor) -> Tensor:
    """Weighted mean of the negative log-likelihood of ``wanted`` (D, B, 2), velocities or places over their scale.

    Beyond _GATE standard deviations errors count linearly: turns on which the filter diverges would decide all.
    """
    logs = outputs[..., 2:4].clamp(LEAST_LOG, LARGEST_LOG)
    correlation = LARGEST_CORRELATION * torch.tanh(outputs[..., 4])
    scaled = (wanted - outputs[..., :2]) * torch.exp(-logs)
    free = 1.0 - correlation**2
    squares = (scaled**2).sum(dim=-1) - 2.0 * correlation * scaled[..., 0] * scaled[..., 1]
    distances = torch.sqrt(squares / free + 1e-12)
    bounded = torch.where(distances < _GATE, distances**2, 2.0 * _GATE * distances - _GATE**2)
    loss = logs.sum(dim=-1) + 0.5 * torch.log(free) + 0.5 * bounded
    return (weights * loss).sum() / weights.sum()


def fixed_loss(outputs: Tensor, wanted: Tensor, weights: Tensor) -> Tensor:
    """Weighted mean of Huber's loss of the velocities or places at a fixed deviation, their scale.

    Beside the likelihood, which alone widens the deviations before it learns the velocities (M. Seitzer et al., 2022).
    """
    errors = torch.nn.functional.huber_loss(outputs[..., :2], wanted, reduction="none").sum(dim=-1)
    return (weights * errors).sum() / weights.sum()


def total_loss(outputs: Tensor, wanted: Tensor, weights: Tensor) -> Tensor:
    """Both losses of every pair: ``outputs`` (D, B, OUTPUTS each), ``wanted`` (D, B, 2 each)."""
    losses = []
    for pair in range(wanted.shape[-1] // 2):
        own, due = outputs[..., OUTPUTS * pair : OUTPUTS * (pair + 1)], wanted[..., 2 * pair : 2 * pair + 2]
        losses.append(gaussian_loss(own, due, weights) + fixed_loss(own, due, weights))
    return torch.stack(losses).sum()


def mirror(names: tuple[str, ...]) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
    """Place and sign by which every input of a turn becomes that of the turn to the other side."""
    places, signs = [], []
    for name in names:
        other = name.replace("right", "?").replace("left", "right").replace("?", "left")
        places.append(names.index(other))
        odd = ("force_y", "yaw_rate", "heading_sine", "centripetal", "filter_v_y", "gyro_bias", "bias_y", "gravity_y",
               "pose_y", "pose_turned")  # fmt: skip
        signs.append(-1.0 if any(part in name for part in odd) and "deviation" not in name else 1.0)
    return np.array(places), np.array(signs, dtype=np.float32)
