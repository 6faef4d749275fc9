"""Commands and motors: each effect against the closed form of the bank speed it should give."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.parameters import Imu, Sensors, WheelEncoder
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects import parse_effect
from ddagr_gym.simulator import simulate

PERIOD = 0.008
RATE = 4.5


@pytest.fixture
def steps():
    """Commands (300, 2): rest, then different speeds of the banks, then one reversed."""
    commands = np.zeros((300, 2))
    commands[70:180] = (0.7, 0.5)
    commands[180:] = (0.7, -0.3)
    return commands


@pytest.mark.parametrize("samples", [1, 5, 61])
def test_delay_of_whole_samples_shifts_the_bank_speeds(drive, steps, samples):
    prompt = drive((), steps)["encoder_right"]
    late = drive([f"command_delay={samples * PERIOD}"], steps)["encoder_right"]
    np.testing.assert_allclose(late[samples:], prompt[:-samples], atol=1e-12)
    np.testing.assert_array_equal(late[:samples], 0.0)


@pytest.mark.parametrize(("imbalance", "samples"), [(1.0, (10, 0)), (-1.0, (0, 10)), (0.2, (6, 4))])
def test_banks_may_be_late_by_different_times(drive, steps, imbalance, samples):
    prompt, late = drive((), steps), drive([f"command_delay={5 * PERIOD},imbalance={imbalance}"], steps)
    for name, shift in zip(("encoder_right", "encoder_left"), samples, strict=True):
        np.testing.assert_allclose(late[name][shift:], prompt[name][: len(steps) - shift], atol=1e-12)


@pytest.mark.parametrize("sample_rate", [50.0, 125.0, 400.0, 1000.0])
@pytest.mark.parametrize("delay", [0.013, 0.2, 0.49])
def test_delay_of_a_ramp_is_exact_at_every_rate(act, turning_row, sample_rate, delay):
    effect = parse_effect(f"command_delay={delay}")
    row = turning_row.copy()
    row[layout.SAMPLE_PERIOD] = 1.0 / sample_rate
    row[layout.OMEGA : layout.OMEGA + 2] = 0.0
    memory = np.zeros(layout.EFFECT_MEMORY)
    for k in range(int(1.5 * sample_rate)):
        time = k / sample_rate
        row[layout.MOTOR_TARGET : layout.MOTOR_TARGET + 2] = (0.3 * time, -0.1 * time)
        changed = act(effect, row, memory)
        if time > 0.7:
            late = changed[layout.MOTOR_TARGET : layout.MOTOR_TARGET + 2]
            np.testing.assert_allclose(late, (0.3 * (time - delay), -0.1 * (time - delay)), atol=1e-12)


@pytest.mark.parametrize("samples", [5.25, 5.9])
def test_behind_a_ramp_every_dead_time_between_two_samples_is_another(robot, soil, ideal_sensors, steps, samples):
    ramped = replace(robot, drivetrain=replace(robot.drivetrain, command_ramp=1.0))
    shorter, late, longer = (
        simulate(ramped, soil, steps, effects=[f"command_delay={number * PERIOD}"], sensors=ideal_sensors)[
            "true_omega_left"
        ]
        for number in (5, samples, 6)
    )
    np.testing.assert_allclose(late, (6 - samples) * shorter + (samples - 5) * longer, atol=1e-12)
    assert np.abs(longer - shorter).max() > 1e-3


def test_motors_get_the_late_set_point_in_whatever_order_effects_are_given(drive, steps):
    effects = ["motor_droop=5e-3", "command_delay=0.2"]
    one, other = (drive(order, steps)["true_omega_right"] for order in (effects, effects[::-1]))
    np.testing.assert_array_equal(one, other)


def test_before_the_first_command_the_delay_holds_the_bank_speeds(drive):
    state = {"v_x": 0.14, "omega_right": 0.5, "omega_left": 0.5}
    columns = drive(["command_delay=0.24"], np.full((40, 2), 0.9), initial_state=state)
    np.testing.assert_allclose(columns["encoder_right"][:30], 0.5, atol=1e-12)
    assert columns["encoder_right"][-1] > 0.55


@pytest.mark.parametrize("lag", [0.0, 0.05, 0.4921])
def test_lag_lengthens_the_time_constant(drive, steps, lag):
    speed = drive([f"motor_lag={lag}"], steps)["true_omega_left"]
    time = PERIOD * np.arange(1, 111)
    np.testing.assert_allclose(speed[70:180], 0.5 * (1 - np.exp(-time / (1 / RATE + lag))), rtol=1e-9)


@pytest.mark.parametrize("share", [0.3, 1.0])
def test_a_second_pole_answers_as_two_lags_in_series(drive, steps, share):
    lag = 0.25
    speed = drive([f"motor_lag={lag},second_pole={share}"], steps)["true_omega_left"]
    loop, second = 1 / RATE + (1 - share) * lag, share * lag
    time = PERIOD * np.arange(1, 111)
    left = (loop * np.exp(-time / loop) - second * np.exp(-time / second)) / (loop - second)
    # the loop aims at the mean of the filter over each sample: an error of (PERIOD/second)^2/12 at most
    np.testing.assert_allclose(speed[70:180], 0.5 * (1 - left), atol=0.5 * (PERIOD / second) ** 2 / 12)


@pytest.mark.parametrize("lag", [0.002, 0.3])
@pytest.mark.parametrize("share", [0.5, 1.0])
def test_behind_a_ramp_the_lag_is_the_same_however_it_is_split(drive, share, lag):
    ramp = np.repeat(0.1 * PERIOD * np.arange(500)[:, None], 2, axis=1)
    nominal, slower, split = (
        drive(effects, ramp)["true_omega_right"][-1]
        for effects in ((), [f"motor_lag={lag}"], [f"motor_lag={lag},second_pole={share}"])
    )
    assert nominal - slower == pytest.approx(0.1 * lag, rel=0.05)
    assert nominal - split == pytest.approx(nominal - slower, rel=0.01)


def test_a_steady_bank_does_not_notice_the_second_pole(drive):
    state = {"v_x": 0.14, "omega_right": 0.5, "omega_left": 0.5}
    columns = drive(["motor_lag=0.3,second_pole=1"], np.full((40, 2), 0.5), initial_state=state)
    np.testing.assert_allclose(columns["true_omega_right"], 0.5, atol=1e-12)


def test_negative_lag_cannot_reverse_time(act, turning_row):
    row = turning_row.copy()
    row[layout.MOTOR_RATE : layout.MOTOR_RATE + 2] = 50.0
    rates = act(parse_effect("motor_lag=-0.05"), row)[layout.MOTOR_RATE : layout.MOTOR_RATE + 2]
    np.testing.assert_allclose(rates, 1000.0)


@pytest.mark.parametrize(("slowing", "falling"), [(0.0, 0.0), (0.5, 0.15), (1.0, 0.3)])
def test_a_lag_of_speeding_up_leaves_the_slowing_down(drive, slowing, falling):
    commands = np.repeat([0.6, -0.2], 250)[:, None].repeat(2, axis=1)
    speed = drive([f"motor_lag=0.3,slowing={slowing}"], commands)["true_omega_right"]
    time = PERIOD * np.arange(1, 51)
    rising, settled = 1 / RATE + 0.3, speed[249]
    # between the two it changes over smoothly: 0.02 rad/s either side of the target
    np.testing.assert_allclose(speed[:50], 0.6 * (1 - np.exp(-time / rising)), rtol=4e-3)
    expected = -0.2 + (settled + 0.2) * np.exp(-time / (1 / RATE + falling))
    moving = expected > 0.1
    assert moving.sum() > 10
    np.testing.assert_allclose(speed[250:300][moving], expected[moving], atol=4e-3)


def test_a_bank_that_reverses_speeds_up_once_it_is_past_rest(drive):
    commands = np.repeat([0.6, -0.6], 250)[:, None].repeat(2, axis=1)
    speed = drive(["motor_lag=0.3,slowing=0"], commands)["true_omega_right"]
    late = speed[320:380] + 0.6
    rate = -np.log(late[1:] / late[:-1]) / PERIOD
    np.testing.assert_allclose(rate, 1 / (1 / RATE + 0.3), rtol=0.03)


def torque(columns, bank):
    return columns[f"true_axle_torque_{1 + bank}"] + columns[f"true_axle_torque_{3 + bank}"]


def test_droop_lowers_the_speed_in_proportion_to_the_bank_torque(drive):
    columns = drive(["motor_droop=0.002"], np.tile((0.9, 0.5), (700, 1)))
    for bank, side in enumerate(("right", "left")):
        expected = (0.9, 0.5)[bank] + 0.002 * torque(columns, bank)
        np.testing.assert_allclose(columns[f"true_omega_{side}"][-50:], expected[-50:], atol=2e-5)
    assert torque(columns, 0)[-1] < -20


def test_droop_lets_a_locked_bank_creep_with_the_robot(drive):
    columns = drive(["motor_droop=0.002"], np.tile((0.7, 0.0), (500, 1)))
    assert columns["true_omega_left"][-1] > 0.01
    mirrored = drive(["motor_droop=0.002"], np.tile((0.0, -0.7), (500, 1)))
    assert mirrored["true_omega_right"][-1] < -0.01


def test_droop_comes_to_rest(drive):
    commands = np.zeros((900, 2))
    commands[:250] = 0.6
    columns = drive(["motor_droop=0.002"], commands)
    assert np.abs(columns["true_omega_right"][-50:]).max() < 5e-4
    assert np.abs(columns["specific_force_x"][-50:]).max() < 0.02


def droop(act, turning_row, text, omega, torques):
    """Shift of both motors' targets under axle torques of the banks (right, left)."""
    row = turning_row.copy()
    row[layout.OMEGA : layout.OMEGA + 2] = omega
    row[layout.AXLE_TORQUE : layout.AXLE_TORQUE + 4] = np.tile(0.5 * np.array(torques), 2)
    changed = act(parse_effect(text), row)
    return (changed - row)[layout.MOTOR_TARGET : layout.MOTOR_TARGET + 2]


def test_a_shared_battery_slows_both_banks_alike(act, turning_row):
    both = "motor_droop=0.002,shared=0.5"
    np.testing.assert_allclose(droop(act, turning_row, both, (0.8, 0.8), (-30.0, -10.0)), -0.04, rtol=2e-3)
    # on the spot both lose speed as well, each in its own sense
    np.testing.assert_allclose(droop(act, turning_row, both, (0.8, -0.8), (-30.0, 10.0)), (-0.04, 0.04), rtol=2e-3)


@pytest.mark.parametrize("omega", [(0.8, 0.4), (0.8, -0.4), (0.0, 0.0)])
def test_a_droop_that_is_not_shared_follows_the_banks_own_torque(act, turning_row, omega):
    shift = droop(act, turning_row, "motor_droop=0.002", omega, (-30.0, 10.0))
    np.testing.assert_allclose(shift, (-0.06, 0.02), atol=1e-15)


def test_power_takes_a_share_of_the_speed(act, turning_row):
    sag = "motor_droop=0.002,shared=0.5,power=1"
    row = turning_row.copy()
    command = row[layout.MOTOR_TARGET : layout.MOTOR_TARGET + 2]
    drawn = -30.0 * 0.8 + -10.0 * 0.4
    shift = droop(act, turning_row, sag, (0.8, 0.4), (-30.0, -10.0))
    np.testing.assert_allclose(shift, 0.002 * drawn / 0.7 * command / 0.7, rtol=1e-12)
    # on the spot both banks draw as well
    spot = droop(act, turning_row, sag, (0.8, -0.4), (-30.0, 10.0))
    np.testing.assert_allclose(spot, shift, rtol=1e-12)
    assert np.abs(shift).min() > 1e-3


def test_at_the_usual_speed_power_takes_what_the_torque_of_both_does(drive):
    commands = np.full((700, 2), 0.7)
    lost = [
        0.7 - drive([f"motor_droop=0.0005,shared={share},power={power}"], commands)["true_omega_right"][-1]
        for share, power in ((0.0, 0.0), (0.5, 0.0), (0.0, 1.0), (0.5, 1.0))
    ]
    assert lost[0] > 3e-3
    np.testing.assert_allclose(lost, lost[0] * np.array([1.0, 1.0, 2.0, 2.0]), rtol=0.04)


def test_a_weak_battery_takes_nothing_from_a_locked_bank(drive):
    columns = drive(["motor_droop=0.002,shared=0.5,power=1"], np.tile((0.7, 0.0), (300, 1)))
    np.testing.assert_allclose(columns["true_omega_left"], 0.0, atol=1e-12)
    assert columns["true_omega_right"][-1] < 0.69


def test_a_weak_battery_lets_the_outer_bank_slow_the_inner_one(drive):
    commands = np.tile((0.9, 0.5), (700, 1))
    own, shared = (drive([f"motor_droop=0.002,shared={share}"], commands) for share in (0.0, 0.5))
    lost = [0.9 - shared["true_omega_right"][-1], 0.5 - shared["true_omega_left"][-1]]
    assert lost[0] == pytest.approx(lost[1], rel=0.01)
    assert lost[1] > 0.5 - own["true_omega_left"][-1] + 5e-3


def test_speed_limit_clips_and_leaves_slower_commands_alone(drive, steps):
    free = drive((), steps)
    limited = drive(["motor_saturation=0.6"], steps)
    np.testing.assert_array_equal(limited["true_omega_left"], free["true_omega_left"])
    assert limited["true_omega_right"].max() == pytest.approx(0.6, abs=1e-3)
    time = PERIOD * np.arange(1, 111)
    np.testing.assert_allclose(limited["true_omega_right"][70:180], 0.6 * (1 - np.exp(-RATE * time)), rtol=1e-9)


def test_acceleration_limit_makes_ramps_that_end_in_the_nominal_loop(drive, steps):
    limit = 0.8
    speed = drive([f"motor_saturation=1000,acceleration_limit={limit}"], steps)["true_omega_right"]
    within_a_sample = (1 - np.exp(-RATE * PERIOD)) / (RATE * PERIOD)
    # the ramp ends where the nominal loop becomes slower: 0.7 - omega = limit/rate
    ramp = np.diff(speed[70:150])
    bound = int((0.7 - limit / RATE) / (limit * PERIOD))
    np.testing.assert_allclose(ramp[: bound - 1], limit * PERIOD * within_a_sample, rtol=1e-9)
    assert (ramp[bound + 3 :] < 0.97 * ramp[0]).all()


def test_dead_zone_takes_its_width_from_every_command(drive):
    columns = drive(["command_deadband=0.1"], np.tile((0.7, 0.09), (600, 1)))
    assert columns["true_omega_right"][-1] == pytest.approx(0.6, abs=1e-6)
    assert columns["true_omega_left"][-1] == 0.0
    backwards = drive(["command_deadband=0.1"], np.tile((-0.7, -0.2), (600, 1)))
    assert backwards["true_omega_right"][-1] == pytest.approx(-0.6, abs=1e-6)
    assert backwards["true_omega_left"][-1] == pytest.approx(-0.1, abs=1e-6)


def test_threshold_lets_larger_commands_pass_whole(act, turning_row):
    effect = parse_effect("command_deadband=0.1,loss=0")
    row = turning_row.copy()
    for command, expected in ((0.0, 0.0), (0.089, 0.0), (0.1, 0.1), (0.7, 0.7), (-0.05, 0.0), (-0.3, -0.3)):
        row[layout.COMMAND] = command
        assert act(effect, row)[layout.COMMAND] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("loss", [0.0, 0.4, 1.0])
def test_deadband_is_continuous_and_monotone(act, turning_row, loss):
    effect = parse_effect(f"command_deadband=0.1,loss={loss}")
    row = turning_row.copy()
    commands = np.linspace(-0.3, 0.3, 2401)
    received = []
    for command in commands:
        row[layout.COMMAND] = command
        received.append(act(effect, row)[layout.COMMAND])
    slopes = np.diff(received) / np.diff(commands)
    assert slopes.min() >= 0.0
    assert slopes.max() < 17.0


def test_rates_of_the_motor_effects_do_not_depend_on_the_sample_rate(drive, steps):
    slow = Sensors(imu=Imu(sample_rate=62.5, accelerometer_noise=0.0), encoder=WheelEncoder(counts_per_revolution=0.0))
    effects = ["motor_lag=0.2", "motor_droop=0.001"]
    fine = drive(effects, steps)["true_omega_right"][1::2]
    coarse = drive(effects, steps[::2], sensors=slow)["true_omega_right"]
    np.testing.assert_allclose(coarse, fine, atol=6e-3)


def test_a_bank_that_moves_stops_later_than_it_starts_and_sticks_again_before_it_reverses(turning_row):
    effect = parse_effect("command_deadband=0.1,loss=0,release=0.5")
    row, memory = turning_row.copy(), np.zeros(layout.EFFECT_MEMORY)
    row[layout.OMEGA : layout.OMEGA + 2] = 0.0
    passed = []
    for command in (0.08, 0.12, 0.08, 0.03, 0.08, 0.2, -0.08, -0.2, -0.08):
        row[layout.COMMAND : layout.COMMAND + 2] = command, 0.5
        effect.actions[0][1](row, effect.vector(), memory)
        passed.append(row[layout.COMMAND])
        assert row[layout.COMMAND + 1] == 0.5
    assert passed == [0.0, 0.12, 0.08, 0.0, 0.0, 0.2, 0.0, -0.2, -0.08]


def test_a_drive_that_begins_in_motion_is_not_stuck(turning_row):
    effect = parse_effect("command_deadband=0.1,loss=0,release=0.5")
    row = turning_row.copy()
    row[layout.OMEGA : layout.OMEGA + 2] = 0.08, -0.08
    row[layout.COMMAND : layout.COMMAND + 2] = 0.08, 0.08
    effect.actions[0][1](row, effect.vector(), np.zeros(layout.EFFECT_MEMORY))
    assert tuple(row[layout.COMMAND : layout.COMMAND + 2]) == (0.08, 0.0)


def test_a_late_turning_leaves_the_mean_and_answers_as_a_filter_before_the_loop(drive):
    lag, commands = 0.3, np.zeros((300, 2))
    commands[70:] = (0.8, 0.4)
    late, prompt = drive([f"motor_lag={lag},turning=1"], commands), drive((), commands)
    mean, half = ((late["true_omega_right"] + sign * late["true_omega_left"]) / 2 for sign in (1, -1))
    np.testing.assert_allclose(mean, (prompt["true_omega_right"] + prompt["true_omega_left"]) / 2, atol=1e-12)
    time = PERIOD * np.arange(1, 231)
    left = (lag * np.exp(-time / lag) - np.exp(-time * RATE) / RATE) / (lag - 1 / RATE)
    np.testing.assert_allclose(half[70:], 0.2 * (1 - left), atol=0.2 * (PERIOD / lag) ** 2 / 12)


def test_a_turn_that_goes_on_from_the_start_is_not_late(drive):
    state = {"v_x": 0.14, "omega_right": 0.6, "omega_left": 0.4}
    columns = drive(["motor_lag=0.3,turning=1"], np.tile((0.6, 0.4), (40, 1)), initial_state=state)
    np.testing.assert_allclose(columns["true_omega_right"], 0.6, atol=1e-12)


@pytest.mark.parametrize(
    ("command", "passed"),
    [((0.55, 0.45), (0.5, 0.5)), ((0.45, 0.55), (0.5, 0.5)), ((0.7, 0.3), (0.7, 0.3)), ((0.05, 0.03), (0.04, 0.04))],
)
def test_small_turns_are_overlooked_and_the_speed_stays(act, turning_row, command, passed):
    row = turning_row.copy()
    row[layout.OMEGA : layout.OMEGA + 2] = 0.0
    row[layout.COMMAND : layout.COMMAND + 2] = command
    received = act(parse_effect("command_deadband=0.1,loss=0,turning=1"), row)
    np.testing.assert_allclose(received[layout.COMMAND : layout.COMMAND + 2], passed, atol=1e-12)
