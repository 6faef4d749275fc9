"""How much the accelerometer shakes, learnt by the inertial filter on the way."""

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.estimation import (
    CHANNELS,
    InertialBatch,
    InertialFilter,
    InertialKnowledge,
    InertialModel,
    LearnedModel,
)
from ddagr_gym.estimation.columns import stack_columns
from ddagr_gym.estimation.layout import COMMANDS
from ddagr_gym.parameters import Sensors
from ddagr_gym.presets import get_robot

ROBOT = get_robot("ddagr")
MODEL = InertialModel.of(ROBOT, Sensors())
KNOWN = InertialModel.of(ROBOT, replace(Sensors(), imu=replace(Sensors().imu, accelerometer_vibration=0.3)))


@pytest.fixture(scope="module")
def turn(level):
    """Commands (T, 2) and readings (T, 5) of a turn whose accelerometer does not shake, and the rims' speed (T,)."""
    columns = level.columns
    commands, readings = stack_columns(columns, COMMANDS, np.nan), stack_columns(columns, CHANNELS, np.nan)
    speed = 0.5 * ROBOT.outer_radius * np.abs(readings[:, 3:5]).sum(axis=1)
    return commands, readings, np.nan_to_num(speed)


def shaken(turn, vibration, seed=3, correlation=0.0):
    """Readings of the deviation that wheel model, eq. (35), has; what is added may hang together between samples."""
    _, readings, speed = turn
    still = Sensors().imu.accelerometer_noise
    added = np.sqrt((still + vibration * speed) ** 2 - still**2)
    noise = np.random.default_rng(seed).standard_normal((len(readings), 2))
    for k in range(1, len(noise)):
        noise[k] = correlation * noise[k - 1] + np.sqrt(1.0 - correlation**2) * noise[k]
    found = readings.copy()
    found[:, :2] += added[:, None] * noise
    return found


def learnt(turn, readings, model=MODEL):
    own = InertialFilter(model)
    own.run(turn[0], readings)
    return own


@pytest.mark.parametrize("vibration", [0.3, 1.0, 3.0])
def test_a_vibration_is_learnt(turn, vibration):
    found = [learnt(turn, shaken(turn, vibration, seed)).vibration for seed in range(4)]
    # Ten blocks speak for none, and outliers are cut at 2.5 deviations
    assert np.mean(found) == pytest.approx(vibration, rel=0.25)


def test_noise_that_hangs_together_counts_for_more(turn):
    white, together = (learnt(turn, shaken(turn, 0.5, correlation=share)).vibration for share in (0.0, 0.8))
    assert together > 1.5 * white


def test_without_vibration_the_filter_is_to_the_bit_what_it_is_without_learning(turn):
    learning, plain = InertialFilter(MODEL), InertialFilter(MODEL.with_known_vibration())
    np.testing.assert_array_equal(learning.run(*turn[:2])[0], plain.run(*turn[:2])[0])


def test_it_is_known_before_the_turn(turn):
    before = 400  # samples: standing and two seconds on the way
    assert learnt((turn[0][:before], turn[1]), shaken(turn, 1.0)[:before]).vibration > 0.4


def test_side_slip_of_a_robot_that_shakes_is_better(turn):
    still = InertialFilter(MODEL).run(turn[0], turn[1])[0][:, 1]
    errors = {True: [], False: []}
    for seed in range(5):
        readings = shaken(turn, 0.3, seed, correlation=0.6)
        for learns in errors:
            own = InertialFilter(MODEL if learns else MODEL.with_known_vibration())
            errors[learns].append(np.sqrt(np.mean((own.run(turn[0], readings)[0][:, 1] - still) ** 2)))
    assert np.median(errors[True]) < 0.8 * np.median(errors[False])
    assert max(errors[True]) < 0.5 * max(errors[False])  # without, the filter loses the robot in one of them


def test_nothing_is_believed_within_half_of_the_deviation(turn):
    assert learnt(turn, shaken(turn, 0.04)).vibration == 0.0
    assert learnt(turn, shaken(turn, 0.3)).vibration > 0.15


def test_what_is_stated_is_not_learnt(turn):
    readings = shaken(turn, 2.0)
    assert learnt(turn, readings, KNOWN).vibration == 0.3
    assert learnt(turn, readings, MODEL.with_known_vibration()).vibration == 0.0
    assert LearnedModel.of(ROBOT, Sensors()).inertial == MODEL.with_known_vibration()


def test_it_is_forgotten_at_a_reset(turn):
    own = learnt(turn, shaken(turn, 1.0))
    own.reset()
    assert own.vibration == 0.0


def test_gaps_and_jolts_are_no_vibration(turn):
    readings = turn[1].copy()
    readings[::97, :2] = np.nan
    readings[50::211, 1] += 3.0
    assert learnt(turn, readings).vibration < 0.25


def test_alone_and_in_a_batch_to_the_bit(turn):
    commands, readings = turn[0], shaken(turn, 1.0)
    batch, alone = InertialBatch(MODEL, 2), InertialFilter(MODEL)
    for first in range(0, 600, 10):
        part = readings[first : first + 10]
        alone.run(commands[first : first + 1], part)
        batch.step(np.tile(commands[first], (2, 1)), np.stack([part, turn[1][first : first + 10]]))
    np.testing.assert_array_equal(batch.states[0], alone.state)
    assert (batch.states[1] != alone.state).any()


def test_bad_weight():
    with pytest.raises(InputError, match="vibration_weight"):
        InertialKnowledge(vibration_weight=0.0)
