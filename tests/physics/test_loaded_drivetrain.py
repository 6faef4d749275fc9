"""The drivetrain between command and wheel: steady states, limits, order of the time step, energy, and the past."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ddagr_gym.parameters import Drivetrain, Imu, Numerics, Sensors
from ddagr_gym.physics import layout
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.simulator import Simulator, simulate

DDAGR, WARTHOG = get_robot("ddagr"), get_robot("warthog")
CLAY, FIRM = get_soil("thesis_a1"), get_soil("firm_ground")
NOISELESS = Sensors(imu=Imu(accelerometer_noise=0.0, gyro_noise=0.0, accelerometer_resolution=0.0, gyro_resolution=0.0))
MOTION = (
    "true_v_x", "true_v_y", "true_yaw_rate", "true_x", "true_y", "true_yaw", "true_omega_right", "true_omega_left",
)  # fmt: skip


def _with(robot, **drivetrain):
    return replace(robot, drivetrain=Drivetrain(**drivetrain))


def _drive(robot, commands, soil=CLAY, **options):
    return simulate(robot, soil, commands, sensors=NOISELESS, **options)


def _steps(*pieces):
    """(T, 2) from (seconds, right, left) at 125 Hz."""
    return np.concatenate([np.tile(pair, (round(125 * seconds), 1)) for seconds, *pair in pieces])


def _settled(robot, right, left, soil=CLAY, share=1.0):
    """Row after 12 s of a command that begin at a share of its speeds."""
    simulator = Simulator(1)
    simulator.configure(0, robot, soil, NOISELESS)
    simulator.reset(
        state={
            "omega_right": share * right,
            "omega_left": share * left,
            "v_x": 0.9 * share * robot.outer_radius * right,
        }
    )
    simulator.step(np.array([[right, left]]), samples=1500)
    return simulator.rows[0]


# Steady states


def _torques(row):
    torque = row[layout.AXLE_TORQUE : layout.AXLE_TORQUE + 4]
    return torque[0] + torque[2], torque[1] + torque[3]


def test_proportional_loop_droops_by_the_torque_of_the_ground():
    compliance = 0.02
    row = _settled(_with(DDAGR, load_compliance=compliance), 1.2, 0.6)
    for bank, command in enumerate((1.2, 0.6)):
        droop = compliance * _torques(row)[bank] / DDAGR.motor_rate
        assert row[layout.OMEGA + bank] == pytest.approx(command + droop, rel=1e-6)
        assert abs(droop) > 0.01


def test_integral_part_brings_the_commanded_speed_back():
    row = _settled(
        _with(DDAGR, load_compliance=0.02, integral_rate=3.0, viscous_rate=0.2, coulomb_friction=0.1), 1.2, 0.6
    )
    np.testing.assert_allclose(row[layout.OMEGA : layout.OMEGA + 2], [1.2, 0.6], rtol=5e-4)


def test_viscous_friction_lowers_the_gain():
    row = _settled(_with(DDAGR, viscous_rate=0.5), 1.0, 1.0)
    gain = DDAGR.motor_rate / (DDAGR.motor_rate + 0.5)
    np.testing.assert_allclose(row[layout.OMEGA : layout.OMEGA + 2], gain, rtol=1e-9)


def test_coulomb_friction_takes_its_share_of_the_drive():
    row = _settled(_with(DDAGR, coulomb_friction=0.3), 1.0, 1.0)
    speed = row[layout.OMEGA]
    assert DDAGR.motor_rate * (1.0 - speed) == pytest.approx(0.3 * speed / (speed + 0.02), rel=1e-6)


def test_speed_ends_where_the_falling_torque_limit_meets_the_load():
    row = _settled(_with(DDAGR, load_compliance=0.02, acceleration_limit=4.0, no_load_speed=1.6), 1.9, 1.9)
    speed = row[layout.OMEGA]
    assert 4.0 * (1.0 - speed / 1.6) == pytest.approx(-0.02 * _torques(row)[0], rel=1e-6)


def test_speed_ends_where_the_power_is_spent():
    row = _settled(_with(DDAGR, load_compliance=0.02, power_limit=0.18), 1.9, 1.9, share=0.735)
    assert 0.18 / row[layout.OMEGA] == pytest.approx(-0.02 * _torques(row)[0], rel=2e-3)
    assert row[layout.OMEGA] < 1.6


# Commands on their way


def test_commands_act_after_the_delay_and_the_ramp_and_outside_the_deadband():
    late = _drive(_with(DDAGR, command_delay=0.4), _steps((1.0, 1.0, 0.5)))
    prompt = _drive(DDAGR, _steps((1.0, 1.0, 0.5)))
    assert not late["true_omega_right"][:50].any()
    np.testing.assert_allclose(late["true_omega_right"][50:], prompt["true_omega_right"][:-50], atol=1e-12)
    ramped = _drive(_with(DDAGR, command_ramp=0.5), _steps((4.0, 1.0, 0.05)))["true_omega_right"]
    slope = np.diff(ramped)[150:240] * 125.0
    np.testing.assert_allclose(slope, 0.5, rtol=0.02)
    assert ramped[-1] == pytest.approx(1.0, abs=1e-3)
    dead = _drive(_with(DDAGR, command_deadband=0.1), _steps((1.0, 1.0, 0.05)))
    assert not dead["true_omega_left"].any()
    np.testing.assert_allclose(dead["true_omega_right"], prompt["true_omega_right"], atol=1e-12)


def _speeds(drive) -> np.ndarray:
    """(T, 2) mean of both banks, and how far the right one is from it [rad/s]."""
    right, left = drive["true_omega_right"], drive["true_omega_left"]
    return np.column_stack([right + left, right - left]) / 2.0


def test_ramps_of_mean_and_turning_limit_each_at_its_own_rate():
    """A drive controller limits acceleration and yaw acceleration: a turn leaves the speed alone."""
    ramps = _with(DDAGR, mean_ramp=0.4, turning_ramp=0.25)
    found = _speeds(_drive(ramps, _steps((4.0, 1.0, 1.0), (4.0, 1.4, 0.6))))
    plain = _speeds(_drive(_with(DDAGR, mean_ramp=0.4), _steps((4.0, 1.0, 1.0), (4.0, 1.0, 1.0))))
    np.testing.assert_allclose(np.diff(found[150:240, 0]) * 125.0, 0.4, rtol=0.02)
    np.testing.assert_allclose(np.diff(found[625:680, 1]) * 125.0, 0.25, rtol=0.06)
    np.testing.assert_allclose(found[:, 0], plain[:, 0], atol=1e-12)
    np.testing.assert_allclose(found[-1], [1.0, 0.4], atol=1e-3)


@pytest.mark.parametrize(("ramp", "commands"), [("mean_ramp", (0.9, 0.9)), ("turning_ramp", (0.9, -0.9))])
def test_either_ramp_is_the_ramp_of_each_bank_where_it_acts_alone(ramp, commands):
    steps = _steps((2.0, *commands), (2.0, *(-c for c in commands)))
    by_both = _drive(_with(DDAGR, **{ramp: 0.7}), steps)
    by_bank = _drive(_with(DDAGR, command_ramp=0.7), steps)
    for name in ("true_omega_right", "true_omega_left"):
        np.testing.assert_allclose(by_both[name], by_bank[name], atol=1e-12)


def test_a_dead_time_may_stand_before_or_behind_the_ramps():
    late = _drive(_with(DDAGR, mean_ramp=0.7, turning_ramp=0.3, command_delay=0.4), _steps((2.0, 1.0, 0.2)))
    prompt = _drive(_with(DDAGR, mean_ramp=0.7, turning_ramp=0.3), _steps((2.0, 1.0, 0.2)))
    np.testing.assert_allclose(late["true_omega_left"][50:], prompt["true_omega_left"][:-50], atol=1e-12)


def test_a_filter_of_the_commands_is_a_second_pole_before_the_loop():
    """As the effect ``motor_lag`` with all of its lag in a second pole, which has a memory of its own."""
    commands = _steps((0.5, 1.0, 0.5), (0.5, 0.2, -0.4))
    of_robot = _drive(_with(DDAGR, command_filter=0.3), commands)
    of_effect = _drive(DDAGR, commands, effects=["motor_lag=0.3,second_pole=1"])
    np.testing.assert_allclose(of_robot["true_omega_right"], of_effect["true_omega_right"], atol=1e-12)
    time = np.arange(1, 63) / 125.0
    rate = DDAGR.motor_rate
    answer = 1.0 - (rate * np.exp(-time / 0.3) - np.exp(-rate * time) / 0.3) / (rate - 1.0 / 0.3)
    np.testing.assert_allclose(of_robot["true_omega_right"][:62], answer, atol=2e-3)


def test_a_filter_and_a_dead_time_may_come_in_any_order():
    late = _drive(_with(DDAGR, command_filter=0.3, command_delay=0.4), _steps((1.0, 1.0, 0.5)))
    prompt = _drive(_with(DDAGR, command_filter=0.3), _steps((1.0, 1.0, 0.5)))
    np.testing.assert_allclose(late["true_omega_left"][50:], prompt["true_omega_left"][:-50], atol=1e-12)


def test_a_short_filter_counts_in_proportion_to_its_length():
    commands = _steps((1.0, 1.0, 0.5))
    plain, short, shorter = (
        _drive(_with(DDAGR, command_filter=tau), commands)["true_omega_right"] for tau in (0.0, 4e-4, 2e-4)
    )
    np.testing.assert_allclose(plain - short, 2.0 * (plain - shorter), atol=2e-5)
    assert np.abs(plain - short).max() > 1e-3


@pytest.mark.parametrize("samples", [5.25, 5.9])
def test_a_dead_time_before_a_ramp_is_one_behind_it_also_between_samples(samples):
    """As the effect ``command_delay``, which has a memory of its own."""
    commands, delay = _steps((0.5, 1.0, 0.5), (0.5, 0.2, -0.4)), samples / 125.0
    of_robot = _drive(_with(DDAGR, command_ramp=1.0, command_delay=delay), commands)
    of_effect = _drive(_with(DDAGR, command_ramp=1.0), commands, effects=[f"command_delay={delay}"])
    shorter, longer = (
        _drive(_with(DDAGR, command_ramp=1.0, command_delay=number / 125.0), commands)["true_omega_left"]
        for number in (5, 6)
    )
    np.testing.assert_allclose(of_robot["true_omega_left"], of_effect["true_omega_left"], atol=1e-12)
    between = (6 - samples) * shorter + (samples - 5) * longer
    np.testing.assert_allclose(of_robot["true_omega_left"], between, atol=1e-12)


@pytest.mark.parametrize(
    ("command", "reached"),
    [((1.5, -1.5), (0.4, -0.4)), ((1.6, 0.0), (1.2, 0.4)), ((-1.0, 0.6), (-0.6, 0.2)), ((1.5, 0.9), (1.5, 0.9))],
)
def test_banks_differ_by_no_more_than_the_turning_limit_and_keep_their_mean(command, reached):
    drive = _drive(_with(DDAGR, turning_limit=0.4), _steps((4.0, *command)))
    assert [drive[f"true_omega_{bank}"][-1] for bank in ("right", "left")] == pytest.approx(reached, abs=1e-3)


def test_turning_is_limited_before_each_bank_is():
    """A controller brings the banks together first; what is then above the highest speed is cut."""
    drive = _drive(_with(replace(DDAGR, maximum_wheel_speed=1.0), turning_limit=0.4), _steps((4.0, 2.2, 0.2)))
    assert drive["true_omega_right"][-1] == pytest.approx(1.0, abs=1e-3)
    assert drive["true_omega_left"][-1] == pytest.approx(0.8, abs=1e-3)


@pytest.mark.parametrize("limit", [2.0, 0.5])
def test_bank_speeds_up_no_faster_than_its_torque_allows(limit):
    speed = _drive(_with(DDAGR, acceleration_limit=limit), _steps((1.0, 1.5, -1.5)))["true_omega_right"]
    assert np.diff(speed).max() * 125.0 <= limit * (1.0 + 1e-9)
    assert speed[10] == pytest.approx(11 * 0.008 * limit, rel=1e-6)


def test_weaker_bank_speeds_up_more_slowly():
    drive = _drive(_with(DDAGR, acceleration_limit=1.0, limit_imbalance=0.3), _steps((0.4, 1.5, 1.5)))
    assert drive["true_omega_right"][-1] / drive["true_omega_left"][-1] == pytest.approx(1.3 / 0.7, rel=1e-9)


def test_integral_part_does_not_wind_up_behind_a_limit():
    robot = _with(DDAGR, integral_rate=10.0, acceleration_limit=1.0)
    speed = _drive(robot, _steps((3.0, 1.5, 1.5)))["true_omega_right"]
    assert 1.4 < speed.max() < 1.7


def test_integral_part_with_a_limit_of_its_own_leaves_a_droop():
    row = _settled(_with(DDAGR, load_compliance=0.05, integral_rate=3.0, integral_limit=0.1), 1.2, 1.2)
    droop = (0.05 * _torques(row)[0] + 0.1) / DDAGR.motor_rate
    assert row[layout.OMEGA] == pytest.approx(1.2 + droop, rel=2e-3)
    assert droop < -0.02


# The time step


def _order(robot, command, state, **options):
    """Order of the time step over 40 samples of a command, and the errors (4,) by 1, 2, 4 and 8 steps a sample."""

    def end(substeps):
        numerics = Numerics(
            section_nodes=16, contact_nodes=16, jacobian_contact_nodes=8, substeps=substeps, launch_substeps=1,
            launch_change=1e9, accepted_error=1e9, jacobian_refresh=0.0, sinkage_tolerance=1e-12,
        )  # fmt: skip
        drive = _drive(robot, np.tile(command, (40, 1)), initial_state=state, numerics=numerics, **options)
        return np.array([drive[name][-1] for name in MOTION])

    exact = end(64)
    errors = [np.linalg.norm(end(substeps) - exact) for substeps in (1, 2, 4, 8)]
    return -np.polyfit(np.log2([1, 2, 4, 8]), np.log2(errors), 1)[0], errors


@pytest.mark.parametrize("integral_rate", [0.0, 2.0])
def test_order_is_two_with_dynamic_banks(integral_rate):
    robot = _with(DDAGR, load_compliance=0.3, integral_rate=integral_rate, viscous_rate=0.2)
    state = {"v_x": 0.5, "v_y": 0.05, "yaw_rate": 0.1, "omega_right": 1.8, "omega_left": 1.8}
    order, errors = _order(robot, (1.8, 1.2), state)
    assert order == pytest.approx(2.15, abs=0.35)
    assert errors[0] < 1e-4


@pytest.mark.parametrize(("robot", "soil", "inertia", "scale"), [(DDAGR, CLAY, 30.0, 1.0), (WARTHOG, FIRM, 40.0, 4.0)])
def test_default_numerics_follow_the_converged_solution(robot, soil, inertia, scale):
    built = _with(
        robot, command_delay=0.2, load_compliance=1.0 / inertia, integral_rate=2.0, coulomb_friction=0.2,
        acceleration_limit=10.0 * scale,
    )  # fmt: skip
    commands = scale * _steps((1.0, 0.7, 0.7), (1.5, 0.0, 1.2), (1.0, 0.0, 0.0), (1.0, -0.7, 0.7))
    drives = [_drive(built, commands, soil, numerics=numerics) for numerics in (Numerics(), Numerics.finest())]
    error = np.array([np.abs(drives[0][name] - drives[1][name]) for name in MOTION])
    assert error[:3].max() < 5e-3 * scale
    assert error[6:].max() < 5e-3 * scale
    assert np.sqrt(np.mean(error**2, axis=1)).max() < 1e-3 * scale


def test_order_is_nearly_two_where_a_motor_reaches_its_limit_under_load():
    """Reaching it is a kink inside a step."""
    state = {"v_x": 0.5, "omega_right": 1.5, "omega_left": 1.5}
    order, errors = _order(DDAGR, (1.8, 1.7), state, effects=["motor_saturation=1000,torque_limit=7.5"])
    assert order > 1.5
    assert errors[0] < 2e-4


@pytest.mark.parametrize("limit", ["torque_limit=30", "torque_limit=12", "power_limit=9"])
def test_default_numerics_follow_motors_that_reach_their_limit_under_load(limit):
    commands = _steps((1.0, 0.7, 0.7), (2.0, -0.6, 0.6), (1.5, 0.0, 1.2), (1.0, 0.0, 0.0), (1.0, -0.7, 0.7))
    weak = {"effects": [f"motor_saturation=1000,{limit}"]}
    drives = [_drive(DDAGR, commands, numerics=numerics, **weak) for numerics in (Numerics(), Numerics.finest())]
    error = np.array([np.abs(drives[0][name] - drives[1][name]) for name in MOTION])
    free = _drive(DDAGR, commands)
    assert np.abs(free["true_omega_right"] - drives[1]["true_omega_right"]).max() > 0.05
    assert error[6:].max() < 1e-2
    assert np.sqrt(np.mean(error**2, axis=1)).max() < 1e-3


def test_no_drive_takes_energy_from_the_ground_or_gives_any():
    """Banks that are told to stand only lose energy, as the body does (passivity)."""
    robot = _with(replace(DDAGR, motor_rate=0.05), load_compliance=0.1, viscous_rate=0.01, coulomb_friction=0.05)
    state = {"v_x": 0.6, "v_y": 0.1, "yaw_rate": 0.4, "omega_right": 1.9, "omega_left": -0.5}
    drive = _drive(robot, np.zeros((500, 2)), initial_state=state)
    body = (
        robot.mass * (drive["true_v_x"] ** 2 + drive["true_v_y"] ** 2) + robot.yaw_inertia * drive["true_yaw_rate"] ** 2
    )
    banks = (drive["true_omega_right"] ** 2 + drive["true_omega_left"] ** 2) / robot.drivetrain.load_compliance
    energy = 0.5 * (body + banks)
    assert (np.diff(energy) < 1e-9 * energy[0]).all()
    assert energy[-1] < 0.05 * energy[0]


SPEEDS = st.floats(-2.0, 2.0)


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.tuples(SPEEDS, SPEEDS), min_size=2, max_size=5),
    st.floats(1.0, 200.0), st.floats(0.0, 10.0), st.floats(0.5, 50.0), st.floats(0.0, 1.0),
)  # fmt: skip
def test_any_drive_stays_finite_and_below_what_drives_it(pieces, inertia, integral_rate, limit, friction):
    robot = _with(
        DDAGR,
        load_compliance=1.0 / inertia,
        integral_rate=integral_rate,
        acceleration_limit=limit,
        coulomb_friction=friction,
    )  # fmt: skip
    drive = _drive(robot, np.concatenate([np.tile(pair, (60, 1)) for pair in pieces]))
    for name in MOTION:
        assert np.isfinite(drive[name]).all()
    assert np.abs(drive["true_omega_right"]).max() < 10.0
    assert np.abs(drive["true_v_x"]).max() < 10.0 * DDAGR.outer_radius


def test_mirrored_commands_mirror_the_motion():
    robot = _with(
        DDAGR, command_delay=0.1, load_compliance=0.02, integral_rate=2.0, acceleration_limit=5.0, coulomb_friction=0.2
    )
    commands = _steps((1.0, 1.2, 0.4), (1.0, -0.3, 0.8))
    one, other = _drive(robot, commands), _drive(robot, commands[:, ::-1])
    np.testing.assert_allclose(one["true_omega_right"], other["true_omega_left"], atol=1e-6)
    np.testing.assert_allclose(one["true_yaw"], -other["true_yaw"], atol=1e-6)


# The past


def test_told_past_gives_the_integral_part_and_the_commands_on_their_way():
    """A window that begins in motion goes on as the drive did, where past commands and speeds are told."""
    robot = _with(DDAGR, command_delay=0.2, load_compliance=0.02, integral_rate=3.0)
    commands = _steps((0.5, 0.0, 0.0), (1.0, 1.2, 0.3), (2.0, 0.5, 0.9))
    whole = _drive(robot, commands)
    start, count = 200, 120
    state = {name.removeprefix("true_"): whole[name][start - 1] for name in MOTION}
    past = commands[None, :start]
    speeds = np.stack([whole["true_omega_right"], whole["true_omega_left"]], axis=1)[None, :start]

    def error(known):
        simulator = Simulator(1)
        simulator.configure(0, robot, CLAY, NOISELESS)
        simulator.reset(state=state)
        simulator.remember(past, speeds if known else None)
        _, record = simulator.step(commands[None, start : start + count], recorded=[layout.OMEGA, layout.OMEGA + 1])
        truth = np.stack([whole["true_omega_right"], whole["true_omega_left"]], axis=1)
        return np.abs(record[0] - truth[start : start + count]).max()

    assert error(known=True) < 0.01
    assert error(known=False) > 0.05
