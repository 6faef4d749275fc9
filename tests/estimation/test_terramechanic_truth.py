"""Mismatch: the filter on drives of the full terramechanic simulator, which it knows nothing of."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.estimation import FilterModel, FilterNoise, ThesisModel, run_filter, run_thesis_filter
from ddagr_gym.parameters import Imu, Sensors, Soil
from ddagr_gym.presets import get_soil
from ddagr_gym.simulator import simulate

PERIOD = 0.008

WEAKER = Soil(
    cohesion=1700.0,
    friction_angle=math.radians(15.0),
    sinkage_exponent=0.6,
    cohesive_modulus=8000.0,
    frictional_modulus=4.0e5,
    shear_modulus=0.014,
    peak_stress_coefficient_0=0.4,
    peak_stress_coefficient_1=0.3,
    exit_angle_ratio=0.5,
)
STIFFER = replace(
    WEAKER, cohesion=5000.0, friction_angle=math.radians(30.0), frictional_modulus=2.5e6, shear_modulus=0.006
)
SOILS = {"thesis_a1": get_soil("thesis_a1"), "weaker": WEAKER, "stiffer": STIFFER}


def turn(side, inner=0.15, outer=1.05):
    """Commands: 5 s straight, 12 s turn, 3 s straight."""
    t = np.arange(0.0, 20.0, PERIOD)
    commands = np.full((t.size, 2), 0.701)
    commands[(t >= 5) & (t < 17)] = [outer, inner] if side == "left" else [inner, outer]
    return commands, (t >= 7) & (t < 16)


def radius_error(run, drive, window):
    path = run.states[window, 0].sum() / run.states[window, 2].sum()
    return path / (drive["true_v_x"][window].sum() / drive["true_yaw_rate"][window].sum()) - 1.0


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("soil", SOILS)
def test_speed_and_radius(robot, soil, side):
    commands, window = turn(side)
    sensors = Sensors(imu=replace(Imu(), gyro_bias=2e-3))
    drive = simulate(robot, SOILS[soil], commands, sensors=sensors, seed=4)
    run = run_filter(FilterModel(robot, noise=FilterNoise.from_sensors(sensors)), drive)
    assert abs(radius_error(run, drive, window)) < 0.06
    assert np.sqrt(np.mean((run.states[200:, 0] - drive["true_v_x"][200:]) ** 2)) < 8e-3
    np.testing.assert_allclose(run.states[window, 2], drive["true_yaw_rate"][window], atol=2e-3)


def test_table_6_2_with_one_bank_locked(robot):
    t = np.arange(0.0, 25.0, PERIOD)
    commands = np.full((t.size, 2), 0.701)
    commands[(t >= 5) & (t < 22.5)] = [0.0, 1.195]
    drive = simulate(robot, SOILS["thesis_a1"], commands, seed=3)
    window = (t > 8) & (t < 20)
    ours = run_filter(FilterModel(robot), drive)
    assert abs(radius_error(ours, drive, window)) < 0.08
    # the thesis's law lets a locked wheel stick: its radius is the half track, 0.58 m instead of 0.733 m
    thesis = run_thesis_filter(ThesisModel(robot), drive)
    assert radius_error(thesis, drive, window) == pytest.approx(0.58 / 0.733 - 1, abs=0.02)


def test_a_rough_biased_accelerometer_does_little_harm(robot):
    commands, window = turn("left")
    imu = replace(Imu(), accelerometer_bias=(0.2, -0.15), accelerometer_noise=0.07, accelerometer_vibration=1.0)
    drive = simulate(robot, SOILS["thesis_a1"], commands, sensors=Sensors(imu=imu), seed=5)
    run = run_filter(FilterModel(robot), drive)
    assert abs(radius_error(run, drive, window)) < 0.06


def test_slow_motors(robot):
    # motor rate 1.4 of the experiment where the filter believes 4.5
    commands, window = turn("right")
    drive = simulate(replace(robot, motor_rate=1.4), SOILS["thesis_a1"], commands, seed=6)
    run = run_filter(FilterModel(robot), drive)
    assert abs(radius_error(run, drive, window)) < 0.06
    assert np.sqrt(np.mean((run.states[200:, 0] - drive["true_v_x"][200:]) ** 2)) < 12e-3
