"""Ground: slope, changed soils and what wheels do to soil, against statics, earth pressure theory and limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddagr_gym.identification.effect_parameters import effect_parameters
from ddagr_gym.parameters import STANDARD_GRAVITY
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects import parse_effect
from ddagr_gym.physics.effects.lateral_bulldozing import passive_resistance
from ddagr_gym.physics.effects.soil_patch import SoilPatch, from_middle_line

SPEED = st.floats(-1.5, 1.5)
STRENGTH = (layout.SOIL_COHESION, layout.SOIL_FRICTION_TANGENT)
STIFFNESS = (layout.SOIL_COHESIVE_MODULUS, layout.SOIL_FRICTIONAL_MODULUS)


def soil_factors(row, base, entries):
    """(4,) factor on soil entries of each wheel; the entries must agree."""
    ratios = np.array(
        [[row[layout.SOIL + 9 * w + e] / base[layout.SOIL + 9 * w + e] for e in entries] for w in range(4)]
    )
    np.testing.assert_allclose(ratios[:, 0], ratios[:, 1], rtol=1e-12)
    return ratios[:, 0]


def scaled_soil(soil, strength, stiffness):
    return soil.with_values(
        cohesion=strength * soil.cohesion,
        friction_angle=math.atan(strength * math.tan(soil.friction_angle)),
        cohesive_modulus=stiffness * soil.cohesive_modulus,
        frictional_modulus=stiffness * soil.frictional_modulus,
    )


def assert_same_drive(columns, expected, tolerance=1e-9):
    for name, values in expected.items():
        np.testing.assert_allclose(columns[name], values, atol=tolerance, err_msg=name)


@pytest.mark.parametrize("yaw", [0.0, 1.0, math.pi, -2.0])
def test_parked_robot_feels_the_slope_in_its_own_axes(drive, yaw):
    columns = drive(["slope=0.06,direction=0.5"], np.zeros((250, 2)), initial_state={"yaw": yaw})
    along = STANDARD_GRAVITY * math.sin(0.06)
    assert columns["specific_force_x"][-1] == pytest.approx(along * math.cos(yaw - 0.5), abs=0.01)
    assert columns["specific_force_y"][-1] == pytest.approx(-along * math.sin(yaw - 0.5), abs=0.01)


def test_slope_loads_the_lower_wheels(robot, drive):
    columns = drive(["slope=0.1,direction=0"], np.zeros((5, 2)))
    shift = robot.centre_of_mass[2] * math.tan(0.1) / robot.half_wheelbase
    weight = robot.mass * STANDARD_GRAVITY * math.cos(0.1) / 4
    assert columns["true_load_1"][-1] == pytest.approx(weight * (1 - shift))
    assert columns["true_load_4"][-1] == pytest.approx(weight * (1 + shift))


def test_two_slopes_add_as_gradients(act, turning_row):
    row = act(parse_effect("slope=0.2,direction=0.3"), act(parse_effect("slope=-0.2,direction=0.3"), turning_row))
    np.testing.assert_allclose(row[layout.SLOPE : layout.SLOPE + 2], 0.0, atol=1e-15)


def test_soil_change_is_another_soil(drive, soil):
    commands = np.tile((0.8, 0.3), (150, 1))
    changed = drive(["soil_change=0.8,stiffness=1.5"], commands)
    assert_same_drive(changed, drive((), commands, soil=scaled_soil(soil, 0.8, 1.5)))


def test_soil_change_begins_at_its_onset(drive, soil):
    commands = np.tile((0.8, 0.3), (900, 1))
    nominal = drive((), commands)
    changed = drive(["soil_change=0.7,stiffness=0.8,onset=3.6"], commands)
    other = drive((), commands, soil=scaled_soil(soil, 0.7, 0.8))
    before = nominal["t"] < 1.5
    for name in ("true_yaw_rate", "true_sinkage_1"):
        np.testing.assert_allclose(changed[name][before], nominal[name][before], rtol=1e-3)
        assert changed[name][-1] == pytest.approx(other[name][-1], rel=1e-3)


def test_split_soil_is_two_soils_with_nominal_mean(drive, soil):
    commands = np.tile((0.6, 0.6), (150, 1))
    left, right = scaled_soil(soil, 1.44**0.5, 0.64**0.5), scaled_soil(soil, 1.44**-0.5, 0.64**-0.5)
    columns = drive(["soil_split=1.44,stiffness=0.64"], commands)
    assert_same_drive(columns, drive((), commands, soil=(right, left, right, left)))


def test_split_soil_pulls_to_the_weaker_side(drive):
    commands = np.tile((0.7, 0.7), (400, 1))
    to_the_right = drive(["soil_split=2", "towed_drag=100,hitch_distance=0"], commands)["yaw_rate"][-1]
    to_the_left = drive(["soil_split=0.5", "towed_drag=100,hitch_distance=0"], commands)["yaw_rate"][-1]
    assert to_the_right < -1e-4
    assert to_the_left == pytest.approx(-to_the_right, rel=1e-3)


def test_patch_that_covers_everything_is_a_soil_change(drive):
    commands = np.tile((0.8, 0.3), (100, 1))
    patch = drive(["soil_patch=0.8,stiffness=1.3,radius=100"], commands)
    assert_same_drive(patch, drive(["soil_change=0.8,stiffness=1.3"], commands), 1e-7)


def test_patch_elsewhere_changes_nothing(drive):
    commands = np.tile((0.8, 0.3), (100, 1))
    assert_same_drive(drive(["soil_patch=0.3,centre_x=30"], commands), drive((), commands), 0.0)


def test_patch_acts_on_the_wheels_in_it(act, turning_row):
    """The front left wheel stands on the rim, where half of the factor acts; the others are outside."""
    row = turning_row.copy()
    x, y = row[layout.WHEEL_X + 1] + 0.2, row[layout.WHEEL_Y + 1]
    patched = act(parse_effect(f"soil_patch=0.5,stiffness=3,centre_x={x},centre_y={y},radius=0.2,edge=0.02"), row)
    np.testing.assert_allclose(soil_factors(patched, row, STRENGTH), [1, 0.75, 1, 1], atol=1e-9)
    np.testing.assert_allclose(soil_factors(patched, row, STIFFNESS), [1, 2.0, 1, 1], atol=1e-9)


@pytest.mark.parametrize(
    ("ahead", "aside", "half_length", "share"),
    [
        (0.0, 0.0, 50.0, 1.0),  # on the middle line
        (7.0, 0.2, 50.0, 0.5),  # on the rim, far from the centre
        (7.0, 0.3, 50.0, 0.0),
        (3.2, 0.0, 3.0, 0.5),  # on the rim of the round end
        (3.12, 0.16, 3.0, 0.5),  # the same, 0.12 and 0.16 m from the end of the line
        (3.3, 0.0, 3.0, 0.0),
        (-3.1, 0.0, 3.0, 1.0),  # half way from the other end to its rim
    ],
)
def test_band_acts_on_the_wheels_in_it(act, turning_row, ahead, aside, half_length, share):
    """The front left wheel, from the centre of a band across the diagonal to the rear right wheel; radius 0.2 m."""
    row = turning_row.copy()
    (x, y), rear = row[[layout.WHEEL_X + 1, layout.WHEEL_Y + 1]], row[[layout.WHEEL_X + 2, layout.WHEEL_Y + 2]]
    bearing = math.atan2(y - rear[1], x - rear[0]) + math.pi / 2
    cosine, sine = math.cos(bearing), math.sin(bearing)
    band = SoilPatch(
        0.5, 3.0, x - ahead * cosine + aside * sine, y - ahead * sine - aside * cosine, 0.2, 0.02, half_length, bearing
    )
    patched = act(band, row)
    np.testing.assert_allclose(soil_factors(patched, row, STRENGTH), [1, 1 - 0.5 * share, 1, 1], atol=1e-4)
    np.testing.assert_allclose(soil_factors(patched, row, STIFFNESS), [1, 1 + 2.0 * share, 1, 1], atol=1e-3)
    away = from_middle_line(np.array([ahead]), np.array([aside]), half_length, 0.0)[0]
    assert away == pytest.approx(math.hypot(max(abs(ahead) - half_length, 0.0), aside))


def test_patch_without_length_is_the_disc_to_the_bit(drive):
    commands = np.tile((0.8, 0.3), (100, 1))
    disc = drive(["soil_patch=0.6,centre_x=0.4,centre_y=0.1,radius=0.3"], commands)
    turned = drive(["soil_patch=0.6,centre_x=0.4,centre_y=0.1,radius=0.3,half_length=0,bearing=1.1"], commands)
    assert_same_drive(turned, disc, 0.0)


def test_fits_move_what_shows_of_a_disc_and_of_a_band():
    """A band is not shown where it lies along itself: the coordinate along which it runs is left alone."""
    moved = {
        text: [item.field for item in effect_parameters([parse_effect(f"soil_patch=0.6,{text}")])]
        for text in ("bearing=0.5", "half_length=9,bearing=0.5", "half_length=9,bearing=-1.2")
    }
    rest = ["strength", "stiffness"]
    assert list(moved.values()) == [
        [*rest, "centre_x", "centre_y", "radius"],
        [*rest, "centre_y", "radius", "bearing"],
        [*rest, "centre_x", "radius", "bearing"],
    ]


@given(friction=st.floats(0.0, 45.0), cohesion=st.floats(0.0, 5e4), depth=st.floats(1e-3, 0.2))
def test_bulldozing_pressure_is_hegedus_as_printed(friction, cohesion, depth):
    """Ishigami et al. (2007), with the angles that the effect's closed form has resolved."""
    phi = math.radians(friction)
    weight = 1500 * STANDARD_GRAVITY
    wedge = math.pi / 4 - phi / 2
    d_1 = 1 / math.tan(wedge) + math.tan(wedge + phi)
    d_2 = 1 / math.tan(wedge) + math.tan(phi) / math.tan(wedge) ** 2
    linear, square = passive_resistance(cohesion, math.tan(phi), weight)
    printed = d_1 * (cohesion * depth + d_2 * weight * depth**2 / 2)
    assert linear * depth + square * depth**2 == pytest.approx(printed, rel=1e-9)


def test_bulldozing_pressure_of_frictionless_clay_is_rankine():
    linear, square = passive_resistance(1e4, 0.0, 15e3)
    assert linear == pytest.approx(2 * 1e4)
    assert square == pytest.approx(15e3)  # Rankine's half, and as much again for the heap


def skidding_row(row, depth, v_x=0.2, v_y=0.1, yaw_rate=0.0, omega=0.7):
    row = row.copy()
    row[layout.SINKAGE : layout.SINKAGE + 4] = depth
    row[layout.WHEEL_V_X : layout.WHEEL_V_X + 4] = v_x
    row[layout.WHEEL_V_Y : layout.WHEEL_V_Y + 4] = v_y
    row[layout.WHEEL_OMEGA : layout.WHEEL_OMEGA + 4] = omega
    row[layout.YAW_RATE] = yaw_rate
    row[layout.EXTRA_FORCE_X : layout.EXTRA_FORCE_X + 16] = 0.0
    return row


def test_bulldozing_force_is_the_pressure_over_the_flank(act, turning_row, robot, soil):
    """Against quadrature over the circular flank of depth h(x) = R0 cos(theta) - R0 + depth."""
    depth, radius = 0.02, robot.wheels[0].outer_radius
    row = act(parse_effect("lateral_bulldozing=1,density=1800"), skidding_row(turning_row, depth, v_x=0, omega=0))
    linear, square = passive_resistance(soil.cohesion, math.tan(soil.friction_angle), 1800 * STANDARD_GRAVITY)
    x = np.linspace(0, math.sqrt(radius**2 - (radius - depth) ** 2), 2001)
    h = np.sqrt(radius**2 - x**2) - radius + depth
    front = np.trapezoid(linear * h + square * h**2, x)
    expected = front * (1 + soil.exit_angle_ratio)
    np.testing.assert_allclose(-row[layout.EXTRA_FORCE_Y : layout.EXTRA_FORCE_Y + 4], expected, rtol=0.03)


def test_bulldozing_needs_sideways_motion_and_depth(act, turning_row):
    effect = parse_effect("lateral_bulldozing=1")
    still = act(effect, skidding_row(turning_row, 0.02, v_y=0.0))
    unloaded = act(effect, skidding_row(turning_row, 0.0))
    np.testing.assert_array_equal(still[layout.EXTRA_FORCE_Y : layout.EXTRA_FORCE_Y + 4], 0.0)
    np.testing.assert_array_equal(unloaded[layout.EXTRA_FORCE_Y : layout.EXTRA_FORCE_Y + 4], 0.0)
    forces = [act(effect, skidding_row(turning_row, d))[layout.EXTRA_FORCE_Y] for d in (0.01, 0.02, 0.04)]
    assert 0 > forces[0] > 2.5 * forces[0] > forces[1] > 2.5 * forces[1] > forces[2]


def test_bulldozing_does_not_depend_on_speed(act, turning_row):
    effect = parse_effect("lateral_bulldozing=1")
    slow = act(effect, skidding_row(turning_row, 0.02, 0.2, 0.02, 0.1, 0.7))[layout.EXTRA_FORCE_Y]
    fast = act(effect, skidding_row(turning_row, 0.02, 2.0, 0.2, 1.0, 7.0))[layout.EXTRA_FORCE_Y]
    assert fast == pytest.approx(slow, rel=3e-3)


@given(v_x=SPEED, v_y=SPEED, yaw_rate=SPEED, omega=SPEED, depth=st.floats(0.0, 0.05))
def test_bulldozing_takes_power(turning_row, v_x, v_y, yaw_rate, omega, depth):
    effect = parse_effect("lateral_bulldozing=2")
    row = skidding_row(turning_row, depth, v_x, v_y, yaw_rate, omega)
    effect.actions[0][1](row, effect.vector(), np.zeros(layout.EFFECT_MEMORY))
    for wheel in range(4):
        power = row[layout.EXTRA_FORCE_Y + wheel] * v_y + row[layout.EXTRA_YAW_MOMENT + wheel] * yaw_rate
        assert power <= 1e-12


def sliding_row(row, v_x, v_y):
    """The body and all wheels move alike, the wheels locked."""
    row = skidding_row(row, 0.02, v_x=v_x, v_y=v_y, omega=0.0)
    row[layout.V_X], row[layout.V_Y], row[layout.OMEGA : layout.OMEGA + 2] = v_x, v_y, 0.0
    return row


def side_force(act, row, effect: str, v_y: float) -> float:
    return float(-act(parse_effect(effect), sliding_row(row, 0.3, v_y))[layout.EXTRA_FORCE_Y])


def test_soil_that_is_heaped_up_first_resists_by_how_far_aside_it_is_pushed(act, turning_row):
    at_once = [side_force(act, turning_row, "lateral_bulldozing=1", v_y) for v_y in (0.03, 0.06)]
    heaped = [side_force(act, turning_row, "lateral_bulldozing=1,angle=0.8,way=0.3", v_y) for v_y in (0.03, 0.06)]
    assert at_once[1] / at_once[0] < 1.15
    assert heaped[1] / heaped[0] == pytest.approx(2.0, rel=0.15)
    assert heaped[1] < 0.3 * at_once[1]


def test_a_heap_follows_over_its_way(turning_row):
    effect = parse_effect("lateral_bulldozing=1,angle=0.8,way=0.3")
    heap_up, memory = effect.actions[1][1], np.zeros(layout.EFFECT_MEMORY)
    straight, aside = (sliding_row(turning_row, 0.3, v_y) for v_y in (0.0, 0.15))
    heap_up(straight, effect.vector(), memory)
    samples = round(0.3 / 0.3 / aside[layout.SAMPLE_PERIOD])
    for _ in range(samples):
        heap_up(aside, effect.vector(), memory)
    np.testing.assert_allclose(aside[layout.HEAPED : layout.HEAPED + 4], 0.5 * (1 - np.exp(-1.0)), rtol=0.01)


def test_bulldozing_slows_turns_and_leaves_straight_drives(drive, straight):
    commands, state = straight(0.7)
    effect = ["lateral_bulldozing=1"]
    assert_same_drive(drive(effect, commands, initial_state=state), drive((), commands, initial_state=state), 1e-5)
    turn = np.tile((0.8, 0.3), (300, 1))
    assert 0 < drive(effect, turn)["yaw_rate"][-1] < 0.99 * drive((), turn)["yaw_rate"][-1]


def test_slip_raises_the_exponent_of_the_wheel_that_slips(act, turning_row):
    """Right bank locked: slip -1; left rolling freely: slip 0."""
    row = turning_row.copy()
    row[layout.V_X], row[layout.V_Y], row[layout.YAW_RATE] = 0.2, 0.0, 0.0
    row[layout.OMEGA], row[layout.OMEGA + 1] = 0.0, 0.2 / 0.2794
    exponents = act(parse_effect("slip_sinkage=0.4"), row)[layout.SOIL + layout.SOIL_EXPONENT :: 9][:4]
    np.testing.assert_allclose(exponents, [0.5 + 0.4 * 0.98, 0.5, 0.5 + 0.4 * 0.98, 0.5], atol=1e-3)


def test_slip_digs_over_a_way_not_over_a_time(act, turning_row):
    effect = parse_effect("slip_sinkage=1")
    depths = {}
    for speed, samples in ((0.2, 600), (0.4, 300)):
        row, memory = turning_row.copy(), np.zeros(layout.EFFECT_MEMORY)
        row[layout.YAW_RATE] = row[layout.V_Y] = 0.0
        row[layout.V_X], row[layout.OMEGA : layout.OMEGA + 2] = speed, speed / 0.2794
        act(effect, row, memory)
        row[layout.OMEGA : layout.OMEGA + 2] = 0.0
        depths[speed] = [act(effect, row, memory)[layout.SOIL + layout.SOIL_EXPONENT] for _ in range(samples)]
    assert depths[0.2][0] < 0.52
    assert depths[0.2][-1] == pytest.approx(1.48, abs=1e-3)
    np.testing.assert_allclose(depths[0.2][1::2], depths[0.4], rtol=1e-9)


def test_counter_rotation_counts_as_full_slip(act, turning_row):
    row = turning_row.copy()
    row[layout.V_X], row[layout.V_Y], row[layout.YAW_RATE] = -0.2, 0.0, 0.0
    row[layout.OMEGA : layout.OMEGA + 2] = 0.8
    assert act(parse_effect("slip_sinkage=0.4"), row)[layout.SOIL + layout.SOIL_EXPONENT] == pytest.approx(
        0.892, abs=1e-3
    )


def test_locked_wheels_sink_deeper(drive):
    commands = np.tile((0.7, 0.0), (400, 1))
    plain, digging = drive((), commands), drive(["slip_sinkage=0.3"], commands)
    assert digging["true_sinkage_4"][-1] > 1.1 * plain["true_sinkage_4"][-1]
    # the driven bank slips less than the locked one skids
    driven, locked = (digging[f"true_sinkage_{w}"][-1] / plain[f"true_sinkage_{w}"][-1] for w in (1, 2))
    assert locked > driven > 1.0


@pytest.mark.parametrize(
    ("v_x", "v_y", "yaw_rate", "factors"),
    [
        (0.5, 0.0, 0.0, [1.0, 1.0, 1.6, 1.6]),
        (-0.5, 0.0, 0.0, [1.6, 1.6, 1.0, 1.0]),
        (0.5, 0.4, 0.0, [1.0, 1.0, 1.0, 1.0]),
        (0.2, 0.0, 0.6, [1.0, 1.0, 1.0, 1.0]),
        (0.0, 0.0, 0.5, [1.0, 1.0, 1.0, 1.0]),
    ],
    ids=["forwards", "backwards", "sideways", "tight turn", "on the spot"],
)
def test_the_following_axle_runs_in_the_rut(act, turning_row, v_x, v_y, yaw_rate, factors):
    row = turning_row.copy()
    row[layout.V_X], row[layout.V_Y], row[layout.YAW_RATE] = v_x, v_y, yaw_rate
    ruts = act(parse_effect("multipass=0.6"), row)
    np.testing.assert_allclose(soil_factors(ruts, row, STIFFNESS), factors, atol=2e-3)
    np.testing.assert_array_equal(soil_factors(ruts, row, STRENGTH), 1.0)


def test_half_the_rut_is_missed_by_eight_tenths_of_the_tyre_width(act, turning_row, robot):
    """exp(-d^2/w^2) = 1/2 at d = 0.833 w, d = v_y t over one wheelbase."""
    row = turning_row.copy()
    width = 2 * robot.wheels[0].half_width
    row[layout.V_X], row[layout.YAW_RATE] = 2.0, 0.0
    row[layout.V_Y] = math.sqrt(math.log(2)) * width / (2 * robot.half_wheelbase) * 2.0
    factors = soil_factors(act(parse_effect("multipass=1"), row), row, STIFFNESS)
    np.testing.assert_allclose(factors[2:], 1.5, atol=1e-3)


def test_rear_wheels_sink_less_in_ruts(drive, straight):
    commands, state = straight(0.7)
    columns = drive(["multipass=0.6"], commands, initial_state=state)
    assert columns["true_sinkage_3"][-1] < 0.9 * columns["true_sinkage_1"][-1]
    # on equal loads k sinkage^(n + 1), nearly: the patch grows in length and width as the root of the sinkage
    assert columns["true_sinkage_3"][-1] / columns["true_sinkage_1"][-1] == pytest.approx(1.6 ** (-1 / 1.5), rel=0.05)


@pytest.mark.parametrize(
    ("text", "wheels"),
    [
        ("soil_split=1.44,stiffness=0.64", (1, 0)),
        ("soil_change=0.7,stiffness=1.3", (0,)),
        ("soil_change=0.7,stiffness=1.3,onset=-100", (0,)),
        ("soil_patch=0.8,stiffness=1.3,radius=100", (0,)),
    ],
)
def test_an_effect_says_which_soils_it_makes(act, turning_row, text, wheels):
    """What it says is what its action does to a wheel on each of them; a soil of the model has factors of 1."""
    effect = parse_effect(text)
    row = act(effect, turning_row)
    found = [(soil_factors(row, turning_row, e)[w]) for w in wheels for e in (STRENGTH, STIFFNESS)]
    said = list(effect.soils.values())
    np.testing.assert_allclose(np.ravel(said[: len(wheels)]), found, rtol=1e-9)
    assert said[len(wheels) :] in ([], [(1.0, 1.0)])


def test_other_effects_make_no_soils():
    assert not parse_effect("slope=0.1").soils
    assert not parse_effect("multipass=0.5").soils
