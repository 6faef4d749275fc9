"""The simulator as a whole: reproducibility to the bit, effects at their points, bad input."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ddagr_gym.errors import InputError
from ddagr_gym.parameters import STANDARD_GRAVITY, Imu, Numerics, PoseReceiver, Sensors, WheelEncoder
from ddagr_gym.physics import layout
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.simulator import INITIAL_STATE, TRUTH, Simulator, simulate

ROBOT, SOIL = get_robot("ddagr"), get_soil("thesis_a1")
SENSORS = Sensors(pose=PoseReceiver(rate=10.0))
EVERYTHING = list(range(layout.SIZE))


# What a drive holds


def test_columns_and_clock():
    drive = simulate(ROBOT, SOIL, np.tile([0.5, 0.7], (25, 1)), sensors=SENSORS)
    assert list(drive)[:3] == ["t", "command_right", "command_left"]
    assert list(drive)[3:11] == list(layout.READINGS)
    assert list(drive)[11:] == list(TRUTH)
    assert all(values.shape == (25,) for values in drive.values())
    np.testing.assert_allclose(drive["t"], 0.008 * np.arange(1, 26))
    assert np.isfinite(np.array([drive[name] for name in TRUTH])).all()


def test_sample_rate_is_the_sensors():
    yaw = []
    for rate in (800.0, 50.0, 125.0):
        sensors = Sensors(imu=Imu(sample_rate=rate))
        drive = simulate(ROBOT, SOIL, np.tile([0.9, 0.4], (int(2 * rate), 1)), sensors=sensors)
        assert drive["t"][-1] == pytest.approx(2.0)
        yaw.append(drive["true_yaw"][-1])
    assert yaw[0] > 0.1
    assert yaw[1:] == pytest.approx([yaw[0]] * 2, rel=2e-3)


def test_initial_state_is_where_the_drive_starts():
    state = {"x": 1.0, "y": -2.0, "yaw": 0.4, "v_x": 0.2, "omega_right": 0.75, "omega_left": 0.75}
    drive = simulate(ROBOT, SOIL, [[0.75, 0.75]], initial_state=state)
    for name, value in state.items():
        assert drive[f"true_{name}"][0] == pytest.approx(value, abs=6e-3)


def test_loads_and_axle_torques_are_those_of_the_wheels():
    drive = simulate(ROBOT, SOIL, np.tile([0.7, 0.7], (300, 1)))
    loads = [drive[f"true_load_{i}"][-1] for i in range(1, 5)]
    np.testing.assert_allclose(loads, 168.0 * STANDARD_GRAVITY / 4)
    # steady and straight: the wheels together neither push nor pull, and the soil resists each axle
    assert abs(sum(drive[f"true_force_x_{i}"][-1] for i in range(1, 5))) < 0.1
    assert all(drive[f"true_axle_torque_{i}"][-1] < 0 for i in range(1, 5))


# Reproducibility


def _drives(count, samples=60):
    rng = np.random.default_rng(8)
    soils = ["thesis_a1", "firm_ground", "dry_sand_lll_0", "lete_sand_wong", "clayey_soil_thailand_55"]
    commands = np.repeat(rng.uniform(-1.0, 1.8, (count, samples // 10, 2)), 10, axis=1)
    noise = rng.standard_normal((count, samples, layout.NOISE_CHANNELS))
    return [get_soil(soils[i % len(soils)]) for i in range(count)], commands, noise


def _batch(count, soils, *, threads=1, effects=("slope=0.05", "command_delay=0.03", "towed_drag=20")):
    simulator = Simulator(count, threads=threads, effects=effects)
    for i in range(count):
        simulator.configure(i, ROBOT, soils[i], SENSORS)
    simulator.reset(state={"yaw": np.linspace(0, 1, count)})
    return simulator


def test_single_batch_and_threads_give_the_same_bits():
    count = 7
    soils, commands, noise = _drives(count)
    results = []
    for threads in (1, 2, 3):
        batch = _batch(count, soils, threads=threads)
        results.append([*batch.step(commands, noise, recorded=EVERYTHING), batch.rows, batch.effect_memory])
        batch.close()
    for other in results[1:]:
        for a, b in zip(results[0], other, strict=True):
            np.testing.assert_array_equal(a, b)
    for i in range(count):
        single = Simulator(1, effects=("slope=0.05", "command_delay=0.03", "towed_drag=20"))
        single.configure(0, ROBOT, soils[i], SENSORS)
        single.reset(state={"yaw": np.linspace(0, 1, count)[i]})
        readings, record = single.step(commands[i : i + 1], noise[i : i + 1], recorded=EVERYTHING)
        np.testing.assert_array_equal(readings[0], results[0][0][i])
        np.testing.assert_array_equal(record[0], results[0][1][i])


def test_threads_that_help_each_other_give_the_same_bits():
    count, samples = 9, 150
    soils = [get_soil("thesis_a1")] * count
    rng = np.random.default_rng(3)
    commands = np.repeat(rng.uniform(-1.0, 1.0, (count, samples // 50, 2)), 50, axis=1)
    noise = rng.standard_normal((count, samples, layout.NOISE_CHANNELS))
    one, *others = (_batch(count, soils, threads=threads).step(commands, noise)[0] for threads in (1, 2, 4, 30))
    for other in others:
        assert np.array_equal(one, other, equal_nan=True)


def test_saved_rows_continue_to_the_same_bits_also_in_another_simulator():
    soils, commands, noise = _drives(3)
    first = _batch(3, soils)
    first.step(commands[:, :30], noise[:, :30])
    rows, memory = first.rows.copy(), first.effect_memory.copy()
    expected = first.step(commands[:, 30:], noise[:, 30:], recorded=EVERYTHING)
    other = _batch(3, [get_soil("snow_u_s")] * 3)
    other.step(commands[:, ::-1][:, :7])
    for simulator in (first, other):
        simulator.rows[:], simulator.effect_memory[:] = rows, memory
        for a, b in zip(expected, simulator.step(commands[:, 30:], noise[:, 30:], recorded=EVERYTHING), strict=True):
            np.testing.assert_array_equal(a, b)


def test_pieces_of_a_drive_are_the_whole_and_held_commands_are_repeated_ones():
    soils, commands, noise = _drives(2, samples=50)
    whole, _ = _batch(2, soils).step(commands, noise)
    pieces = _batch(2, soils)
    parts = [pieces.step(commands[:, k], noise[:, k : k + 10], samples=10)[0] for k in range(0, 50, 10)]
    np.testing.assert_array_equal(np.concatenate(parts, axis=1), whole)


def test_reset_forgets_everything():
    soils, commands, noise = _drives(2)
    batch = _batch(2, soils)
    first = batch.step(commands, noise, recorded=EVERYTHING)
    batch.reset(state={"yaw": [0.0, 1.0]})
    second = batch.step(commands, noise, recorded=EVERYTHING)
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a, b)


def test_reset_of_some_leaves_the_others_alone():
    soils, commands, noise = _drives(3)
    batch, control = _batch(3, soils), _batch(3, soils)
    for simulator in (batch, control):
        simulator.step(commands, noise)
    batch.reset([1], {"x": 4.0})
    np.testing.assert_array_equal(batch.rows[[0, 2]], control.rows[[0, 2]])
    assert batch.rows[1, layout.X] == 4.0
    assert batch.rows[1, layout.V_X] == 0.0


def test_same_seed_same_bits_other_seed_other_noise():
    commands = np.tile([0.9, 0.3], (60, 1))
    first, again, other = (simulate(ROBOT, SOIL, commands, sensors=SENSORS, seed=seed) for seed in (1, 1, 2))
    for name in first:
        np.testing.assert_array_equal(first[name], again[name])
        if name.startswith("true_"):
            np.testing.assert_array_equal(first[name], other[name])
    assert (first["yaw_rate"] != other["yaw_rate"]).mean() > 0.9


# Soil under each wheel


def test_four_equal_soils_are_one_soil():
    commands = np.tile([0.2, 1.1], (60, 1))
    one, four = simulate(ROBOT, SOIL, commands), simulate(ROBOT, [SOIL] * 4, commands)
    for name in one:
        np.testing.assert_array_equal(one[name], four[name])


def test_soft_soil_on_one_side_turns_the_robot_to_it():
    soft = get_soil("dry_sand_lll_0")
    commands = np.tile([0.7, 0.7], (500, 1))
    right = simulate(ROBOT, [soft, SOIL, soft, SOIL], commands)
    left = simulate(ROBOT, [SOIL, soft, SOIL, soft], commands)
    assert right["true_yaw"][-1] < -0.01
    assert left["true_yaw"][-1] == pytest.approx(-right["true_yaw"][-1], rel=1e-3)
    assert right["true_sinkage_1"][-1] > 1.5 * right["true_sinkage_2"][-1]


def test_wheels_of_different_size_turn_the_robot_to_the_smaller():
    small = ROBOT.wheels[0].with_values(major_radius=0.21)
    robot = ROBOT.with_values(wheels=(small, ROBOT.wheels[0], small, ROBOT.wheels[0]))
    assert simulate(robot, SOIL, np.tile([0.7, 0.7], (500, 1)))["true_yaw"][-1] < -0.02


# Effects, each against what pencil and paper say


def test_slope_changes_the_loads_and_the_felt_gravity():
    angle = 0.1
    drive = simulate(ROBOT, SOIL, np.zeros((250, 2)), effects=[f"slope={angle}"])
    shift = ROBOT.centre_of_mass[2] * math.tan(angle) / ROBOT.half_wheelbase
    normal = ROBOT.mass * STANDARD_GRAVITY * math.cos(angle) / 4
    for wheel, expected in ((1, normal * (1 - shift)), (3, normal * (1 + shift))):
        assert drive[f"true_load_{wheel}"][-1] == pytest.approx(expected, rel=1e-9)
    held = sum(drive[f"true_force_x_{i}"][-1] for i in range(1, 5))
    assert held == pytest.approx(ROBOT.mass * STANDARD_GRAVITY * math.sin(angle), rel=1e-4)
    assert drive["specific_force_x"][-50:].mean() == pytest.approx(STANDARD_GRAVITY * math.sin(angle), abs=0.02)


def test_command_delay_shifts_the_bank_speeds():
    commands = np.random.default_rng(0).uniform(-1, 1, (80, 2))
    plain = simulate(ROBOT, SOIL, commands)
    late = simulate(ROBOT, SOIL, commands, effects=["command_delay=0.04"])
    for name in ("true_omega_right", "true_omega_left"):
        np.testing.assert_allclose(late[name][5:], plain[name][:-5], atol=1e-12)
        np.testing.assert_allclose(late[name][:5], 0.0, atol=1e-12)
    np.testing.assert_array_equal(late["command_right"], plain["command_right"])


def test_towed_drag_is_what_the_wheels_pull_in_steady_travel():
    drive = simulate(ROBOT, SOIL, np.tile([0.8, 0.8], (800, 1)), effects=["towed_drag=80"])
    pull = sum(drive[f"true_force_x_{i}"][-1] for i in range(1, 5))
    speed = drive["true_v_x"][-1]
    assert pull == pytest.approx(80.0 * speed / math.hypot(speed, 0.01), rel=1e-3)
    assert speed < simulate(ROBOT, SOIL, np.tile([0.8, 0.8], (800, 1)))["true_v_x"][-1]


def test_sizes_of_effects_differ_by_environment():
    batch = Simulator(2, effects=["towed_drag=0"])
    for i, force in enumerate((0.0, 150.0)):
        batch.configure(i, ROBOT, SOIL)
        batch.effect_parameters[i, 0, 0] = force
    batch.reset()
    _, record = batch.step(np.tile([0.7, 0.7], (2, 300, 1)), recorded=[layout.V_X])
    alone = simulate(ROBOT, SOIL, np.tile([0.7, 0.7], (300, 1)), effects=["towed_drag=150"])
    np.testing.assert_array_equal(record[1, :, 0], alone["true_v_x"])
    assert record[1, -1, 0] < record[0, -1, 0]


# Bogging


def test_bogged_wheels_are_reported_and_nothing_is_nan():
    heavy = ROBOT.with_values(mass=3000.0)
    drive = simulate(heavy, get_soil("snow_u_s"), np.tile([1.0, 1.0], (50, 1)))
    assert all((drive[f"true_bogged_{i}"] == 1).all() for i in range(1, 5))
    assert all((drive[f"true_sinkage_{i}"] == heavy.wheels[0].minor_radius).all() for i in range(1, 5))
    assert np.isfinite(np.array([drive[name] for name in TRUTH])).all()
    simulator = Simulator(2)
    simulator.configure(0, heavy, get_soil("snow_u_s"))
    simulator.configure(1, ROBOT, SOIL)
    simulator.reset()
    np.testing.assert_array_equal(simulator.bogged, [True, False])


@given(
    st.floats(5.0, 2000.0), st.floats(0.1, 1.0), st.floats(0.15, 1.0), st.tuples(st.floats(-2, 2), st.floats(-2, 2)),
    st.sampled_from(["thesis_a1", "firm_ground", "dry_sand_lll_0", "snow_sweden"]),
)  # fmt: skip
@settings(max_examples=40)
def test_robots_of_any_size_stay_finite(mass, half_wheelbase, half_track, speeds, soil):
    robot = ROBOT.with_values(mass=mass, yaw_inertia=0.3 * mass, half_wheelbase=half_wheelbase, half_track=half_track)
    drive = simulate(robot, get_soil(soil), np.tile(speeds, (80, 1)))
    assert np.isfinite(np.array([drive[name] for name in TRUTH])).all()


@pytest.mark.parametrize("name", ["warthog", "husky"])
def test_other_robots_drive_straight_and_turn(name):
    robot = get_robot(name)
    rim = robot.wheels[0].outer_radius
    straight = simulate(robot, get_soil("firm_ground"), np.tile([2.0, 2.0], (400, 1)))
    assert straight["true_v_x"][-1] == pytest.approx(2.0 * rim, rel=0.02)
    turn = simulate(robot, get_soil("firm_ground"), np.tile([2.5, 1.5], (400, 1)))
    kinematic = rim * 1.0 / (2 * robot.half_track)
    assert 0.4 < turn["true_yaw_rate"][-1] / kinematic < 0.95


# Bad input: one sentence each


def _simulator():
    simulator = Simulator(2)
    for i in range(2):
        simulator.configure(i, ROBOT, SOIL)
    simulator.reset()
    return simulator


STILL = np.zeros((3, 2))
BAD = {
    "one column of commands": (lambda: simulate(ROBOT, SOIL, np.zeros((5, 1))), "(5, 1)"),
    "no commands": (lambda: simulate(ROBOT, SOIL, np.zeros((0, 2))), "(0, 2)"),
    "NaN command": (lambda: simulate(ROBOT, SOIL, [[math.nan, 0.0]]), "nan"),
    "infinite command": (lambda: simulate(ROBOT, SOIL, [[math.inf, 0.0]]), "inf"),
    "words as commands": (lambda: simulate(ROBOT, SOIL, [["fast", "slow"]]), "numbers"),
    "ragged commands": (lambda: simulate(ROBOT, SOIL, [[1.0], [1.0, 2.0]]), "regular shape"),
    "three soils": (lambda: simulate(ROBOT, [SOIL] * 3, STILL), "3 soils"),
    "unknown state": (lambda: simulate(ROBOT, SOIL, STILL, initial_state={"speed": 1.0}), "'speed'"),
    "NaN state": (lambda: simulate(ROBOT, SOIL, STILL, initial_state={"v_x": math.nan}), "nan"),
    "word as state": (lambda: simulate(ROBOT, SOIL, STILL, initial_state={"v_x": "fast"}), "'fast'"),
    "state of wrong shape": (lambda: _simulator().reset(state={"v_x": [1.0, 2.0, 3.0]}), "(3,)"),
    "unknown effect": (lambda: simulate(ROBOT, SOIL, STILL, effects=["towed_drg=80"]), "'towed_drag'"),
    "effect without its size": (lambda: simulate(ROBOT, SOIL, STILL, effects=["towed_drag"]), "towed_drag=VALUE"),
    "effect beyond its range": (lambda: simulate(ROBOT, SOIL, STILL, effects=["slope=9"]), "Slope.angle is 9"),
    "effect of words": (lambda: simulate(ROBOT, SOIL, STILL, effects=["slope=steep"]), "steep"),
    "no environments": (lambda: Simulator(0), "count is 0"),
    "no threads": (lambda: Simulator(1, threads=0), "threads 0"),
    "batch of wrong size": (lambda: _simulator().step(np.zeros((3, 2))), "(3, 1, 2)"),
    "noise of wrong length": (lambda: _simulator().step(np.zeros((2, 5, 2)), np.zeros((2, 4, 8))), "(2, 4, 8)"),
    "noise of wrong channels": (lambda: _simulator().step(np.zeros((2, 5, 2)), np.zeros((2, 5, 3))), "(2, 5, 3)"),
    "NaN noise": (lambda: _simulator().step(np.zeros((2, 1, 2)), np.full((2, 1, 8), math.nan)), "nan"),
    "no samples": (lambda: _simulator().step(np.zeros((2, 2)), samples=0), "0 samples"),
    "entry beyond the row": (lambda: _simulator().step(np.zeros((2, 2)), recorded=[layout.SIZE]), "recorded"),
    "negative entry": (lambda: _simulator().step(np.zeros((2, 2)), recorded=[-1]), "recorded"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_sentence(case):
    call, words = BAD[case]
    with pytest.raises(InputError) as error:
        call()
    assert words in str(error.value)
    assert "\n" not in str(error.value)
    assert str(error.value).endswith(".")


def test_names_of_initial_state_are_documented_entries():
    assert {f"true_{name}" for name in INITIAL_STATE} <= set(TRUTH)


def test_ideal_instruments_read_the_truth():
    imu = Imu(accelerometer_noise=0.0, gyro_noise=0.0, accelerometer_resolution=0.0, gyro_resolution=0.0)
    sensors = Sensors(imu=imu, encoder=WheelEncoder(counts_per_revolution=0.0))
    drive = simulate(ROBOT, SOIL, np.tile([0.9, 0.5], (400, 1)), sensors=sensors, numerics=Numerics())
    np.testing.assert_allclose(drive["yaw_rate"], drive["true_yaw_rate"], atol=1e-15)
    np.testing.assert_allclose(drive["encoder_right"][-50:], drive["true_omega_right"][-50:], atol=1e-4)


def test_large_steps_follow_small_ones_where_friction_is_not_monotone():
    """A wide, light robot thrown about on ground of stiff shear, as refits of real drives go through.

    Newton's direction does no work there in nine steps of ten; halving it instead left 0.26 m/s.
    """
    warthog, ground = get_robot("warthog"), get_soil("firm_ground")
    wheel = replace(warthog.wheels[0], half_width=0.044, major_radius=0.166)
    robot = replace(
        warthog, mass=178.2, yaw_inertia=39.2, half_wheelbase=0.878, half_track=2.049, motor_rate=1.9, wheels=(wheel,)
    )
    soil = replace(
        ground, friction_angle=0.2845, sinkage_exponent=2.014, frictional_modulus=1.009e7, shear_modulus=8.08e-4,
        peak_stress_coefficient_0=0.3375, peak_stress_coefficient_1=0.4, exit_angle_ratio=0.9,
    )  # fmt: skip
    start = {"v_x": 0.47, "v_y": -0.48, "yaw_rate": -0.81, "omega_right": -24.9, "omega_left": -7.7}
    commands = np.tile((15.5, 4.3), (50, 1))
    steps = (Numerics(), Numerics(maximum_step=0.0005, accepted_error=1e-6))
    sensors = Sensors(Imu(sample_rate=50.0))
    drives = [simulate(robot, soil, commands, sensors=sensors, initial_state=start, numerics=n) for n in steps]
    for name in ("true_v_x", "true_v_y"):
        assert np.abs(drives[0][name] - drives[1][name]).max() < 0.08, name
