"""Torque of the motors along recorded drives, which their currents measure up to a constant."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel
from ddagr_gym.physics.drivetrain import motor_torque
from ddagr_gym.physics.layout import (
    AXLE_TORQUE,
    DRIVETRAIN,
    DRIVETRAIN_PARAMETERS,
    INTEGRAL,
    LOAD_CARRIED,
    MOTOR_RATE,
    MOTOR_TARGET,
    OMEGA,
    SIZE,
)

Array = NDArray[np.float64]

RECORDED: tuple[int, ...] = (
    *range(OMEGA, OMEGA + 2),
    *range(MOTOR_TARGET, MOTOR_TARGET + 2),
    *range(MOTOR_RATE, MOTOR_RATE + 2),
    *range(INTEGRAL, INTEGRAL + 2),
    *range(AXLE_TORQUE, AXLE_TORQUE + 4),
    *range(DRIVETRAIN, DRIVETRAIN + len(DRIVETRAIN_PARAMETERS)),
    LOAD_CARRIED,
)
"""Entries of a row that the torque depends on; the bank speeds come first."""


def motor_torques(record: Array) -> Array:
    """Torque of the motors of both banks at their wheels (..., 2) [N m], right and left.

    Args:
        record: (..., K) entries :data:`RECORDED` of simulated samples.
    """
    flat = np.ascontiguousarray(record).reshape(-1, len(RECORDED))
    torques = np.empty((len(flat), 2))
    _fill(flat, np.array(RECORDED, dtype=np.int64), torques)
    return torques.reshape(*record.shape[:-1], 2)


@kernel()
def _fill(record: Array, entries: NDArray[np.int64], torques: Array) -> None:
    """Write the torques (N, 2) of recorded entries (N, K)."""
    row = np.zeros(SIZE)
    for n in range(record.shape[0]):
        for j in range(entries.shape[0]):
            row[entries[j]] = record[n, j]
        for bank in range(2):
            torques[n, bank] = motor_torque(row, bank)
