"""Bank speed loops: first order, solved exactly (theory: wheel model, eq. (28); thesis 4.11)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel
from ddagr_gym.physics.layout import MOTOR_RATE, MOTOR_TARGET, OMEGA, WHEEL_ANGLE


@kernel()
def advance_motors(row: NDArray[np.float64], duration: float) -> None:
    """Bank speeds and wheel angles after ``duration`` [s] of d omega/dt = k_omega (target - omega)."""
    for bank in range(2):
        target = row[MOTOR_TARGET + bank]
        rate = row[MOTOR_RATE + bank]
        difference = row[OMEGA + bank] - target
        decay = math.exp(-rate * duration)
        row[WHEEL_ANGLE + bank] += target * duration + difference * (1.0 - decay) / rate
        row[OMEGA + bank] = target + difference * decay
