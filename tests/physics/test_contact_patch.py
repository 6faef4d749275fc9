"""What any right integral over the contact patch must satisfy: limiting cases, symmetries, energy, convergence."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ddagr_gym.parameters import Numerics, Soil, TorusWheel
from ddagr_gym.physics import SinkageStatus, equilibrium_sinkage, wheel_force
from ddagr_gym.presets import get_robot, get_soil, soil_names

FINE = Numerics(section_nodes=32, contact_nodes=32)
WHEEL = get_robot("ddagr").wheels[0]
SPEEDS = st.floats(-1.0, 1.0)
STATES = st.tuples(SPEEDS, SPEEDS, st.floats(-4.0, 4.0), st.floats(-2.0, 2.0), st.floats(0.002, 0.05))
SOILS = st.sampled_from(soil_names())

BARE = Soil(
    cohesion=0.0,
    friction_angle=0.0,
    sinkage_exponent=1.0,
    cohesive_modulus=0.0,
    frictional_modulus=1e6,
    shear_modulus=0.01,
    peak_stress_coefficient_0=0.0,
    peak_stress_coefficient_1=0.0,
    exit_angle_ratio=1.0,
)
"""Soil that presses and does not shear, over a patch that is symmetric about bottom dead centre."""


def _wrench(soil, state, wheel=WHEEL, numerics=Numerics()):
    result = wheel_force(wheel, soil, *state, numerics=numerics)
    return np.array([*result.force, result.yaw_moment, result.axle_torque])


def _clear_of_rest(state, wheel=WHEEL):
    """The blend near rest is ours; outside it the model's own symmetries hold exactly."""
    return abs(wheel.outer_radius * state[2] + state[0]) > 2e-3


# Limiting cases with a closed form


def _profile(wheel, sinkage, count=200_000):
    """Lateral places [m] across the patch (midpoints), their spacing, and the depth at bottom dead centre."""
    edge = wheel.half_width * math.sqrt(1.0 - (1.0 - sinkage / wheel.minor_radius) ** 2)
    y = edge * ((np.arange(count) + 0.5) / count * 2.0 - 1.0)
    depth = wheel.minor_radius * np.sqrt(1.0 - (y / wheel.half_width) ** 2) - (wheel.minor_radius - sinkage)
    return y, 2.0 * edge / count, depth


def test_frontal_resistance_is_bekkers():
    """Without shear, ahead of bottom dead centre: F_x = -integral of k h(y)^(n+1)/(n+1) dy."""
    thesis = get_soil("thesis_a1").with_values(
        cohesion=0.0,
        friction_angle=0.0,
        peak_stress_coefficient_0=0.0,
        peak_stress_coefficient_1=0.0,
        exit_angle_ratio=0.0,
    )
    force = _wrench(thesis, (0.2, 0.0, 0.7, 0.0, 0.010), numerics=FINE)
    assert force[0] == pytest.approx(-39.3576, abs=1e-4)
    y, spacing, depth = _profile(WHEEL, 0.010)
    modulus = thesis.cohesive_modulus / (2.0 * y.max() + spacing) + thesis.frictional_modulus
    exponent = thesis.sinkage_exponent + 1.0
    assert force[0] == pytest.approx(-np.sum(modulus * depth**exponent / exponent) * spacing, rel=1e-6)


@pytest.mark.parametrize("sinkage", [0.005, 0.02, 0.05])
def test_pressure_in_proportion_to_depth_lifts_like_water(sinkage):
    """n = 1 and a symmetric patch: the force is k times the volume below ground (Archimedes)."""
    force = _wrench(BARE, (0.2, 0.05, 0.7, 0.3, sinkage), numerics=FINE)
    y, spacing, depth = _profile(WHEEL, sinkage, count=20_000)
    radius = WHEEL.major_radius + WHEEL.minor_radius * np.sqrt(1.0 - (y / WHEEL.half_width) ** 2)
    angle = np.arccos((radius - depth) / radius)
    volume = np.sum(radius**2 * (angle - 0.5 * np.sin(2 * angle))) * spacing
    assert force[2] == pytest.approx(1e6 * volume, rel=1e-5)
    np.testing.assert_allclose(force[[0, 1, 3, 4]], 0.0, atol=1e-9 * force[2])


def test_constant_pressure_carries_its_footprint():
    """n -> 0: F_z is the pressure times the area that the ground plane cuts out of the torus."""
    force = _wrench(BARE.with_values(sinkage_exponent=1e-9), (0.2, 0.0, 0.7, 0.0, 0.015), numerics=FINE)
    y, spacing, depth = _profile(WHEEL, 0.015, count=20_000)
    radius = WHEEL.major_radius + WHEEL.minor_radius * np.sqrt(1.0 - (y / WHEEL.half_width) ** 2)
    area = np.sum(2.0 * np.sqrt(radius**2 - (radius - depth) ** 2)) * spacing
    assert force[2] == pytest.approx(1e6 * area, rel=1e-5)


@given(SOILS, STATES)
@settings(max_examples=50)
def test_rigid_plastic_soil_shears_at_its_strength_everywhere(name, state):
    """K -> 0: all of the patch slides at full strength, so |axle torque| <= torque of that strength."""
    soil = get_soil(name)
    soft = _wrench(soil, state, numerics=FINE)
    hard = _wrench(soil.with_values(shear_modulus=1e-9), state, numerics=FINE)
    slide = abs(state[0]) + abs(state[1]) + abs(state[2])
    if _clear_of_rest(state) and slide > 0.1:
        assert _dissipation(hard, state) <= _dissipation(soft, state) + 1e-6 * np.linalg.norm(hard)


def _dissipation(wrench, state):
    """Power of the soil on the wheel [W]; negative takes energy out."""
    v_x, v_y, omega, yaw_rate, _ = state
    return wrench[0] * v_x + wrench[1] * v_y + wrench[4] * omega + wrench[3] * yaw_rate


@given(SOILS, STATES)
@settings(max_examples=50)
def test_soil_without_strength_has_no_lateral_force_and_no_torque(name, state):
    wrench = _wrench(get_soil(name).with_values(cohesion=0.0, friction_angle=0.0), state)
    np.testing.assert_allclose(wrench[[1, 3, 4]], 0.0, atol=1e-9 * max(wrench[2], 1e-9))


# Symmetries


@given(SOILS, STATES)
@settings(max_examples=100)
def test_mirror_image_across_the_plane_of_the_wheel(name, state):
    v_x, v_y, omega, yaw_rate, sinkage = state
    soil = get_soil(name)
    wrench = _wrench(soil, state)
    mirrored = _wrench(soil, (v_x, -v_y, omega, -yaw_rate, sinkage))
    signs = np.array([1.0, -1.0, 1.0, -1.0, 1.0])
    np.testing.assert_allclose(mirrored, signs * wrench, rtol=1e-9, atol=1e-10 * np.linalg.norm(wrench))


@given(SOILS, STATES)
@settings(max_examples=100)
def test_reversing_flips_drawbar_yaw_moment_and_torque_only(name, state):
    v_x, v_y, omega, yaw_rate, sinkage = state
    soil = get_soil(name)
    wrench = _wrench(soil, state)
    reverse = _wrench(soil, (-v_x, v_y, -omega, -yaw_rate, sinkage))
    signs = np.array([-1.0, 1.0, 1.0, -1.0, -1.0])
    np.testing.assert_allclose(reverse, signs * wrench, rtol=1e-9, atol=1e-9 * np.linalg.norm(wrench))
    if _clear_of_rest(state):
        assert (reverse == signs * wrench).all()


@given(SOILS, STATES, st.floats(0.3, 30.0))
@settings(max_examples=100)
def test_force_depends_on_ratios_of_velocities_only(name, state, factor):
    v_x, v_y, omega, yaw_rate, sinkage = state
    scaled = (factor * v_x, factor * v_y, factor * omega, factor * yaw_rate, sinkage)
    rate = max(abs(omega), abs(v_x) / WHEEL.outer_radius)
    if min(rate, factor * rate) > 1e-3 and _clear_of_rest(state) and _clear_of_rest(scaled):
        wrench = _wrench(get_soil(name), state)
        np.testing.assert_allclose(
            _wrench(get_soil(name), scaled), wrench, rtol=1e-9, atol=1e-10 * np.linalg.norm(wrench)
        )


@given(SOILS, STATES, st.floats(0.3, 3.0))
@settings(max_examples=60)
def test_larger_wheel_in_similar_soil(name, state, size):
    """Dimensional analysis: lengths, K and speeds times s, pressures kept: forces grow as s^2, moments as s^3."""
    soil, (v_x, v_y, omega, yaw_rate, sinkage) = get_soil(name), state
    n = soil.sinkage_exponent
    scaled_soil = soil.with_values(
        shear_modulus=soil.shear_modulus * size,
        cohesive_modulus=soil.cohesive_modulus * size ** (1.0 - n),
        frictional_modulus=soil.frictional_modulus * size**-n,
    )
    wheel = TorusWheel(*(size * length for length in (WHEEL.minor_radius, WHEEL.half_width, WHEEL.major_radius)))
    rest = Numerics().rest_speed
    small = _wrench(soil, state, numerics=Numerics(rest_speed=rest))
    large = _wrench(
        scaled_soil, (size * v_x, size * v_y, omega, yaw_rate, size * sinkage), wheel, Numerics(rest_speed=rest * size)
    )
    powers = size ** np.array([2.0, 2.0, 2.0, 3.0, 3.0])
    np.testing.assert_allclose(large, powers * small, rtol=1e-8, atol=1e-9 * size**3 * np.linalg.norm(small))


@given(SOILS, STATES, st.floats(0.1, 10.0))
@settings(max_examples=60)
def test_forces_are_in_proportion_to_the_soils_stresses(name, state, factor):
    soil = get_soil(name)
    strong = soil.with_values(
        cohesion=factor * soil.cohesion,
        cohesive_modulus=factor * soil.cohesive_modulus,
        frictional_modulus=factor * soil.frictional_modulus,
    )
    np.testing.assert_allclose(_wrench(strong, state), factor * _wrench(soil, state), rtol=1e-9, atol=1e-9)


# Energy and strength


@given(SOILS, STATES)
@settings(max_examples=300)
def test_soil_never_gives_energy_to_the_wheel(name, state):
    wrench = _wrench(get_soil(name), state)
    assert _dissipation(wrench, state) <= 1e-9 * np.linalg.norm(wrench)


@given(SOILS, st.floats(0, 2 * math.pi), st.floats(0.05, 1.0), st.floats(0.004, 0.04))
@settings(max_examples=60)
def test_locked_wheel_is_pushed_back_along_its_path(name, direction, speed, sinkage):
    """Dragged without rotation the force opposes the velocity: no lift-off energy, no force across a pure direction."""
    v_x, v_y = speed * math.cos(direction), speed * math.sin(direction)
    wrench = _wrench(get_soil(name), (v_x, v_y, 0.0, 0.0, sinkage), numerics=FINE)
    assert wrench[0] * v_x + wrench[1] * v_y < 0
    if abs(v_x) > 0.02:
        assert wrench[0] * v_x < 0
    if abs(v_y) > 0.02:
        assert wrench[1] * v_y < 0


@pytest.mark.parametrize("name", ["thesis_a1", "dry_sand_lll_0", "firm_ground"])
def test_drawbar_rises_with_slip_from_braking_to_driving(name):
    slips = np.linspace(-0.9, 0.9, 37)
    omega = np.where(slips >= 0, 0.3 / (1 - slips), 0.3 * (1 + slips)) / WHEEL.outer_radius
    drawbar = wheel_force(WHEEL, get_soil(name), 0.3, 0.0, omega, 0.0, 0.012).force[:, 0]
    assert drawbar[0] < 0 < drawbar[-1]
    # traction saturates before slip 1, and the peak of the pressure moves forward: the rise is for moderate slip
    moderate = np.abs(slips) <= 0.3
    assert (np.diff(drawbar[moderate]) > 0).all()


# Continuity


@pytest.mark.parametrize(
    ("start", "direction"),
    [
        ((0.0, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)),  # hub through rest, wheel locked
        ((0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0 / 0.2794, 0.0)),  # wheel through rest, hub fixed
        ((0.1, 0.02, -0.1 / 0.2794, 0.1), (1.0, 0.0, 0.0, 0.0)),  # counter-rotating, entry changes side
        ((0.0, 0.0, 0.0, 0.0), (0.6, 0.3, 0.8 / 0.2794, 0.4)),  # everything at once
        ((0.2, 0.0, 0.2 / 0.2794, 0.0), (0.0, 0.0, 1.0 / 0.2794, 0.0)),  # from braked to driven
    ],
)
def test_force_is_continuous_through_rest_and_reversal(soil, start, direction):
    """The largest jump between neighbours shrinks with their distance; at a discontinuity it would stay."""

    def largest_jump(count):
        at = np.linspace(-2e-3, 2e-3, count)[:, None]
        state = np.array(start) + at * np.array(direction)
        force = wheel_force(WHEEL, soil, *state.T, 0.01).force
        return np.max(np.linalg.norm(np.diff(force, axis=0), axis=1))

    coarse, fine = largest_jump(20_001), largest_jump(80_001)
    assert fine < 0.3 * coarse
    assert fine < 20.0


def test_no_force_at_perfect_rest_but_the_weight(soil):
    wrench = _wrench(soil, (0.0, 0.0, 0.0, 0.0, 0.01))
    np.testing.assert_allclose(wrench[[0, 1, 3, 4]], 0.0, atol=1e-10 * wrench[2])
    assert wrench[2] > 0


# Convergence


def test_quadrature_converges_spectrally(soil):
    rng = np.random.default_rng(3)
    count = 60
    v_x, side, omega, yaw_rate = rng.uniform(-1, 1, (4, count))
    v_y = side + 0.1 * np.sign(side)  # away from the kink of |V| at zero lateral sliding
    sinkage = rng.uniform(0.003, 0.045, count)

    def forces(nodes):
        rule = Numerics(section_nodes=max(nodes, 8), contact_nodes=nodes)
        return wheel_force(WHEEL, soil, v_x, v_y, 3 * omega, yaw_rate, sinkage, numerics=rule).force

    exact = forces(64)
    size = np.linalg.norm(exact, axis=1)
    errors = [np.median(np.linalg.norm(forces(nodes) - exact, axis=1) / size) for nodes in (8, 16, 24, 32)]
    # geometric: every eight nodes more gain at least two orders of magnitude, until rounding
    assert errors[0] < 2e-4
    for before, after in pairwise(errors):
        assert after < max(0.01 * before, 3e-14)


def test_error_of_the_default_rule_over_all_soils_and_a_turns_slips():
    """Nine in ten below 1e-3; the tail is wheels that almost roll, where |V| has a kink inside the patch."""
    rng = np.random.default_rng(0)
    errors = []
    for name in soil_names():
        soil, slip, angle = get_soil(name), rng.uniform(-0.8, 0.8, 150), rng.uniform(0.0, 1.0, 150)
        omega = np.where(slip > 0, 0.3 / (1 - slip), 0.3 * (1 + slip)) / WHEEL.outer_radius
        motion = (0.3, 0.3 * np.tan(angle), omega, rng.uniform(-0.5, 0.5, 150) * angle)
        sinkage, status = equilibrium_sinkage(WHEEL, soil, *motion, 412.0)
        coarse = wheel_force(WHEEL, soil, *motion, sinkage).force[status == SinkageStatus.FOUND]
        fine = wheel_force(WHEEL, soil, *motion, sinkage, numerics=FINE).force[status == SinkageStatus.FOUND]
        errors.append(np.linalg.norm(coarse - fine, axis=1) / np.linalg.norm(fine, axis=1))
    median, most, almost_all, worst = np.quantile(np.concatenate(errors), [0.5, 0.9, 0.99, 1.0])
    assert median < 2e-4
    assert most < 1e-3
    assert almost_all < 3e-3
    assert worst < 4e-2
