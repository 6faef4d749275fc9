"""Simulations that follow a recorded one: what they predict, and what they leave alone."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.control.manoeuvres import MANOEUVRES
from ddagr_gym.identification.fit_numerics import FOLLOWED_CHANGE, block_mean_numerics, reference_numerics
from ddagr_gym.parameters import Numerics
from ddagr_gym.physics import layout
from ddagr_gym.physics.force_record import ENTRY, FOLLOWS, FULL, IDLE, RECORDS, ForceRecord, new_record, to_follow
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.simulator import Simulator

ROBOT, SOIL = get_robot("ddagr"), get_soil("thesis_a1")
NUMERICS = reference_numerics(block_mean_numerics())
FINE = Numerics(
    contact_nodes=4, jacobian_contact_nodes=4, maximum_step=0.002, jacobian_refresh=0.0, force_extrapolation=0.0,
    accepted_error=1e-4, minimum_shear_rate=0.02, rest_speed=0.01,
)  # fmt: skip
SAMPLES = 200
COMMANDS = np.ascontiguousarray(np.stack([MANOEUVRES[name].commands(50.0)[:SAMPLES] for name in ("arcs", "spin")]))
"""From rest: two seconds of an arc, and of a turn on the spot."""
READINGS = slice(0, 5)


def _drive(forces: ForceRecord | None, numerics: Numerics = NUMERICS, threads: int = 1, **changed: float):
    """Readings (2, T, 5) of two robots with changed entries of their rows, and the rows afterwards."""
    simulator = Simulator(2, numerics=numerics, threads=threads)
    for n in range(2):
        simulator.configure(n, ROBOT, SOIL)
        simulator.rows[n, layout.SAMPLE_PERIOD] = 0.02
    for name, change in changed.items():
        simulator.rows[:, getattr(layout, name)] *= 1.0 + change
    for name in ("ACCELEROMETER_NOISE", "GYRO_NOISE", "ENCODER_NOISE", "ENCODER_COUNTS", "GYRO_RESOLUTION"):
        simulator.rows[:, getattr(layout, name)] = 0.0
    simulator.rows[:, layout.ACCELEROMETER_RESOLUTION] = 0.0
    simulator.reset()
    readings, record = np.empty((2, SAMPLES, 8)), np.empty((2, SAMPLES, 0))
    noise, nothing = np.zeros((2, SAMPLES, layout.NOISE_CHANNELS)), np.zeros(0, dtype=np.int64)
    simulator.advance(COMMANDS, noise, nothing, readings, record, forces=forces)
    return readings[..., READINGS], simulator.rows


@pytest.fixture(scope="module")
def recorded():
    """A record, and the readings of the simulation that made it."""
    record = new_record(2, SAMPLES, 1, FOLLOWED_CHANGE)
    readings, _ = _drive(record)
    assert (record.state[:, 0] == RECORDS).all()
    return record, readings


def test_recording_changes_no_bit(recorded):
    np.testing.assert_array_equal(recorded[1], _drive(None)[0])


def test_who_follows_without_a_difference_drives_the_same(recorded):
    record, readings = recorded
    follows = to_follow(record)
    again, _ = _drive(follows)
    np.testing.assert_allclose(again, readings, atol=2e-4)
    np.testing.assert_array_equal(follows.state[:, 1:], record.state[:, 1:])  # all entries and decisions, no more
    np.testing.assert_array_equal(_drive(to_follow(record), threads=2)[0], again)


@pytest.mark.parametrize("entry", ["BASE_MOTOR_RATE", "HALF_TRACK", "BASE_SOIL", "BASE_WHEEL"])
def test_differences_to_it_are_those_of_accurate_simulations(recorded, entry):
    """Cohesion under one wheel and the radius of one wheel, too, whose forces are evaluated."""
    step = 1e-3
    followed = (_drive(to_follow(recorded[0]), **{entry: step})[0] - _drive(to_follow(recorded[0]))[0]) / step
    up, down = (_drive(None, FINE, **{entry: sign * 0.01})[0] for sign in (1.0, -1.0))
    accurate = (up - down) / 0.02
    away = np.sqrt(((followed - accurate) ** 2).mean(axis=(0, 1)))
    assert (away < 0.15 * np.sqrt((accurate**2).mean(axis=(0, 1))) + 1e-9).all(), away


def test_what_differs_far_is_evaluated(recorded):
    """A robot at half the speed of the motors: nothing of the record is near it."""
    far, _ = _drive(to_follow(recorded[0]), BASE_MOTOR_RATE=-0.5)
    alone, _ = _drive(None, BASE_MOTOR_RATE=-0.5)
    np.testing.assert_allclose(far[..., 2:], alone[..., 2:], atol=0.02)


def test_of_a_record_without_room_nothing_is_followed():
    record = new_record(2, SAMPLES, 1, FOLLOWED_CHANGE)
    narrow = record._replace(entries=record.entries[:, :50].copy())
    readings, _ = _drive(narrow)
    assert (narrow.state[:, 0] == FULL).all()
    follows = to_follow(narrow)
    assert (follows.state[:, 0] == IDLE).all()
    np.testing.assert_array_equal(_drive(follows)[0], readings)


def test_more_environments_than_there_is_memory_for_record_in_part(monkeypatch):
    monkeypatch.setattr("ddagr_gym.physics.force_record._MEMORY", 8 * ENTRY * 8 * SAMPLES)
    record = new_record(2, SAMPLES, 1, FOLLOWED_CHANGE)
    assert record.entries.shape[0] == 1
    readings, _ = _drive(record)
    assert record.state[:, 0].tolist() == [RECORDS, IDLE]
    follows = to_follow(record)
    assert follows.state[:, 0].tolist() == [FOLLOWS, IDLE]
    np.testing.assert_array_equal(_drive(follows)[0][1], readings[1])
