"""Covariance of the filter: propagation, Joseph update, limits. In place, symmetric throughout."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.estimation.layout import (
    CEILING,
    COLUMN_ROW,
    FLOOR,
    GAIN_ROW,
    MOTION_SIZE,
    OMEGA,
    PRODUCT_ROW,
    STATE_SIZE,
    TRANSITION_ROW,
)
from ddagr_gym.jit import kernel

Array = NDArray[np.float64]


@kernel()
def propagate(covariance: Array, bank_decay: float, scratch: Array) -> None:
    """``P <- Phi P Phi^T`` with the rows of Phi that :func:`~process_model.advance_state` left in ``scratch``.

    Args:
        covariance: (STATE_SIZE, STATE_SIZE), updated; symmetric before and after.
        bank_decay: diagonal of Phi at the bank speeds; at parameters and biases it is 1.
        scratch: of the step; the rows from PRODUCT_ROW are overwritten.
    """
    transition = scratch[TRANSITION_ROW : TRANSITION_ROW + 3]
    product = scratch[PRODUCT_ROW : PRODUCT_ROW + 3]
    for i in range(3):
        for j in range(STATE_SIZE):
            product[i, j] = 0.0
        for k in range(MOTION_SIZE):
            factor = transition[i, k]
            for j in range(STATE_SIZE):
                product[i, j] += factor * covariance[k, j]
    for i in range(3):
        for j in range(i, 3):
            total = 0.0
            for k in range(MOTION_SIZE):
                total += product[i, k] * transition[j, k]
            covariance[i, j] = total
            covariance[j, i] = total
        for j in range(3, STATE_SIZE):
            covariance[i, j] = product[i, j]
            covariance[j, i] = product[i, j]
    for j in range(STATE_SIZE):
        covariance[OMEGA, j] *= bank_decay
        covariance[OMEGA + 1, j] *= bank_decay
    for j in range(STATE_SIZE):
        covariance[j, OMEGA] *= bank_decay
        covariance[j, OMEGA + 1] *= bank_decay


@kernel()
def joseph_update(covariance: Array, expected: float, variance: float, scratch: Array) -> None:
    """``P <- (I - K h) P (I - K h)^T + K R K^T`` for one scalar measurement and any gain.

    Evaluated as the product it is: ``B = P - K c^T`` with ``c = P h^T``, then ``B - (B h^T) K^T + R K K^T``, where
    ``B h^T = c - K (h c)``.

    Args:
        covariance: (STATE_SIZE, STATE_SIZE), updated; symmetric up to rounding.
        expected: h c, the variance that the state's uncertainty gives the measurement.
        variance: R.
        scratch: GAIN_ROW holds K, COLUMN_ROW c.
    """
    gain, column = scratch[GAIN_ROW], scratch[COLUMN_ROW]
    for i in range(STATE_SIZE):
        gain_i = gain[i]
        rest = column[i] - gain_i * (expected + variance)
        for j in range(STATE_SIZE):
            covariance[i, j] = covariance[i, j] - gain_i * column[j] - rest * gain[j]


@kernel()
def limit_covariance(model: Array, covariance: Array) -> None:
    """Symmetrise, and hold every variance between its floor and its ceiling.

    A variance above its ceiling shrinks with its row and column, which keeps all correlations; one below its floor is
    raised alone. Both keep a positive definite matrix positive definite.
    """
    for i in range(STATE_SIZE):
        for j in range(i):
            mean = 0.5 * (covariance[i, j] + covariance[j, i])
            covariance[i, j] = mean
            covariance[j, i] = mean
    for i in range(STATE_SIZE):
        if covariance[i, i] > model[CEILING + i]:
            factor = math.sqrt(model[CEILING + i] / covariance[i, i])
            for j in range(STATE_SIZE):
                covariance[i, j] *= factor
                covariance[j, i] *= factor
        if covariance[i, i] < model[FLOOR + i]:
            covariance[i, i] = model[FLOOR + i]
