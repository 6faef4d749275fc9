"""Currents measure the torque that the equations of motion ask for, up to constants that a fit finds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.motor_current_drives import (
    EFFICIENCY,
    LOSS,
    RATE,
    ROBOT,
    SOIL,
    TORQUE_CONSTANT,
    VOLTAGE,
    true_drive,
    true_robot,
    true_soil,
)
from ddagr_gym.identification.block_means import sample_windows
from ddagr_gym.identification.gauss_newton import fit
from ddagr_gym.identification.motor_currents import current_model, with_currents, without_currents
from ddagr_gym.identification.nuisances import Nuisances
from ddagr_gym.identification.problem import Problem
from ddagr_gym.identification.window_model import WindowModel, ideal_sensors
from ddagr_gym.identification.windows import CHANNELS, cut_windows
from ddagr_gym.parameters import Drivetrain, Numerics
from ddagr_gym.physics import layout
from ddagr_gym.physics.motor_torque import RECORDED, motor_torques
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.checks.currents import CurrentKind
from ddagr_gym.simulator import Simulator

SIGMA = np.array([0.1, 0.1, 0.01, 0.05, 0.05, 0.02, 0.02, 0.02, 1.0, 1.0])


def rng():
    return np.random.default_rng(0)


def stepped(robot, soil, rate, seconds=3.0):
    """Bank speeds, motor torques and torques of the ground after each sample of a turn."""
    simulator = Simulator(1, numerics=Numerics.smooth())
    simulator.configure(0, robot, soil, ideal_sensors(1.0 / rate))
    simulator.reset()
    commands = np.repeat([[[4.0, 1.0]]], round(seconds * rate), axis=1)
    _, record = simulator.step(commands, recorded=[*RECORDED, *range(layout.AXLE_TORQUE, layout.AXLE_TORQUE + 4)])
    torques, ground = motor_torques(record[0, :, : len(RECORDED)]), record[0, :, len(RECORDED) :]
    return record[0, :, :2], torques, ground[:, :2] + ground[:, 2:]


def test_the_motors_turn_the_banks_against_ground_and_friction():
    """J d omega/dt = T_motor + T_ground - friction, by differences of the simulated speeds."""
    (robot, _), (soil, _) = true_robot(rng()), true_soil(rng())
    rate = 500.0
    speed, torque, ground = stepped(robot, soil, rate)
    drivetrain = robot.drivetrain
    acceleration = (speed[2:] - speed[:-2]) * (0.5 * rate)
    inertia = 1.0 / drivetrain.load_compliance
    middle = speed[1:-1]
    friction = drivetrain.viscous_rate * middle + drivetrain.coulomb_friction * middle / (np.abs(middle) + 0.02)
    balance = inertia * (acceleration + friction) - torque[1:-1] - ground[1:-1]
    moving = slice(round(0.5 * rate), None)
    assert np.abs(torque[moving]).max() > 50.0
    assert np.sqrt(np.mean(balance[moving] ** 2)) < 0.02 * np.abs(torque[moving]).max()


def test_motors_of_an_ideal_loop_carry_the_ground():
    robot = replace(get_robot(ROBOT), drivetrain=Drivetrain())
    _, torque, ground = stepped(robot, get_soil(SOIL), 50.0)
    np.testing.assert_array_equal(torque, -ground)


@pytest.fixture(scope="module", params=list(CurrentKind))
def measured(request):
    """A drive with currents, the model of these, and its windows."""
    drive = true_drive(1, request.param, seconds=60.0, current_rate=5.0)
    robot = get_robot(ROBOT)
    model, said = current_model([drive.recording], robot, rng())
    assert said == ()
    assert model.kind is request.param
    windows = cut_windows([drive.recording], 5.0, wheel_radius=robot.outer_radius, half_track=robot.half_track)
    return drive, model, with_currents(windows, [drive.recording])


def true_model(model, windows):
    """Model of the robot and the soil that drove."""
    draws = np.random.default_rng(1)
    robot, _ = true_robot(draws)
    soil, _ = true_soil(draws)
    return robot, soil, WindowModel(robot, soil, windows, model.parameters, currents=model)


def test_windows_hold_the_currents_of_their_rows(measured):
    drive, _, windows = measured
    assert windows.measured.shape[2] == len(CHANNELS) + 2
    rows = windows.start[3] + 1 + np.arange(windows.samples)
    np.testing.assert_array_equal(windows.measured[3, :, 9], drive.recording["current_left"][rows])
    assert without_currents(windows).measured.shape[2] == len(CHANNELS)


def test_the_other_channels_do_not_know_of_currents(measured):
    _, model, windows = measured
    robot, soil, with_ = true_model(model, windows)
    plain = WindowModel(robot, soil, without_currents(windows), model.parameters)
    values = np.zeros(len(model.parameters))
    prediction = with_.predict(values, windows.initial)
    np.testing.assert_array_equal(prediction[..., :8], plain.predict(values, windows.initial))


def test_derivatives_to_gain_and_offset_are_exact(measured):
    _, model, windows = measured
    *_, simulated = true_model(model, windows)
    values = np.array([0.1 * (k + 1) for k in range(len(model.parameters))])
    base = simulated.predict(values, windows.initial)
    for k, parameter in enumerate(model.parameters):
        found = model.derivative(parameter.name, base, simulated.named(values))
        moved = values.copy()
        moved[k] += 0.5
        change = (simulated.predict(moved, windows.initial) - base) / 0.5
        if found is None:
            assert parameter.name == "current_loss"
            assert np.abs(change[..., 8:]).max() > 0.0
        else:
            np.testing.assert_allclose(found, change, atol=1e-9 * np.abs(change).max())


def test_a_fit_finds_the_unknown_constants(measured):
    _, model, windows = measured
    robot, soil, _ = true_model(model, windows)
    problem = Problem(robot, soil, sample_windows(windows, SIGMA), Nuisances(model.parameters), currents=model)
    fitted = fit(problem, iterations=8)
    constants = model.constants(problem.model.named(fitted.point.values))
    if model.kind is CurrentKind.MOTOR:
        found = [constants["current_gain_right"], constants["current_gain_left"]]
        np.testing.assert_allclose(found, TORQUE_CONSTANT, rtol=0.05)
    else:
        gain = 1.0 / (EFFICIENCY * VOLTAGE)
        np.testing.assert_allclose([constants[f"current_gain_{b}"] for b in ("right", "left")], gain, rtol=0.08)
        assert constants["current_loss"] == pytest.approx(LOSS, rel=0.3)
    left = (windows.measured - fitted.prediction)[..., 8:]
    power = np.nanmean(windows.measured[..., 8:] ** 2)
    assert np.nanmean(left**2) < 0.05 * power


def test_currents_with_the_wrong_sign_are_left_out_with_the_reason():
    recording = true_drive(1, CurrentKind.MOTOR, seconds=120.0, current_rate=RATE).recording
    turned = {**recording.channels, "current_right": -recording["current_right"]}
    model, said = current_model([replace(recording, channels=turned)], get_robot(ROBOT), rng())
    assert model is None
    assert "current_right has the wrong sign" in said[0]


def test_recordings_without_currents_have_no_model():
    recording = true_drive(1, CurrentKind.MOTOR, seconds=20.0).recording
    plain = {name: values for name, values in recording.channels.items() if not name.startswith("current")}
    assert current_model([replace(recording, channels=plain)], get_robot(ROBOT), rng()) == (None, ())
