"""Errors of the filter, by drives whose errors are known."""

import math
from dataclasses import fields

import numpy as np
import pytest

from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.estimation import FilterModel, FilterRun
from ddagr_gym.estimation.dead_reckoning import integrate_track
from ddagr_gym.estimation.layout import CHANNEL_SIZE, OMEGA, STATE_SIZE
from ddagr_gym.evaluation.estimator_metrics import EstimatorErrors, estimator_errors
from ddagr_gym.parameters import Sensors
from ddagr_gym.presets import get_robot

MODEL = FilterModel.of(get_robot("ddagr"), Sensors())
PERIOD = MODEL.sample_period
START = (-0.5, 0.02, 0.01)


def perfect_turn(seconds=18.0):
    """Columns of a drive at 0.2 m/s: 0.5 m straight, then a left circle of 0.8 m, from START."""
    t = np.arange(1, round(seconds / PERIOD) + 1) * PERIOD
    rate = np.where((t > 2.5) & (t <= 2.5 + math.pi * 4.0), 0.25, 0.0)
    x, y, yaw = integrate_track(np.full(t.size, 0.2), np.zeros(t.size), rate, PERIOD).T
    cosine, sine = math.cos(START[2]), math.sin(START[2])
    columns = {
        "t": t, "true_x": START[0] + cosine * x - sine * y, "true_y": START[1] + sine * x + cosine * y,
        "true_yaw": START[2] + yaw, "true_v_x": np.full(t.size, 0.2), "true_v_y": np.zeros(t.size),
        "true_yaw_rate": rate, "true_omega_right": np.full(t.size, 0.9), "true_omega_left": np.full(t.size, 0.6),
        "command_right": np.full(t.size, 0.9), "command_left": np.full(t.size, 0.6),
    }  # fmt: skip
    return columns


def run_with(columns, **factors):
    """Filter run whose states are the truth times factors of its columns."""
    states = np.zeros((len(columns["t"]), STATE_SIZE))
    for entry, name in enumerate(("v_x", "v_y", "yaw_rate")):
        states[:, entry] = columns[f"true_{name}"] * factors.get(name, 1.0)
    states[:, OMEGA], states[:, OMEGA + 1] = columns["true_omega_right"], columns["true_omega_left"]
    states[:, 5:9] = MODEL.soil_prior.logs(MODEL.wheel_load)[0]
    standardised = np.full((len(states), CHANNEL_SIZE), np.nan)
    standardised[:, 2:] = 1.5
    return FilterRun(columns["t"], states, np.zeros((len(states), STATE_SIZE, STATE_SIZE)), standardised)


def test_track_of_a_circle_closes():
    steps = 4000
    rate = 2.0 * math.pi / (steps * 0.01)
    speed = np.full(steps, 0.5)
    speed[0] = 0.5
    track = integrate_track(speed, np.zeros(steps), np.full(steps, rate), 0.01)
    assert track[-1, 2] == pytest.approx(2.0 * math.pi, rel=1e-3)
    assert np.hypot(track[:, 0], track[:, 1] - 0.5 / rate) == pytest.approx(0.5 / rate, rel=2e-3)


def test_the_truth_has_no_error():
    columns = perfect_turn()
    found = estimator_errors(MODEL, columns, RowTurn(run_in=0.5), START, run_with(columns))
    assert found.speed_rms == found.yaw_rate_rms == found.slip_rms == 0.0
    assert found.radius == pytest.approx(0.0, abs=1e-12)
    assert found.dead_reckoning == pytest.approx(0.0, abs=1e-9)
    assert found.innovation == pytest.approx(2.25)


def test_a_speed_five_percent_too_high_shows_as_such():
    columns = perfect_turn()
    found = estimator_errors(MODEL, columns, RowTurn(run_in=0.5), START, run_with(columns, v_x=1.05))
    assert found.speed_rms == pytest.approx(0.01, rel=1e-6)
    assert found.radius == pytest.approx(0.05, rel=1e-6)
    # the exit is 0.5 m back and 1.6 m aside; both grow by 5 % of themselves, over a path of 0.5 + 0.8 pi
    assert found.dead_reckoning == pytest.approx(0.05 * math.hypot(0.5, 1.6) / (0.5 + 0.8 * math.pi), rel=0.02)


def test_a_yaw_rate_too_high_makes_the_radius_small():
    columns = perfect_turn()
    found = estimator_errors(MODEL, columns, RowTurn(run_in=0.5), START, run_with(columns, yaw_rate=1.1))
    assert found.radius == pytest.approx(1 / 1.1 - 1)
    assert found.yaw_rate_rms > 0.015


def test_prediction_of_the_filters_own_motion_is_exact():
    from ddagr_gym.estimation import roll_out

    state = np.zeros(STATE_SIZE)
    state[:5] = [0.2, 0.0, 0.0, 0.75, 0.75]
    state[5:9] = MODEL.soil_prior.logs(MODEL.wheel_load)[0]
    commands = np.tile([1.3, 0.2], (1500, 1))
    states = roll_out(MODEL, state, commands)
    pose = integrate_track(states[:, 0], states[:, 1], states[:, 2], PERIOD)
    columns = {
        "t": np.arange(1, 1501) * PERIOD, "true_x": pose[:, 0], "true_y": pose[:, 1], "true_yaw": pose[:, 2],
        "true_v_x": states[:, 0], "true_v_y": states[:, 1], "true_yaw_rate": states[:, 2],
        "true_omega_right": states[:, OMEGA], "true_omega_left": states[:, OMEGA + 1],
        "command_right": commands[:, 0], "command_left": commands[:, 1],
    }  # fmt: skip
    run = FilterRun(columns["t"], states, np.zeros((1500, STATE_SIZE, STATE_SIZE)), np.ones((1500, CHANNEL_SIZE)))
    found = estimator_errors(MODEL, columns, RowTurn(run_in=5.0), (0.0, 0.0, 0.0), run)
    assert found.prediction_1s < 1e-9
    assert found.prediction_5s < 1e-9
    wrong = run._replace(states=states * np.where(np.arange(STATE_SIZE) == 5, 0.93, 1.0))
    assert estimator_errors(MODEL, columns, RowTurn(run_in=5.0), (0.0, 0.0, 0.0), wrong).prediction_5s > 0.02


def test_short_drives_leave_things_undefined():
    columns = {name: values[:100] for name, values in perfect_turn().items()}
    found = estimator_errors(MODEL, columns, RowTurn(run_in=0.5), START, run_with(columns))
    assert found.radius is None
    assert found.prediction_1s is None
    assert found.prediction_5s is None
    assert {field.name for field in fields(EstimatorErrors)} >= {"dead_reckoning", "innovation"}
