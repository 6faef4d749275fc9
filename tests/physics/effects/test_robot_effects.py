"""Robot: loads, masses, radii and drags against statics, rigid-body mechanics and balance of power."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddagr_gym.parameters import STANDARD_GRAVITY, Numerics
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects import parse_effect
from ddagr_gym.presets import get_robot
from ddagr_gym.simulator import Simulator

FINITE = st.floats(-2.0, 2.0)


def loads(columns):
    return np.array([columns[f"true_load_{wheel}"][-1] for wheel in (1, 2, 3, 4)])


def settled(robot, soil, effects, state=None):
    simulator = Simulator(1, effects=effects)
    simulator.configure(0, robot, soil)
    simulator.reset(state=state)
    return simulator.rows[0]


def test_payload_is_the_union_of_two_bodies(robot, soil):
    """Against point masses: the robot as two masses that have its mass and inertia, and the load as a third."""
    row = settled(robot, soil, ["payload=40,x=-0.25,y=0.1,height=0.8"])
    arm = np.sqrt(robot.yaw_inertia / robot.mass)
    masses = np.array([robot.mass / 2, robot.mass / 2, 40.0])
    places = np.array([[arm, 0.0, 0.45], [-arm, 0.0, 0.45], [-0.25, 0.1, 0.8]])
    centre = masses @ places / masses.sum()
    inertia = masses @ ((places - centre)[:, :2] ** 2).sum(axis=1)
    assert row[layout.MASS] == pytest.approx(masses.sum())
    assert row[layout.YAW_INERTIA] == pytest.approx(inertia)
    np.testing.assert_allclose(row[layout.CENTRE_OF_MASS : layout.CENTRE_OF_MASS + 3], centre)
    assert row[layout.LOAD : layout.LOAD + 4].sum() == pytest.approx(masses.sum() * STANDARD_GRAVITY)


def test_payload_presses_the_nearest_wheel_down(robot, soil):
    row = settled(robot, soil, ["payload=30,x=0.2,y=0.3"])
    carried = row[layout.LOAD : layout.LOAD + 4]
    sunk = row[layout.SINKAGE : layout.SINKAGE + 4]
    assert carried.argmax() == sunk.argmax() == 1
    assert carried.argmin() == sunk.argmin() == 2


def test_load_taken_off_again_leaves_the_robot(act, turning_row):
    loaded = act(parse_effect("payload=25,x=0.1,y=-0.2,height=0.9"), turning_row)
    unloaded = act(parse_effect("payload=-25,x=0.1,y=-0.2,height=0.9"), loaded)
    body = slice(layout.MASS, layout.MASS + 5)
    np.testing.assert_allclose(unloaded[body], turning_row[body], rtol=1e-12, atol=1e-12)


def test_offset_centre_shares_the_load_by_statics(robot, drive):
    columns = drive(["centre_of_mass_offset=0.066,y=-0.058"], np.zeros((5, 2)))
    weight = robot.mass * STANDARD_GRAVITY / 4
    x, y = 0.066 / robot.half_wheelbase, -0.058 / robot.half_track
    expected = [weight * (1 + sx * x) * (1 + sy * y) for sx, sy in ((1, -1), (1, 1), (-1, -1), (-1, 1))]
    np.testing.assert_allclose(loads(columns), expected)


@pytest.mark.parametrize("effect", ["centre_of_mass_offset=0,y={}", "wheel_radius_mismatch={}"])
def test_mirrored_asymmetry_mirrors_the_drive(drive, straight, effect):
    commands, state = straight(0.7)
    left = drive([effect.format(0.04)], commands, initial_state=state)
    right = drive([effect.format(-0.04)], commands, initial_state=state)
    np.testing.assert_allclose(left["yaw_rate"], -right["yaw_rate"], atol=1e-7)
    np.testing.assert_allclose(left["specific_force_x"], right["specific_force_x"], atol=1e-4)
    assert abs(left["yaw_rate"][-1]) > 5e-6


def test_offset_to_the_left_drags_the_robot_left(drive, straight):
    """The heavier bank sinks deeper and resists more: a little, while its speed loop holds it, more as it droops."""
    commands, state = straight(0.7)
    offset = "centre_of_mass_offset=0,y=0.1"
    held = drive([offset], commands, initial_state=state)["yaw_rate"][-1]
    drooping = drive([offset, "motor_droop=0.001"], commands, initial_state=state)["yaw_rate"][-1]
    assert drooping > 10 * held > 1e-4


def test_radius_mismatch_turns_with_the_same_curvature_at_every_speed(drive, straight):
    """With forces that are never extrapolated: that leaves some 5e-5 rad/s, a thirtieth of the slower yaw rate."""
    curvatures = []
    for speed in (0.4, 1.2):
        commands, state = straight(speed, 500)
        columns = drive(["wheel_radius_mismatch=0.02"], commands, initial_state=state, numerics=Numerics.smooth())
        np.testing.assert_allclose(columns["encoder_right"], columns["encoder_left"], atol=1e-12)
        curvatures.append(columns["yaw_rate"][-1] / columns["true_v_x"][-1])
    assert curvatures[0] == pytest.approx(curvatures[1], rel=1e-3)
    # no faster than without side slip, and no slower than the widest effective track of fielded robots allows
    kinematic = 0.02 / (2 * get_robot("ddagr").half_track)
    assert 0.4 * kinematic < curvatures[0] < kinematic


def test_radius_mismatch_gives_the_stated_radii(act, turning_row):
    row = act(parse_effect("wheel_radius_mismatch=0.1"), turning_row)
    radius = row[layout.WHEEL : layout.WHEEL + 4] + row[layout.WHEEL + 8 : layout.WHEEL + 12]
    nominal = 0.2794
    np.testing.assert_allclose(radius, nominal * np.array([1.05, 0.95, 1.05, 0.95]))


@pytest.mark.parametrize(
    ("effect", "force"), [("towed_drag=60", 60.0), ("towed_drag=60,rope=0.8", 60.0), ("viscous_drag=300", None)]
)
def test_wheels_pull_the_drag_in_steady_travel(drive, straight, effect, force):
    commands, state = straight(0.7, 800)
    columns = drive([effect], commands, initial_state=state)
    pull = sum(columns[f"true_force_x_{wheel}"][-1] for wheel in (1, 2, 3, 4))
    speed = columns["true_v_x"][-1]
    expected = 300.0 * speed if force is None else force * speed / np.hypot(speed, 0.01)
    assert pull == pytest.approx(expected, rel=1e-3)


def test_hitch_behind_the_robot_steadies_yaw(drive):
    commands = np.tile((0.8, 0.5), (500, 1))
    rates = [drive([f"towed_drag=80,hitch_distance={d}"], commands)["yaw_rate"][-1] for d in (0.0, 0.5, 1.0)]
    assert rates[0] > rates[1] > rates[2] > 0


def test_hitch_aside_pulls_the_robot_to_its_side(drive, straight):
    commands, state = straight(0.7, 400)
    left, middle, right = (
        drive([f"towed_drag=80,hitch_side={side}"], commands, initial_state=state)["true_yaw"][-1]
        for side in (0.3, 0.0, -0.3)
    )
    assert left > 0.005
    assert right == pytest.approx(-left, rel=1e-6)
    assert middle == pytest.approx(0.0, abs=1e-9)


def test_a_rope_of_no_length_is_none(drive):
    commands = np.concatenate([np.tile((0.8, 0.3), (900, 1)), np.tile((0.3, 0.8), (900, 1))])
    none, short, long = (drive([f"towed_drag=80,rope={rope}"], commands)["true_yaw"] for rope in (0.0, 0.01, 1.0))
    assert np.abs(long - none).max() > 0.01
    assert np.abs(short - none).max() < 0.1 * np.abs(long - none).max()


def circled(effect, way):
    """Row after a way [m] on a left circle of radius 2 m, with the force of the effect."""
    row, memory = np.zeros(layout.SIZE), np.zeros(layout.EFFECT_MEMORY)
    (_, pull), (_, lead) = effect.actions
    row[layout.V_X] = 0.2
    lead(row, effect.vector(), memory)
    row[layout.YAW_RATE] = 0.1
    for yaw in np.linspace(0.0, way / 2.0, 2000):
        row[layout.YAW] = yaw
        row[layout.X], row[layout.Y] = 2.0 * np.sin(yaw), 2.0 * (1.0 - np.cos(yaw))
        lead(row, effect.vector(), memory)
    pull(row, effect.vector(), memory)
    return row, memory


def test_a_load_on_a_rope_follows_on_its_own_circle():
    """The tractrix of a circle ends on the concentric one that the rope touches."""
    effect = parse_effect("towed_drag=80,hitch_distance=0.6,rope=1")
    row, memory = circled(effect, 12.0)
    hitch = np.hypot(2.0, 0.6)
    assert np.hypot(memory[0], memory[1] - 2.0) == pytest.approx(np.sqrt(hitch**2 - 1.0), rel=1e-3)
    force = row[layout.BODY_FORCE : layout.BODY_FORCE + 3]
    # from the tangent at the hitch, which points outwards by atan(0.6/2), inwards by asin(rope/radius)
    angle = np.arcsin(1.0 / hitch) + np.arctan2(0.6, 2.0)
    np.testing.assert_allclose(force[:2], 80.0 * np.array([-np.cos(angle), np.sin(angle)]), rtol=5e-3)
    assert force[2] == pytest.approx(-0.6 * force[1])


def test_a_rope_turns_over_its_own_length():
    effect = parse_effect("towed_drag=80,hitch_distance=0,rope=1")
    angles = []
    for way in (0.01, 1.0, 12.0):
        force = circled(effect, way)[0][layout.BODY_FORCE : layout.BODY_FORCE + 2]
        angles.append(np.arctan2(force[1], -force[0]))
    assert angles[0] < 0.01
    assert 0.5 * angles[2] < angles[1] < 0.85 * angles[2]


def test_a_drive_begins_with_the_load_where_a_steady_turn_has_it():
    effect = parse_effect("towed_drag=80,hitch_distance=0,rope=0.5")
    row, memory = np.zeros(layout.SIZE), np.zeros(layout.EFFECT_MEMORY)
    row[layout.V_X], row[layout.YAW_RATE] = 0.2, 0.1
    effect.actions[1][1](row, effect.vector(), memory)
    assert np.hypot(*memory[:2]) == pytest.approx(0.5)
    # arctangent for arcsine: 3 percent at a quarter of the radius
    assert np.arctan2(memory[1], -memory[0]) == pytest.approx(np.arcsin(0.25), rel=0.04)


def test_a_rope_goes_slack_when_the_robot_backs(drive, straight):
    forward, state = straight(0.7, 300)
    commands = np.concatenate([forward, np.full((400, 2), -0.7), np.full((700, 2), 0.7)])
    columns = drive(["towed_drag=80,rope=1"], commands, initial_state=state)
    plain = drive([], commands, initial_state=state)
    held = columns["true_v_x"] - plain["true_v_x"]
    assert held[250] < -1e-3
    np.testing.assert_allclose(held[650:690], 0.0, atol=1e-5)
    # it pulls again where it was slackened
    np.testing.assert_allclose(held[850:900], 0.0, atol=1e-5)
    assert held[-1] == pytest.approx(held[250], rel=0.02)


@given(v_x=FINITE, v_y=FINITE, yaw_rate=FINITE, load=st.tuples(*2 * [st.floats(-3.0, 3.0)]), rope=st.floats(0.01, 5.0))
def test_a_rope_takes_power(v_x, v_y, yaw_rate, load, rope):
    effect = parse_effect(f"towed_drag=100,hitch_side=0.3,rope={rope}")
    (_, pull), (_, lead) = effect.actions
    row, memory = np.zeros(layout.SIZE), np.zeros(layout.EFFECT_MEMORY)
    row[layout.V_X], row[layout.V_Y], row[layout.YAW_RATE] = v_x, v_y, yaw_rate
    memory[:3] = *load, 1.0
    lead(row, effect.vector(), memory)
    pull(row, effect.vector(), memory)
    force = row[layout.BODY_FORCE : layout.BODY_FORCE + 3]
    assert np.hypot(*force[:2]) <= 100.0 * (1.0 + 1e-12)
    assert force @ (v_x, v_y, yaw_rate) <= 1e-9
    assert np.hypot(memory[0] + 0.5, memory[1] - 0.3) <= rope * (1.0 + 1e-12) + 1e-12


@given(
    v_x=FINITE,
    v_y=FINITE,
    yaw_rate=FINITE,
    hitch=st.floats(0.0, 5.0),
    side=st.floats(-2.0, 2.0),
    size=st.floats(0.0, 2000.0),
)
def test_drags_take_power(v_x, v_y, yaw_rate, hitch, side, size):
    towed = parse_effect(f"towed_drag={size},hitch_distance={hitch},hitch_side={side}")
    for effect in (towed, parse_effect(f"viscous_drag={size}")):
        row = np.zeros(layout.SIZE)
        row[layout.V_X], row[layout.V_Y], row[layout.YAW_RATE] = v_x, v_y, yaw_rate
        effect.actions[0][1](row, effect.vector(), np.zeros(layout.EFFECT_MEMORY))
        force = row[layout.BODY_FORCE : layout.BODY_FORCE + 3]
        assert force @ (v_x, v_y, yaw_rate) <= 1e-12


def test_effects_of_the_robot_add_up(robot, soil):
    """Two payloads are one of both masses at their common centre."""
    row = settled(robot, soil, ["payload=10,x=0.2,y=0.1,height=0.5", "payload=30,x=-0.2,y=0.1,height=0.9"])
    other = settled(robot, soil, ["payload=40,x=-0.1,y=0.1,height=0.8"])
    np.testing.assert_allclose(row[layout.LOAD : layout.LOAD + 4], other[layout.LOAD : layout.LOAD + 4], rtol=1e-9)
    # the two have an inertia of their own about it
    own = 10 * 30 / 40 * 0.4**2
    assert row[layout.YAW_INERTIA] - other[layout.YAW_INERTIA] == pytest.approx(own)
