from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.control.manoeuvres import MANOEUVRES
from ddagr_gym.diagnosis.certification.forecast import part_of
from ddagr_gym.identification.block_means import sample_windows
from ddagr_gym.identification.fit_numerics import field_numerics
from ddagr_gym.identification.nuisances import Nuisances
from ddagr_gym.identification.parameters import command_shift, sensor_parameters, soil_parameters
from ddagr_gym.identification.problem import Point, Problem
from ddagr_gym.identification.window_model import WindowModel, ideal_sensors
from ddagr_gym.identification.windows import CHANNELS, STATE, cut_windows
from ddagr_gym.parameters import Drivetrain, Numerics
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects import load_effects
from ddagr_gym.recordings.schema import RobotGeometry
from ddagr_gym.simulator import simulate

RATE = 50.0
TRUTH = {"v_x": "true_v_x", "v_y": "true_v_y", "yaw_rate": "true_yaw_rate", "omega_right": "true_omega_right"}
CHANNELS_OF_COMMANDS = ("t", "command_right", "command_left", "encoder_right", "encoder_left", "yaw_rate")
TRUTH |= {"omega_left": "true_omega_left", "x": "true_x", "y": "true_y", "yaw": "true_yaw"}


@pytest.fixture(scope="module")
def truth(robot, soil):
    """Noise-free columns of arcs, and the recording of them."""
    from ddagr_gym.recordings.channels import CHANNELS as SCHEMA
    from ddagr_gym.recordings.schema import Recording

    commands = MANOEUVRES["arcs"].commands(RATE)
    columns = simulate(robot, soil, commands, sensors=ideal_sensors(1.0 / RATE), numerics=Numerics.smooth())
    kept = {name: values for name, values in columns.items() if name == "t" or name in SCHEMA}
    return columns, Recording.from_columns(kept, robot)


@pytest.fixture(scope="module")
def windows(truth, robot):
    """Windows of 2 s that start at the true states."""
    columns, recording = truth
    geometry = RobotGeometry.of(robot)
    cut = cut_windows([recording], 2.0, wheel_radius=geometry.wheel_radius, half_track=geometry.half_track)
    initial = np.stack([columns[TRUTH[name]][cut.start] for name in STATE], axis=1)
    return replace(cut, initial=initial)


def test_from_true_states_the_model_repeats_the_drive(robot, soil, windows):
    prediction = WindowModel(robot, soil, windows).predict(np.zeros(0), windows.initial)
    for name, tolerance in (("yaw_rate", 2e-4), ("encoder_right", 1e-6), ("pose_x", 2e-4), ("pose_yaw", 2e-4)):
        k = CHANNELS.index(name)
        np.testing.assert_allclose(prediction[..., k], windows.measured[..., k], atol=tolerance)


def test_field_numerics_are_as_close_as_they_say(robot, soil, windows):
    prediction = WindowModel(robot, soil, windows, numerics=field_numerics()).predict(np.zeros(0), windows.initial)
    k = CHANNELS.index("yaw_rate")
    assert np.sqrt(np.mean((prediction[..., k] - windows.measured[..., k]) ** 2)) < 2e-3


def test_a_delay_moves_the_commands(robot, soil, windows):
    shift = WindowModel(robot, soil, windows, (command_shift(0.04),))
    late = WindowModel(robot, soil, windows, delay=0.04)
    by_parameter = shift.predict(np.array([0.04]), windows.initial)
    np.testing.assert_array_equal(by_parameter, late.predict(np.zeros(0), windows.initial))
    assert np.abs(by_parameter - shift.predict(np.zeros(1), windows.initial)).max() > 0.01


@pytest.mark.parametrize(
    ("effect", "tolerance"), [("command_delay=0.3,imbalance=0.2", 1e-6), ("motor_lag=0.1,second_pole=1", 2e-3)]
)
def test_effects_on_commands_know_what_was_commanded_before_a_window(robot, soil, effect, tolerance):
    """A window that begins while the command of before still acts: nothing but the past says which."""
    from ddagr_gym.recordings.schema import Recording

    steps = [(0.9, 0.4), (0.4, 0.3), (0.0, 0.4), (0.7, 0.9)]
    commands = np.repeat(np.tile(steps, (4, 1)), 45, axis=0)
    sensors = ideal_sensors(1.0 / RATE)
    columns = simulate(robot, soil, commands, sensors=sensors, numerics=Numerics.smooth(), effects=(effect,))
    recording = Recording.from_columns({name: columns[name] for name in CHANNELS_OF_COMMANDS}, robot)
    geometry = RobotGeometry.of(robot)
    cut = cut_windows([recording], 1.0, wheel_radius=geometry.wheel_radius, half_track=geometry.half_track)
    states = np.stack([columns[TRUTH[name]][cut.start] for name in STATE], axis=1)
    entries = (layout.OMEGA, layout.OMEGA + 1)
    model = WindowModel(robot, soil, cut)
    _, record = model.predict_recorded(np.zeros(0), states, entries, load_effects(effect))
    rows = cut.start[:, None] + 1 + np.arange(cut.samples)
    for bank, name in enumerate(("true_omega_right", "true_omega_left")):
        np.testing.assert_allclose(record[..., bank], columns[name][rows], atol=tolerance)
    # told nothing, the effect takes the motors to have settled
    without = replace(cut, commands=cut.commands[:, cut.history :], history=0, speeds=cut.speeds[:, cut.history :])
    _, forgetful = WindowModel(robot, soil, without).predict_recorded(
        np.zeros(0), states, entries, load_effects(effect)
    )
    assert np.abs(forgetful - record).max() > 0.05


def test_a_speed_loop_goes_on_where_a_window_begins(robot, soil):
    """Its integral part is that of the recorded speeds before, and a robot's own delay is the effect's."""
    from ddagr_gym.recordings.schema import Recording

    slow = replace(robot, drivetrain=Drivetrain(command_delay=0.3, load_compliance=0.02, integral_rate=3.0))
    commands = np.repeat(np.tile([(0.9, 0.4), (0.4, 0.3), (0.0, 0.4), (0.7, 0.9)], (4, 1)), 45, axis=0)
    sensors = ideal_sensors(1.0 / RATE)
    columns = simulate(slow, soil, commands, sensors=sensors, numerics=Numerics.smooth())
    recording = Recording.from_columns({name: columns[name] for name in CHANNELS_OF_COMMANDS}, robot)
    geometry = RobotGeometry.of(robot)
    cut = cut_windows(
        [recording], 1.0, wheel_radius=geometry.wheel_radius, half_track=geometry.half_track, history=15.0
    )
    states = np.stack([columns[TRUTH[name]][cut.start] for name in STATE], axis=1)
    entries = (layout.OMEGA, layout.OMEGA + 1)
    rows = cut.start[:, None] + 1 + np.arange(cut.samples)
    truth = np.stack([columns[name][rows] for name in ("true_omega_right", "true_omega_left")], axis=-1)

    def errors(windows):
        _, record = WindowModel(slow, soil, windows).predict_recorded(np.zeros(0), states, entries)
        return np.sqrt(np.mean((record - truth) ** 2, axis=(1, 2)))

    told, untold = errors(cut), errors(replace(cut, speeds=np.full(cut.speeds.shape, np.nan)))
    assert told.max() < 0.02  # all since the robot stood is known
    assert np.sqrt(np.mean(told**2)) < 0.3 * np.sqrt(np.mean(untold**2))


def test_the_past_is_delayed_as_the_commands_are(windows):
    late = windows.past(0.06)
    np.testing.assert_allclose(late[:, 3:], windows.past()[:, :-3], atol=1e-9)
    np.testing.assert_allclose(windows.drive(0.06)[1:, :3], windows.past()[1:, -3:], atol=1e-9)


def test_before_a_recording_nothing_is_known(windows):
    """One command is: the first row's was in force up to it."""
    assert np.isnan(windows.past()[0]).all(axis=1).tolist() == [True] * (windows.history - 1) + [False]
    assert np.isnan(windows.past(0.03)[0]).all()
    assert not np.isnan(windows.past()[1:]).any()
    alone = windows.subset(np.array([0, 3]))
    np.testing.assert_array_equal(alone.past(), windows.past()[[0, 3]])
    # a part that begins later knows more
    later = part_of(windows, 10, 20).past()
    assert np.isnan(later[0, :, 0]).sum() == windows.history - 11


def test_imposed_wheel_speeds_are_those_at_the_samples(robot, soil, windows):
    model = WindowModel(robot, soil, windows, imposed=True)
    entries = (layout.OMEGA, layout.OMEGA + 1)
    _, record = model.predict_recorded(np.zeros(0), windows.initial, entries)
    np.testing.assert_allclose(record, windows.drive(), atol=1e-9)


def test_effects_on_motors_mean_nothing_where_wheel_speeds_are_imposed(robot, soil, windows):
    model = WindowModel(robot, soil, windows, imposed=True)
    plain = model.predict(np.zeros(0), windows.initial)
    lag = tuple(load_effects("motor_lag=0.2"))
    np.testing.assert_array_equal(model.predict(np.zeros(0), windows.initial, lag), plain)
    drag = tuple(load_effects("towed_drag=80"))
    assert np.abs(model.predict(np.zeros(0), windows.initial, drag) - plain).max() > 0.01


def test_windows_of_one_batch_do_not_know_each_other(robot, soil, windows):
    whole = WindowModel(robot, soil, windows).predict(np.zeros(0), windows.initial)
    one = windows.subset(np.array([7]))
    np.testing.assert_array_equal(WindowModel(robot, soil, one).predict(np.zeros(0), one.initial)[0], whole[7])


def test_a_gyro_bias_is_in_the_gyro_only(robot, soil, windows):
    parameter = sensor_parameters(1, 0.01, 0.1)[:1]
    model = WindowModel(robot, soil, windows, parameter)
    change = model.predict(np.array([0.01]), windows.initial) - model.predict(np.zeros(1), windows.initial)
    k = CHANNELS.index("yaw_rate")
    np.testing.assert_allclose(change[..., k], 0.01, atol=1e-12)
    assert np.abs(np.delete(change, k, axis=-1)).max() == 0.0


def test_derivatives_agree_with_central_differences(robot, soil, windows):
    few = windows.subset(np.arange(6, 9))
    parameters = soil_parameters(soil)
    model = WindowModel(robot, soil, few, parameters)
    values, states = np.zeros(4), few.initial
    base = model.predict(values, states)
    by_state, step = model.state_derivatives(values, states, model.reference(values, states)), 1e-3
    # the forces' derivatives leave out that a wheel turns with the body, which shows in the first specific forces
    for k, tolerance in ((0, 0.02), (2, 0.02), (3, 0.02), (4, 0.03), (5, 0.2)):
        up, down = states.copy(), states.copy()
        up[:, k] += step
        down[:, k] -= step
        central = (model.predict(values, up) - model.predict(values, down)) / (2.0 * step)
        np.testing.assert_allclose(by_state[..., k], central, atol=tolerance * max(1.0, np.abs(central).max()))
        np.testing.assert_allclose(by_state[..., 2:, k], central[..., 2:], atol=0.02 * max(1.0, central[..., 2:].max()))
    problem = Problem(robot, soil, sample_windows(few, np.ones(8)), Nuisances(parameters), numerics=Numerics.smooth())
    by_value = problem.parameter_columns(Point(values, states), base).reshape(*base.shape, 4)
    up, down = (model.predict(np.array([s, 0.0, 0.0, 0.0]), states) for s in (0.02, -0.02))
    central = (up - down) / 0.04
    k = CHANNELS.index("yaw_rate")
    np.testing.assert_allclose(by_value[..., k, 0], central[..., k], atol=0.1 * np.abs(central[..., k]).max())


@pytest.fixture(scope="module")
def winding(robot, soil):
    """Steps of 6 s of a robot whose loops wind up, as one recording, and the true integral parts at every row."""
    from ddagr_gym.recordings.schema import Recording
    from ddagr_gym.simulator import Simulator

    own = replace(robot, drivetrain=Drivetrain(command_delay=0.1, load_compliance=0.05, integral_rate=1.5))
    rng = np.random.default_rng(3)
    commands = np.repeat(rng.uniform(-1.8, 1.8, (8, 2)), 120, axis=0)
    simulator = Simulator(numerics=Numerics.smooth())
    simulator.configure(0, own, soil, ideal_sensors(0.05))
    simulator.reset()
    readings, record = simulator.step(commands[None], recorded=(layout.INTEGRAL, layout.INTEGRAL + 1))
    names = ("specific_force_x", "specific_force_y", "yaw_rate", "encoder_right", "encoder_left")
    columns = {name: readings[0, :, k] for k, name in enumerate(names)}
    columns |= {"t": 0.05 * np.arange(960), "command_right": commands[:, 0], "command_left": commands[:, 1]}
    return own, Recording.from_columns(columns, own), record[0]


def test_integral_parts_at_a_start_are_those_that_the_drive_before_left(soil, winding):
    own, recording, truth = winding
    cut = cut_windows(
        [recording], 2.0, wheel_radius=own.outer_radius, half_track=own.half_track, history=0.5, run_in=4.0
    )
    known = cut.run_in.leads_to
    found = WindowModel(own, soil, cut).first_integrals(np.zeros(0))
    assert np.isnan(found[: known[0]]).all()
    settled = WindowModel(own, soil, replace(cut, run_in=None))
    _, record = settled.predict_recorded(np.zeros(0), cut.initial, (layout.INTEGRAL, layout.INTEGRAL + 1))
    error = np.abs(found[known] - truth[cut.start[known]])
    without = np.abs(record[known, 0] - truth[cut.start[known] + 1])
    assert np.median(error) < 0.6 * np.median(without)
    np.testing.assert_array_equal(
        WindowModel(own, soil, cut).predict(np.zeros(0), cut.initial),
        WindowModel(own, soil, cut).predict(np.zeros(0), cut.initial, (), found),
    )


def test_robots_without_an_integral_part_need_nothing_before_their_windows(robot, soil, winding):
    _, recording, _ = winding
    cut = cut_windows([recording], 2.0, wheel_radius=robot.outer_radius, half_track=robot.half_track, run_in=4.0)
    model = WindowModel(robot, soil, cut)
    assert np.isnan(model.first_integrals(np.zeros(0))).all()
    alone = WindowModel(robot, soil, replace(cut, run_in=None))
    np.testing.assert_array_equal(model.predict(np.zeros(0), cut.initial), alone.predict(np.zeros(0), cut.initial))
