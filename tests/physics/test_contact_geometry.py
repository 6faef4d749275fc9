"""The section of the contact patch against the surface's own derivatives (vector form, tests/golden)."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ddagr_gym.physics.contact_geometry import (
    AREA,
    COS_ENTRY,
    ENTRY,
    LANES,
    LATERAL_Y,
    NODE,
    NORMAL_Y,
    RHO,
    SECTION_SIZE,
    SIN_ENTRY,
    V_X_LOCAL,
    WEIGHT,
    Y_LOCAL,
    contact_rule,
    entry_angle,
    fill_section,
    lateral_edge,
    section_rule,
)

SHAPES = st.tuples(st.floats(0.01, 0.15), st.floats(0.02, 0.3), st.floats(0.15, 0.6))


def _section(shape, share, nodes=8, first=0, v_x=0.0, yaw_rate=0.0):
    """Blocks of a section of a wheel that has sunk by ``share`` of its minor radius."""
    minor, half_width, major = shape
    sinkage = share * minor
    edge = lateral_edge(minor, sinkage)
    workspace = np.zeros(SECTION_SIZE)
    height = minor + major - sinkage
    fill_section(minor, half_width, major, height, edge, v_x, yaw_rate, section_rule(nodes), first, workspace)
    names = {
        "rho": RHO, "entry": ENTRY, "cos_entry": COS_ENTRY, "sin_entry": SIN_ENTRY, "normal_y": NORMAL_Y,
        "lateral_y": LATERAL_Y, "v_x": V_X_LOCAL, "y": Y_LOCAL, "area": AREA, "node": NODE, "weight": WEIGHT,
    }  # fmt: skip
    return edge, {name: workspace[at : at + LANES].copy() for name, at in names.items()}


@given(SHAPES, st.floats(0.01, 1.0), st.floats(-1.0, 1.0))
@settings(max_examples=40)
def test_directions_and_area_are_those_of_the_parametrised_surface(reference, shape, share, fraction):
    edge, section = _section(shape, share)
    wheel = reference.Wheel(*shape)
    psi = edge * section["node"]
    theta = fraction * section["entry"]
    by_theta, by_psi = reference.surface_tangents(wheel, theta, psi)
    cross = np.cross(by_psi, by_theta)
    area = np.linalg.norm(cross, axis=-1)
    sine, cosine, zero = np.sin(theta), np.cos(theta), np.zeros(LANES)
    normal = np.stack([section["lateral_y"] * sine, section["normal_y"], -section["lateral_y"] * cosine], axis=-1)
    lateral = np.stack([-section["normal_y"] * sine, section["lateral_y"], section["normal_y"] * cosine], axis=-1)
    tangent = np.stack([cosine, zero, sine], axis=-1)
    frame = np.stack([tangent, lateral, normal], axis=-2)
    np.testing.assert_allclose(frame @ frame.swapaxes(-1, -2), np.broadcast_to(np.eye(3), (LANES, 3, 3)), atol=1e-12)
    np.testing.assert_allclose(by_theta / np.linalg.norm(by_theta, axis=-1, keepdims=True), tangent, atol=1e-12)
    np.testing.assert_allclose(by_psi / np.linalg.norm(by_psi, axis=-1, keepdims=True), lateral, atol=1e-12)
    np.testing.assert_allclose(np.abs(np.sum(cross / area[:, None] * normal, axis=-1)), 1.0, rtol=1e-12)
    outward = np.sum(normal * (reference.surface_point(wheel, theta, psi) - _core(shape, theta)), axis=-1)
    assert (outward > 0).all()
    per_weight = section["area"] / (edge * section["weight"] * section["entry"])
    np.testing.assert_allclose(per_weight, area, rtol=1e-11)


def _core(shape, theta):
    return shape[2] * np.stack([np.sin(theta), np.zeros(LANES), -np.cos(theta)], axis=-1)


@given(SHAPES, st.floats(0.01, 1.0))
@settings(max_examples=40)
def test_slices_enter_the_soil_at_the_ground(reference, shape, share):
    edge, section = _section(shape, share)
    points = reference.surface_point(reference.Wheel(*shape), section["entry"], edge * section["node"])
    ground = -(shape[0] + shape[2] - share * shape[0])
    np.testing.assert_allclose(points[:, 2], ground, rtol=1e-11)
    np.testing.assert_allclose(points[:, 1], section["y"], rtol=1e-11)
    np.testing.assert_allclose(section["cos_entry"], np.cos(section["entry"]), rtol=1e-11)
    np.testing.assert_allclose(section["sin_entry"], np.sin(section["entry"]), rtol=1e-11)


def test_slice_velocity_is_the_hub_velocity_less_the_turning():
    _, section = _section((0.05, 0.1016, 0.2294), 0.3, v_x=0.4, yaw_rate=0.7)
    np.testing.assert_allclose(section["v_x"], 0.4 - 0.7 * section["y"], rtol=1e-14)


def test_second_block_of_a_finer_rule_continues_the_first():
    _, left = _section((0.05, 0.1, 0.2), 0.3, nodes=16, first=0)
    _, right = _section((0.05, 0.1, 0.2), 0.3, nodes=16, first=LANES)
    nodes = np.concatenate([left["node"], right["node"]])
    assert (np.diff(nodes) > 0).all()
    np.testing.assert_allclose(nodes, -nodes[::-1], atol=1e-15)


def test_lateral_edge_is_capped_at_ninety_degrees():
    assert lateral_edge(0.05, 0.05) == pytest.approx(math.pi / 2)
    assert lateral_edge(0.05, 0.06) == pytest.approx(math.pi / 2)
    assert lateral_edge(0.05, 0.025) == pytest.approx(math.pi / 3)


def test_entry_angle_of_a_slice_clear_of_the_soil_is_zero():
    assert entry_angle(0.25, 0.26) == 0.0
    assert entry_angle(0.25, 0.2) == pytest.approx(math.acos(0.8), rel=1e-12)


@pytest.mark.parametrize("nodes", [8, 16, 32])
def test_section_rule_integrates_the_square_root_of_the_patch_edge(nodes):
    blocks = section_rule(nodes).reshape(-1, 2, LANES)
    points, weights = blocks[:, 0].ravel(), blocks[:, 1].ravel()
    assert weights @ np.sqrt(1.0 - points**2) == pytest.approx(math.pi / 2, rel=1e-7)
    assert weights.sum() == pytest.approx(2.0, rel=1e-10)


@pytest.mark.parametrize("exponent", [0.5, 1.0, 1.5])
def test_contact_rule_integrates_powers_of_the_distance_from_entry(exponent):
    u_squared, weights = contact_rule(8)
    # theta = theta_f - theta_f u^2, d theta = theta_f 2 u du: integral of (theta_f - theta)^n over [0, theta_f = 1]
    assert weights @ u_squared**exponent == pytest.approx(1.0 / (exponent + 1.0), rel=1e-10)
