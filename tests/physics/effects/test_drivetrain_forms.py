"""Forms of the motor effects that stand for parts of a drivetrain, against closed forms and against such a robot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.parameters import Drivetrain
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects import parse_effect
from ddagr_gym.physics.effects.base import DriveExtent
from ddagr_gym.physics.effects.motor_saturation import MotorSaturation
from ddagr_gym.simulator import Simulator, simulate
from tests.physics.effects.conftest import IDEAL

PERIOD = 0.008
RATE = 4.5
TURNS = np.repeat([(0.0, 0.0), (0.7, 0.7), (0.9, 0.4), (0.4, 0.8), (0.5, -0.3)], [60, 250, 400, 400, 300], axis=0)
BANKS = ("true_omega_right", "true_omega_left")


def speeds(columns):
    return np.stack([columns[name] for name in BANKS], axis=1)


def robot_speeds(robot, soil, **parts):
    """Bank speeds of a robot that has parts of a drivetrain."""
    return speeds(simulate(replace(robot, drivetrain=Drivetrain(**parts)), soil, TURNS, sensors=IDEAL))


def test_a_limit_of_the_turning_is_that_of_a_robots_drivetrain(drive, robot, soil):
    limited = speeds(drive(["motor_saturation=1000,turning_limit=0.15"], TURNS))
    np.testing.assert_allclose(limited, robot_speeds(robot, soil, turning_limit=0.15), rtol=0.0, atol=1e-9)
    assert np.abs(limited - speeds(drive((), TURNS))).max() > 0.05


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_mean_stays_where_the_turning_is_limited(act, turning_row, sign):
    row = turning_row.copy()
    row[layout.MOTOR_TARGET : layout.MOTOR_TARGET + 2] = 0.6 + 0.4 * sign, 0.6 - 0.4 * sign
    changed = act(parse_effect("motor_saturation=1000,turning_limit=0.1"), row)
    aims = changed[layout.MOTOR_TARGET : layout.MOTOR_TARGET + 2]
    np.testing.assert_allclose(aims, (0.6 + 0.1 * sign, 0.6 - 0.1 * sign), atol=1e-15)


def test_narrower_turns_are_left_as_they_are_to_the_bit(act, turning_row):
    row = turning_row.copy()
    row[layout.MOTOR_TARGET : layout.MOTOR_TARGET + 2] = 0.7, 0.1
    np.testing.assert_array_equal(act(parse_effect("motor_saturation=1000,turning_limit=0.31"), row), row)


def test_a_limit_of_the_turning_matters_where_the_drive_turns_as_much():
    extent = DriveExtent(wheel_speed=1.0, turning=0.4)
    assert MotorSaturation(1e3, turning_limit=0.37).is_meaningful(extent)
    assert not MotorSaturation(1e3, turning_limit=0.5).is_meaningful(extent)
    probed = [probe.turning_limit for probe in MotorSaturation.probes(extent) if probe.turning_limit < 1e3]
    assert probed == pytest.approx([0.36, 0.24])


@pytest.mark.parametrize(("form", "part", "most"), [("torque", "acceleration", 0.5), ("power", "power", 0.2)])
def test_limits_of_torque_and_power_are_those_of_a_robots_drivetrain(robot, soil, form, part, most):
    """Banks that the ground resists: the limit holds against its load."""
    loop = {"integral_rate": 10.0, "load_compliance": 1.0 / 64.0}
    loaded = replace(robot, drivetrain=Drivetrain(**loop))
    effects = [f"motor_saturation=1000,{form}_limit={64.0 * most}"]
    limited = speeds(simulate(loaded, soil, TURNS, effects=effects, sensors=IDEAL))
    np.testing.assert_array_equal(limited, robot_speeds(robot, soil, **loop, **{f"{part}_limit": most}))
    assert np.abs(limited - speeds(simulate(loaded, soil, TURNS, sensors=IDEAL))).max() > 0.05


def test_a_higher_limit_of_the_torque_leaves_the_robots_own(robot, soil):
    own = replace(robot, drivetrain=Drivetrain(load_compliance=0.01, acceleration_limit=0.5))
    limited = simulate(own, soil, TURNS, effects=["motor_saturation=1000,torque_limit=200"], sensors=IDEAL)
    np.testing.assert_array_equal(speeds(limited), speeds(simulate(own, soil, TURNS, sensors=IDEAL)))


def test_torque_and_power_are_probed_at_shares_of_full_traction():
    probes = MotorSaturation.probes(DriveExtent(traction=200.0, wheel_speed=0.5))
    torques = [probe.torque_limit for probe in probes if probe.torque_limit < 1e5]
    powers = [probe.power_limit for probe in probes if probe.power_limit < 1e5]
    assert torques == pytest.approx([60.0, 30.0, 16.0])
    assert powers == pytest.approx([20.0, 10.0, 5.0])
    weak = MotorSaturation(1e3, torque_limit=210.0)
    assert weak.is_meaningful(DriveExtent(traction=250.0))
    assert not weak.is_meaningful(DriveExtent(traction=200.0))


SPIN = np.repeat([(0.0, 0.0), (0.6, -0.6)], [30, 900], axis=0)


def loads(robot, soil, commands, effects=()):
    """Bank speeds (T, 2) and torques of the ground about the axles of each bank (T, 2) [N m]."""
    simulator = Simulator(1, effects=effects)
    simulator.configure(0, robot, soil, IDEAL)
    simulator.reset()
    entries = (*range(layout.OMEGA, layout.OMEGA + 2), *range(layout.AXLE_TORQUE, layout.AXLE_TORQUE + 4))
    record = simulator.step(commands[None], recorded=entries)[1][0]
    return record[:, :2], record[:, 2:4] + record[:, 4:6]


def test_an_ideal_loop_carries_the_load_up_to_its_limit(robot, soil):
    """What it never reaches changes nothing but the order of the time step."""
    speed, torque = loads(robot, soil, SPIN)
    most = np.abs(torque).max()
    limit = 1.5 * most + robot.mass * robot.outer_radius**2 * robot.motor_rate * 0.6
    limited, _ = loads(robot, soil, SPIN, [f"motor_saturation=1000,torque_limit={limit}"])
    np.testing.assert_allclose(limited, speed, atol=1e-4)


@pytest.mark.parametrize("share", [0.9, 0.7])
def test_a_weak_ideal_loop_turns_as_fast_as_the_ground_lets_its_torque(robot, soil, share):
    _, torque = loads(robot, soil, SPIN)
    most = share * np.abs(torque[-1]).min()
    effect = f"motor_saturation=1000,torque_limit={most}"
    limited, found = loads(robot, soil, SPIN, [effect])
    np.testing.assert_allclose(np.abs(found[-1]), most, rtol=1e-3)
    assert 0.0 < abs(limited[-1, 0]) < 0.55


def test_power_is_torque_times_speed_of_a_weak_ideal_loop(robot, soil):
    _, torque = loads(robot, soil, SPIN)
    power = 0.4 * np.abs(torque[-1]).min() * 0.6
    effect = f"motor_saturation=1000,power_limit={power}"
    speed, found = loads(robot, soil, SPIN, [effect])
    np.testing.assert_allclose(np.abs(speed[-1] * found[-1]), power, rtol=2e-2)


def test_a_loop_too_weak_for_the_ground_stands_still(robot, soil):
    limited, _ = loads(robot, soil, SPIN, ["motor_saturation=1000,torque_limit=0.7"])
    assert np.abs(limited[-1]).max() < 0.01


@pytest.mark.parametrize("recovery", [0.5, 2.0])
def test_without_load_recovery_is_the_integral_part_of_a_loop(drive, recovery):
    """A step of (k s + k_i)/(s^2 + k s + k_i) with k_i = k recovery."""
    commands = np.repeat([0.0, 0.6], [20, 500])[:, None].repeat(2, axis=1)
    speed = drive([f"motor_droop=0,recovery={recovery}"], commands)["true_omega_right"][20:]
    poles = np.roots([1.0, RATE, RATE * recovery]).astype(complex)
    time = PERIOD * np.arange(1, 501)
    step = 1.0 + sum((RATE * p + RATE * recovery) / (p * (2.0 * p + RATE)) * np.exp(p * time) for p in poles)
    np.testing.assert_allclose(speed, 0.6 * step.real, atol=3e-3)
    assert speed.max() > 0.63


@pytest.mark.parametrize(("droop", "recovery"), [(0.002, 0.7), (0.001, 2.0)])
def test_recovery_is_the_loop_of_a_robot_that_the_ground_resists(drive, robot, soil, droop, recovery):
    """1/J = droop k and k_i = recovery k; the torque is followed over 0.1 s."""
    effect = speeds(drive([f"motor_droop={droop},recovery={recovery}"], TURNS))
    true = robot_speeds(robot, soil, integral_rate=recovery * RATE, load_compliance=droop * RATE)
    error = np.sqrt(np.mean((effect - true) ** 2))
    nominal = np.sqrt(np.mean((speeds(drive((), TURNS)) - true) ** 2))
    droops = np.sqrt(np.mean((speeds(drive([f"motor_droop={droop}"], TURNS)) - true) ** 2))
    assert error < 0.2 * min(nominal, droops)


def test_a_loss_that_has_lasted_is_taken_back_where_a_drive_begins(act, turning_row):
    row = turning_row.copy()
    row[layout.AXLE_TORQUE : layout.AXLE_TORQUE + 4] = (-15.0, 5.0, -15.0, 5.0)
    target = row[layout.MOTOR_TARGET : layout.MOTOR_TARGET + 2].copy()
    row[layout.OMEGA : layout.OMEGA + 2] = target
    for recovery, left in ((0.0, 1.0), (0.2, np.exp(-1.0)), (4.0, 0.0)):
        aims = act(parse_effect(f"motor_droop=0.002,recovery={recovery}"), row)[
            layout.MOTOR_TARGET : layout.MOTOR_TARGET + 2
        ]
        np.testing.assert_allclose(aims - target, left * np.array([-0.06, 0.02]), atol=1e-8)


def test_a_loss_is_taken_back_at_the_rate_of_the_integral_part(turning_row):
    """A constant torque from rest of the memory on: the loss falls by about exp(-recovery t)."""
    effect = parse_effect("motor_droop=0.002,recovery=0.4")
    row, memory, lost = turning_row.copy(), np.zeros(layout.EFFECT_MEMORY), []
    row[layout.OMEGA : layout.OMEGA + 2] = 0.6
    row[layout.AXLE_TORQUE : layout.AXLE_TORQUE + 4] = 0.0
    for k in range(1300):
        row[layout.MOTOR_TARGET : layout.MOTOR_TARGET + 2] = 0.6
        if k == 50:
            row[layout.AXLE_TORQUE : layout.AXLE_TORQUE + 4] = -15.0
        effect.actions[0][1](row, effect.vector(), memory)
        lost.append(0.6 - row[layout.MOTOR_TARGET])
    assert max(lost) == pytest.approx(0.06, rel=0.15)
    slow = min(-np.roots([1.0, RATE, 0.4 * RATE]).real)
    later = np.array(lost[700:1300])
    np.testing.assert_allclose(later[300] / later[0], np.exp(-slow * 300 * PERIOD), rtol=0.03)


def test_recovery_comes_to_rest_and_forgets_a_reversed_command(drive):
    commands = np.repeat([0.7, -0.7, 0.0], [250, 250, 1500])[:, None].repeat(2, axis=1)
    columns = drive(["motor_droop=0.002,recovery=2"], commands)
    assert np.abs(columns["true_omega_right"][-50:]).max() < 2e-3
    assert np.abs(columns["specific_force_x"][-50:]).max() < 0.02
