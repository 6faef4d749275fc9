"""Effects that act on readings only, applied to what a simulation recorded: no need to drive again.

A third of the library changes what sensors say and not what the robot does. Their columns come from one recorded
simulation, and are free of the integrator's noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.problem import Point, Problem
from ddagr_gym.physics import layout
from ddagr_gym.physics.callbacks import EffectActions
from ddagr_gym.physics.effects import Effect, effect_table

Array = NDArray[np.float64]


def acts_on_readings_only(effect: Effect) -> bool:
    """Whether all that an effect does is done to readings."""
    return all(point == layout.POINT_READINGS for point, _ in effect.acting)


@dataclass(frozen=True, eq=False)
class Drives:
    """Every entry of the simulator after each sample of the windows.

    Attributes:
        record: (W, T, layout.SIZE).
    """

    record: Array

    def readings(self, effect: Effect) -> Array:
        """(W, T, 8) readings with a further effect, which acts on them last.

        Args:
            effect: see :func:`acts_on_readings_only`.
        """
        from ddagr_gym.diagnosis.search.sensor_effects_kernel import read_again

        points, addresses, parameters = effect_table((effect,))
        windows, samples = self.record.shape[:2]
        repeated = np.repeat(parameters[None], windows, axis=0)
        memory = np.zeros((windows, len(points), layout.EFFECT_MEMORY))
        readings = np.empty((windows, samples, 8))
        read_again(self.record, EffectActions(points, addresses, repeated, memory), readings)
        return readings


def record_drives(problem: Problem, point: Point) -> Drives:
    """Simulate the windows at a point once, keeping everything."""
    entries = range(layout.SIZE)
    return Drives(problem.model.predict_recorded(point.values, point.states, entries, point.effects)[1])
