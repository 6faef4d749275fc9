"""The time step: order, agreement with the converged solution, rest, and invariances of the motion."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ddagr_gym.identification.fit_numerics import block_mean_numerics
from ddagr_gym.identification.parameters import soil_entries
from ddagr_gym.identification.window_model import ideal_sensors
from ddagr_gym.parameters import STANDARD_GRAVITY, Drivetrain, Imu, Numerics, Sensors, TorusWheel
from ddagr_gym.physics import layout
from ddagr_gym.presets import get_robot, get_soil, soil_names
from ddagr_gym.simulator import Simulator, simulate

ROBOT, SOIL = get_robot("ddagr"), get_soil("thesis_a1")
NOISELESS = Sensors(imu=Imu(accelerometer_noise=0.0, gyro_noise=0.0, accelerometer_resolution=0.0, gyro_resolution=0.0))
VELOCITIES = ("true_v_x", "true_v_y", "true_yaw_rate")
MOTION = (*VELOCITIES, "true_x", "true_y", "true_yaw")


def _drive(commands, robot=ROBOT, soil=SOIL, **options):
    return simulate(robot, soil, commands, sensors=options.pop("sensors", NOISELESS), **options)


def _stack(drive, names=VELOCITIES):
    return np.array([drive[name] for name in names])


# Order


SMOOTH = {
    "entering a turn": (
        (0.6, 1.1),
        {"v_x": 0.18, "v_y": 0.002, "yaw_rate": -0.02, "omega_right": 0.6, "omega_left": 0.9},
    ),
    "fast and sliding": (
        (1.8, 1.2),
        {"v_x": 0.5, "v_y": 0.05, "yaw_rate": 0.1, "omega_right": 1.8, "omega_left": 1.8},
    ),
}


@pytest.mark.parametrize("manoeuvre", SMOOTH)
@pytest.mark.parametrize(("refresh", "nodes"), [(0.0, 8), (0.05, 2)], ids=["exact Jacobian", "coarse stale Jacobian"])
def test_observed_order_is_two_with_any_jacobian(manoeuvre, refresh, nodes):
    commands, state = SMOOTH[manoeuvre]

    def end(substeps):
        numerics = Numerics(
            section_nodes=16, contact_nodes=16, jacobian_contact_nodes=nodes, substeps=substeps, launch_substeps=1,
            launch_change=1e9, accepted_error=1e9, jacobian_refresh=refresh, sinkage_tolerance=1e-12,
        )  # fmt: skip
        return _stack(_drive(np.tile(commands, (40, 1)), initial_state=state, numerics=numerics), MOTION)[:, -1]

    exact = end(64)
    errors = [np.linalg.norm(end(substeps) - exact) for substeps in (1, 2, 4, 8)]
    steps = np.log2([1, 2, 4, 8])
    order = -np.polyfit(steps, np.log2(errors), 1)[0]
    assert order == pytest.approx(2.0, abs=0.2)
    assert errors[0] < 1e-4


def test_default_numerics_follow_the_converged_solution_through_a_locked_turn():
    commands = np.concatenate([np.tile([0.701, 0.701], (125, 1)), np.tile([0.0, 1.195], (250, 1))])
    error = np.abs(_stack(_drive(commands)) - _stack(_drive(commands, numerics=Numerics.finest())))
    # while the robot starts from rest the damping exceeds 1e3 1/s; afterwards the motion is resolved
    assert error.max() < 2e-3
    assert np.sqrt(np.mean(error**2, axis=1)).max() < 2e-4
    assert error[:, 200:].max() < 2e-4


CONVERGED = Numerics(
    substeps=32, accepted_error=2e-4, jacobian_refresh=0.02, force_extrapolation=0.0, sinkage_tolerance=1e-7
)


@pytest.mark.parametrize("name", ["thesis_a1", "firm_ground"])
def test_default_numerics_follow_the_converged_solution_under_an_untrained_policy(name):
    """Bank speeds drawn anew every 80 ms: wheels reverse, the robot creeps, steps are divided."""
    commands = np.random.default_rng(3).uniform(-2.0, 2.0, (60, 2)).repeat(10, axis=0)
    error = _stack(_drive(commands, soil=get_soil(name)))
    error -= _stack(_drive(commands, soil=get_soil(name), numerics=CONVERGED))
    assert np.sqrt(np.mean(error**2, axis=1)).max() < 3e-4


def test_fine_steps_follow_the_converged_solution_where_friction_changes_sign_within_them():
    """Shear displacement modulus of 1.2 mm under a robot that starts, stops and speeds up straight."""
    soil = replace(SOIL, shear_modulus=0.2 * SOIL.shear_modulus, cohesion=1.5 * SOIL.cohesion, exit_angle_ratio=1.0)
    speeds = np.concatenate([np.full(150, 0.7), np.zeros(100), np.full(150, 0.5), np.linspace(0.5, 1.0, 100)])
    commands = np.stack([speeds, speeds], axis=1)
    fine = replace(Numerics.smooth(), maximum_step=0.02, accepted_error=1e-4, launch_change=1e9)
    error = _stack(_drive(commands, soil=soil, numerics=fine))
    error -= _stack(_drive(commands, soil=soil, numerics=replace(fine, maximum_step=1e-3, accepted_error=1e-6)))
    assert np.sqrt(np.mean(error**2, axis=1)).max() < 5e-4


SLOW = (
    (0.099, 0.036, -0.172, 0.095, 1.259),
    (-0.078, -0.068, -0.996, -3.855, 2.933),
    (-0.132, 0.068, -0.425, -1.8, 1.0),
)
"""Robots that turn slowly: v_x, v_y, yaw rate and speeds of the right and the left bank."""


def test_long_steps_follow_the_converged_solution_in_soil_as_strong_as_a_refit_makes_it():
    """Ten times the load of friction, within 1.6 mm of sliding, under motors whose speeds depend on the ground."""
    wheels = (TorusWheel(0.05, 0.068, 0.108),) * 4
    robot = replace(
        get_robot("husky"), mass=88.0, yaw_inertia=2.5, half_track=0.29, half_wheelbase=0.25, wheels=wheels,
        motor_rate=7.0, drivetrain=Drivetrain(integral_rate=0.09),
    )  # fmt: skip
    soil = replace(
        get_soil("firm_ground"), sinkage_exponent=0.95, frictional_modulus=3.1e5, shear_modulus=1.6e-3,
        peak_stress_coefficient_0=0.18, peak_stress_coefficient_1=0.05, exit_angle_ratio=1.0,
    )  # fmt: skip

    def yaw_rates(numerics):
        simulator = Simulator(len(SLOW), numerics=numerics)
        for number in range(len(SLOW)):
            simulator.configure(number, robot, soil, ideal_sensors(0.05))
        simulator.rows[:, soil_entries(layout.SOIL_FRICTION_TANGENT)] = 10.0
        simulator.reset(
            state=dict(zip(("v_x", "v_y", "yaw_rate", "omega_right", "omega_left"), np.array(SLOW).T, strict=True))
        )
        commands = np.tile([0.5, 1.16], (len(SLOW), 100, 1))
        return simulator.step(commands, recorded=(layout.YAW_RATE,))[1][..., 0]

    long = block_mean_numerics()
    converged = replace(long, maximum_step=5e-4, accepted_error=2e-5, sinkage_tolerance=1e-6)
    error = yaw_rates(long) - yaw_rates(converged)
    assert np.sqrt(np.mean(error**2, axis=1)).max() < 3e-3


@pytest.mark.parametrize("limit", [0.0, 0.03])
def test_forces_extrapolated_between_steps_cost_no_accuracy(limit):
    commands = np.concatenate([np.tile([0.8, 0.8], (100, 1)), np.tile([0.4, 1.2], (200, 1))])
    drive = _drive(commands, numerics=Numerics(force_extrapolation=limit))
    error = _stack(drive) - _stack(_drive(commands, numerics=CONVERGED))
    assert np.sqrt(np.mean(error**2, axis=1)).max() < 5e-5
    # the forces handed out belong to the motion handed out
    for i in range(1, 5):
        velocity = drive["true_v_x"] + (1 if i % 2 else -1) * ROBOT.half_track * drive["true_yaw_rate"]
        rim = ROBOT.wheels[0].outer_radius * drive["true_omega_right" if i % 2 else "true_omega_left"]
        larger = np.maximum(np.abs(velocity), np.abs(rim))[50:]
        slip = drive[f"true_slip_ratio_{i}"][50:]
        np.testing.assert_allclose(slip * larger, (rim - velocity)[50:], atol=1e-12)


# Rest


@pytest.mark.parametrize("angle", [0.03, 0.1])
@pytest.mark.parametrize("yaw", [0.0, 0.8, math.pi / 2])
@pytest.mark.parametrize("name", ["thesis_a1", "firm_ground", "dry_sand_lll_0"])
def test_robot_stands_on_a_slope(name, yaw, angle):
    drive = _drive(np.zeros((1000, 2)), soil=get_soil(name), effects=[f"slope={angle}"], initial_state={"yaw": yaw})
    assert math.hypot(drive["true_x"][-1], drive["true_y"][-1]) < 2e-4
    assert abs(drive["true_yaw"][-1] - yaw) < 1e-5


@pytest.mark.parametrize("angle", [0.1, 0.2, 0.3])
@pytest.mark.parametrize("yaw", [0.0, 0.8, math.pi / 2])
@pytest.mark.parametrize("name", ["thesis_a1", "firm_ground", "dry_sand_lll_0"])
def test_robot_that_stands_does_not_chatter(name, yaw, angle):
    drive = _drive(np.zeros((600, 2)), soil=get_soil(name), effects=[f"slope={angle}"], initial_state={"yaw": yaw})
    felt = _stack(drive, ("specific_force_x", "specific_force_y"))[:, 125:]
    assert np.ptp(felt, axis=1).max() < 1e-4
    along = STANDARD_GRAVITY * math.sin(angle)
    np.testing.assert_allclose(felt[:, -1], [along * math.cos(yaw), -along * math.sin(yaw)], atol=1e-4)


@pytest.mark.parametrize("name", ["thesis_a1", "firm_ground", "dry_sand_lll_0"])
def test_robot_stops_without_rolling_back(name):
    commands = np.concatenate([np.tile([1.0, 1.0], (200, 1)), np.zeros((600, 2))])
    drive = _drive(commands, soil=get_soil(name))
    assert drive["true_v_x"].max() > 0.2
    assert drive["true_v_x"].min() > -2e-5
    assert (np.diff(drive["true_x"]) > -1e-6).all()
    assert abs(drive["true_v_x"][-1]) < 1e-3
    assert np.abs(drive["specific_force_x"][-100:]).max() < 0.02


def test_still_robot_on_the_flat_stays_exactly_where_it_is():
    drive = _drive(np.zeros((250, 2)))
    np.testing.assert_allclose(_stack(drive, MOTION), 0.0, atol=1e-15)


# Invariances


TURN = np.concatenate([np.tile([0.4, 1.2], (150, 1)), np.tile([1.0, -0.3], (150, 1))])


def test_motion_does_not_depend_on_where_and_how_the_robot_stands():
    here = _drive(TURN)
    there = _drive(TURN, initial_state={"x": 7.0, "y": -3.0, "yaw": 1.1})
    np.testing.assert_allclose(_stack(there), _stack(here), atol=1e-12)
    place = (here["true_x"] + 1j * here["true_y"]) * np.exp(1.1j) + (7.0 - 3.0j)
    np.testing.assert_allclose(there["true_x"] + 1j * there["true_y"], place, atol=1e-9)
    np.testing.assert_allclose(there["true_yaw"] - 1.1, here["true_yaw"], atol=1e-12)


def test_mirrored_commands_mirror_the_path():
    right, left = _drive(TURN), _drive(TURN[:, ::-1])
    signs = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])[:, None]
    # rounding differs between the images, and near rest friction amplifies it
    np.testing.assert_allclose(_stack(left, MOTION), signs * _stack(right, MOTION), atol=2e-6)


def test_reversed_commands_reverse_a_symmetric_robot():
    forward, backward = _drive(TURN), _drive(-TURN[:, ::-1])
    np.testing.assert_allclose(backward["true_v_x"], -forward["true_v_x"], atol=2e-6)
    np.testing.assert_allclose(backward["true_yaw_rate"], forward["true_yaw_rate"], atol=2e-6)


@pytest.mark.parametrize("factor", [2.0, 0.25, 3.7])
def test_heavier_robot_in_stronger_soil_moves_alike(factor):
    """Mass, inertia and the soil's stresses times one factor: all forces scale, the motion does not change."""
    robot = ROBOT.with_values(mass=factor * ROBOT.mass, yaw_inertia=factor * ROBOT.yaw_inertia)
    soil = SOIL.with_values(
        cohesion=factor * SOIL.cohesion,
        cohesive_modulus=factor * SOIL.cohesive_modulus,
        frictional_modulus=factor * SOIL.frictional_modulus,
    )
    base, scaled = _drive(TURN), _drive(TURN, robot=robot, soil=soil)
    np.testing.assert_allclose(_stack(scaled, MOTION), _stack(base, MOTION), atol=1e-6)
    np.testing.assert_allclose(scaled["true_force_x_1"], factor * base["true_force_x_1"], atol=0.5 * factor)


@pytest.mark.parametrize(
    ("change", "slower"),
    [
        # limiting case: what it does to the steady speed of a straight drive
        # hard ground that grips at once: hardly any sinkage, hardly any resistance
        ({"cohesive_modulus": 0.0, "frictional_modulus": 3e8, "sinkage_exponent": 1.0, "shear_modulus": 1e-4}, False),
        ({"cohesion": 0.0, "friction_angle": 0.12}, True),  # little grip: more slip for the same resistance
        ({"shear_modulus": 0.05}, True),  # soft in shear: more slip for the same resistance
        ({"exit_angle_ratio": 0.0}, True),  # no pressure behind the axle: more resistance
    ],
)
def test_limiting_soils_speed_a_straight_drive_up_or_down(change, slower):
    straight = np.tile([0.701, 0.701], (400, 1))
    base = _drive(straight)["true_v_x"][-1]
    changed = _drive(straight, soil=SOIL.with_values(**change))["true_v_x"][-1]
    assert (changed < base - 1e-4) if slower else (changed > base + 1e-4)


def test_without_grip_the_wheels_spin_and_the_robot_does_not_advance():
    """Outside the model's range it may be pushed back: pressure stays on the side where the tread enters."""
    ice = SOIL.with_values(cohesion=0.0, friction_angle=0.0)
    drive = _drive(np.tile([1.0, 1.0], (250, 1)), soil=ice)
    assert drive["true_v_x"].max() <= 0.0
    assert np.abs(drive["true_slip_ratio_1"]).min() >= 1.0


# Robustness


COMMANDS = st.lists(st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)), min_size=2, max_size=6)


@given(st.sampled_from(soil_names()), COMMANDS, st.floats(-0.15, 0.15))
@settings(max_examples=40)
def test_any_drive_stays_finite_and_no_faster_than_its_wheels(name, pieces, slope):
    commands = np.repeat(np.array(pieces), 40, axis=0)
    drive = _drive(commands, soil=get_soil(name), effects=[f"slope={slope}"])
    values = _stack(drive, tuple(k for k in drive if k.startswith("true_")))
    assert np.isfinite(values).all()
    rim = ROBOT.wheels[0].outer_radius * np.abs(commands).max()
    bogged = any(drive[f"true_bogged_{i}"].any() for i in range(1, 5))
    if not bogged:
        # a slope adds what gravity gives the robot while the soil has not yet taken hold of it
        assert np.abs(drive["true_v_x"]).max() <= 1.05 * rim + 0.03
        assert np.abs(drive["true_yaw_rate"]).max() * ROBOT.half_track <= 1.05 * rim + 0.03
