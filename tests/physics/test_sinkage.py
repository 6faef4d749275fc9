"""Search for the sinkage: status, monotony, and agreement with an independent root finder."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from ddagr_gym.parameters import Numerics
from ddagr_gym.physics import SinkageStatus, equilibrium_sinkage, wheel_force
from ddagr_gym.presets import get_robot, get_soil, soil_names


def test_load_beyond_the_torus_is_bogged_at_the_limit(wheel, soil):
    limit = wheel_force(wheel, soil, 0.2, 0.0, 0.7, 0.0, wheel.minor_radius).force[2]
    below = equilibrium_sinkage(wheel, soil, 0.2, 0.0, 0.7, 0.0, 0.999 * limit)
    above = equilibrium_sinkage(wheel, soil, 0.2, 0.0, 0.7, 0.0, 1.001 * limit)
    assert below[1] is SinkageStatus.FOUND
    assert below[0] < wheel.minor_radius
    assert above == (wheel.minor_radius, SinkageStatus.BOGGED)


@pytest.mark.parametrize("load", [0.0, -50.0])
def test_wheel_without_load_does_not_touch(wheel, soil, load):
    assert equilibrium_sinkage(wheel, soil, 0.2, 0.0, 0.7, 0.0, load) == (0.0, SinkageStatus.UNLOADED)


def test_soil_that_bears_nothing_bogs(wheel, soil):
    mud = soil.with_values(cohesive_modulus=0.0, frictional_modulus=0.0, cohesion=0.0)
    assert equilibrium_sinkage(wheel, mud, 0.2, 0.0, 0.7, 0.0, 1.0) == (wheel.minor_radius, SinkageStatus.BOGGED)


@pytest.mark.parametrize("name", soil_names())
def test_heavier_wheels_sink_deeper_in_every_soil(wheel, name):
    loads = np.geomspace(1.0, 3e4, 25)
    sinkage, status = equilibrium_sinkage(wheel, get_soil(name), 0.2, 0.02, 0.8, 0.1, loads)
    found = status == SinkageStatus.FOUND
    assert found[0]
    assert (np.diff(sinkage[found]) > 0).all()
    assert (sinkage[~found] == wheel.minor_radius).all()
    assert (np.diff(found.astype(int)) <= 0).all()


@given(
    st.sampled_from(soil_names()), st.floats(-1, 1), st.floats(-0.5, 0.5), st.floats(-4, 4), st.floats(-1, 1),
    st.floats(1.0, 2000.0),
)  # fmt: skip
@settings(max_examples=60)
def test_search_agrees_with_brent_or_reports_why_not(name, v_x, v_y, omega, yaw_rate, load):
    wheel, soil = get_robot("ddagr").wheels[0], get_soil(name)
    sinkage, status = equilibrium_sinkage(wheel, soil, v_x, v_y, omega, yaw_rate, load)

    def excess(depth):
        return float(wheel_force(wheel, soil, v_x, v_y, omega, yaw_rate, depth).force[2]) - load

    if status is SinkageStatus.BOGGED:
        assert sinkage == wheel.minor_radius
        assert excess(wheel.minor_radius) < 0
        return
    assert abs(excess(sinkage)) <= 1.01e-6 * load
    if excess(1e-9) < 0 < excess(wheel.minor_radius):
        root = brentq(excess, 1e-9, wheel.minor_radius, xtol=1e-13)
        assert sinkage == pytest.approx(root, rel=1e-5)


def test_tolerance_is_relative_to_the_load(wheel, soil):
    for load in (1.0, 5000.0):
        sinkage, _ = equilibrium_sinkage(wheel, soil, 0.2, 0.01, 0.7, 0.0, load, numerics=Numerics.finest())
        carried = wheel_force(wheel, soil, 0.2, 0.01, 0.7, 0.0, sinkage, numerics=Numerics.finest()).force[2]
        assert carried == pytest.approx(load, rel=1e-9)
