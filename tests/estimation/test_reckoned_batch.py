"""Poses of a batch: those of one robot's dead reckoning, to the bit."""

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.estimation import DeadReckoning, InertialModel
from ddagr_gym.estimation.reckoned_batch import ReckonedBatch
from ddagr_gym.parameters import Sensors
from ddagr_gym.presets import ddagr

MODEL = InertialModel.of(ddagr(), Sensors())
COUNT, SETTLING = 3, 3.0


def intervals(steps):
    """Commands (N, 2) and readings (N, 10, 5) of robots that drive arcs."""
    rng = np.random.default_rng(0)
    for _ in range(steps):
        commands = rng.uniform(0.3, 1.2, (COUNT, 2))
        readings = rng.normal(0.0, 0.05, (COUNT, 10, 5))
        readings[:, :, 3:] += commands[:, None]
        yield commands, readings


@pytest.mark.parametrize("settling", [SETTLING, 0.0, np.inf])
def test_a_batch_reckons_as_one_robot_does(settling):
    batch, ones = ReckonedBatch(MODEL, COUNT, settling), [DeadReckoning(MODEL, settling) for _ in range(COUNT)]
    for commands, readings in intervals(30):
        batch.step(commands, readings)
        for n, one in enumerate(ones):
            found = one.update(commands[n], readings[n])
            np.testing.assert_array_equal(batch.settled[n], [found.x, found.y, found.yaw])
            np.testing.assert_array_equal(batch.states[n, :3], [found.v_x, found.v_y, found.yaw_rate])
    assert np.abs(batch.settled[:, :2]).max() > 0.1


def test_a_reset_forgets_the_chosen_alone():
    batch = ReckonedBatch(MODEL, COUNT, SETTLING)
    for commands, readings in intervals(5):
        batch.step(commands, readings)
    kept = batch.settled.copy()
    batch.reset([1])
    np.testing.assert_array_equal(batch.settled[[0, 2]], kept[[0, 2]])
    np.testing.assert_array_equal(batch.settled[1], 0.0)


def test_shapes_that_do_not_fit_are_one_sentence():
    with pytest.raises(InputError, match="shapes"):
        ReckonedBatch(MODEL, COUNT).step(np.zeros((COUNT, 2)), np.zeros((COUNT, 5)))
