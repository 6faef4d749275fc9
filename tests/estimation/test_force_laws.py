"""Force laws: values, limiting cases, symmetries, derivatives."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddagr_gym.estimation.force_laws import ForceLaw, LawParameters, coupled_law, thesis_law, wheel_law

REST, REVERSAL = 0.005, 0.01
LAWS = [thesis_law, coupled_law]
PARAMETERS = (165.0, 5.0, 840.0, 23.0)  # a1 [N], a2, b [N/rad], Rc [N]


def forces(law, v_x, v_y, rim, parameters=PARAMETERS, rest=REST, reversal=REVERSAL):
    values = law(v_x, v_y, rim, LawParameters(*parameters, rest, reversal))
    return values[0], values[8]


def test_thesis_law_is_equations_3_15_and_3_16():
    v_x, v_y, rim = 0.2, 0.03, 0.25
    a1, a2, b, _ = PARAMETERS
    slip = (rim - v_x) / rim
    f_x, f_y = forces(thesis_law, v_x, v_y, rim, (a1, a2, b, 1e-12), rest=1e-9)
    assert f_x == pytest.approx(a1 * (1 - math.exp(-a2 * slip)), rel=1e-12)
    assert f_y == pytest.approx(-b * math.atan2(v_y, v_x), rel=1e-12)


def test_braked_wheel_slips_over_its_speed():
    v_x, rim = 0.25, 0.2
    f_x, _ = forces(thesis_law, v_x, 0.0, rim, (100.0, 4.0, 1.0, 1e-12), rest=1e-9)
    assert f_x == pytest.approx(-100.0 * (1 - math.exp(-4.0 * 0.05 / 0.25)), rel=1e-12)


def test_coupled_law_without_lateral_slip_is_the_thesis_law():
    for v_x, rim in [(0.2, 0.25), (0.25, 0.2), (-0.1, -0.15), (0.1, -0.05), (0.02, 0.0)]:
        assert forces(coupled_law, v_x, 0.0, rim)[0] == pytest.approx(forces(thesis_law, v_x, 0.0, rim)[0], rel=1e-9)


def test_coupled_law_at_small_slip_has_lateral_stiffness_b():
    v_x, v_y = 0.2, 2e-7
    _, f_y = forces(coupled_law, v_x, v_y, v_x, rest=1e-9)
    assert f_y == pytest.approx(-PARAMETERS[2] * v_y / v_x, rel=1e-4)


def test_coupled_law_shares_one_traction():
    # A wheel locked and dragged obliquely: full traction against its sliding direction (c = 1), nothing more.
    a1, a2 = 100.0, 8.0
    for angle in (0.3, 1.0, 1.5):
        v_x, v_y = 0.1 * math.cos(angle), 0.1 * math.sin(angle)
        f_x, f_y = forces(coupled_law, v_x, v_y, 0.0, (a1, a2, a1 * a2, 1e-12), rest=1e-9)
        slip = 1.0 / math.cos(angle)
        assert math.hypot(f_x, f_y) == pytest.approx(a1 * (1 - math.exp(-a2 * slip)), rel=1e-9)
        assert math.atan2(-f_y, -f_x) == pytest.approx(angle, rel=1e-9)


def test_resistance_follows_the_rolling_direction():
    # rim + v_x < 0: the wheel rolls backwards though its hub still moves forward
    no_resistance = (*PARAMETERS[:3], 1e-12)
    forward = forces(coupled_law, 0.05, 0.0, 0.2)[0] - forces(coupled_law, 0.05, 0.0, 0.2, no_resistance)[0]
    backward = forces(coupled_law, 0.05, 0.0, -0.2)[0] - forces(coupled_law, 0.05, 0.0, -0.2, no_resistance)[0]
    assert forward == pytest.approx(-23.0, rel=0.01)
    assert backward == pytest.approx(23.0, rel=0.01)


speeds = st.floats(-0.6, 0.6)
logs = st.tuples(st.floats(3.0, 6.5), st.floats(0.0, 3.0), st.floats(3.0, 8.0), st.floats(0.0, 5.0))


@given(speeds, speeds, speeds, logs)
def test_reversing_everything_reverses_the_force(v_x, v_y, rim, parameters):
    values = tuple(math.exp(p) for p in parameters)
    for law in LAWS:
        there, back = forces(law, v_x, v_y, rim, values), forces(law, -v_x, -v_y, -rim, values)
        np.testing.assert_allclose(there, np.negative(back), rtol=1e-12, atol=1e-9)


@given(speeds, speeds, speeds, logs)
def test_lateral_mirror(v_x, v_y, rim, parameters):
    values = tuple(math.exp(p) for p in parameters)
    for law in LAWS:
        left, right = forces(law, v_x, v_y, rim, values), forces(law, v_x, -v_y, rim, values)
        np.testing.assert_allclose(left, (right[0], -right[1]), rtol=1e-12, atol=1e-9)


@given(speeds, speeds, speeds, logs)
def test_soil_takes_energy(v_x, v_y, rim, parameters):
    # Power of the soil: force times sliding velocity of the surface (v_x - rim, v_y), resistance times rolling.
    values = tuple(math.exp(p) for p in parameters)
    for law in LAWS:
        with_resistance, without = forces(law, v_x, v_y, rim, values), forces(law, v_x, v_y, rim, (*values[:3], 1e-12))
        assert without[0] * (v_x - rim) + without[1] * v_y <= 1e-9
        assert (with_resistance[0] - without[0]) * (v_x + rim) <= 1e-9


@given(st.floats(0.05, 0.6), speeds, speeds, logs, st.floats(1.0, 10.0))
def test_force_depends_on_velocity_ratios_only(v_x, v_y, rim, parameters, factor):
    values = tuple(math.exp(p) for p in parameters)
    for law in LAWS:
        slow = forces(law, v_x, v_y, rim, values, 1e-9, 1e-9)
        fast = forces(law, factor * v_x, factor * v_y, factor * rim, values, 1e-9, 1e-9)
        # at rim = -v_x the resistance turns round: leave its immediate neighbourhood out
        if abs(v_x + rim) > 1e-6:
            np.testing.assert_allclose(slow, fast, rtol=1e-6, atol=1e-6)


@given(speeds, speeds, speeds, logs)
def test_derivatives_against_fourth_order_differences(v_x, v_y, rim, parameters):
    if abs(abs(v_x) - abs(rim)) < 0.01 or (abs(v_x) < 0.01 and abs(rim) < 0.01):
        return  # d = max(|rim|, |v_x|) has a kink there
    point = np.array([v_x, v_y, rim, *parameters])
    steps = np.array([1e-4, 1e-4, 1e-4, 1e-3, 1e-3, 1e-3, 1e-3])
    for law in LAWS:

        def at(p, law=law):
            values = law(p[0], p[1], p[2], LawParameters(*np.exp(p[3:]), REST, REVERSAL))
            return np.array([values[0], values[8]])

        found = law(*point[:3], LawParameters(*np.exp(point[3:]), REST, REVERSAL))
        for k, h in enumerate(steps):
            e = np.eye(7)[k] * h
            difference = (8 * (at(point + e) - at(point - e)) - at(point + 2 * e) + at(point - 2 * e)) / (12 * h)
            scale = 1.0 + abs(at(point)).max() + np.abs(difference).max()
            np.testing.assert_allclose([found[1 + k], found[9 + k]], difference, atol=2e-5 * scale)


def test_selection_by_number():
    arguments = (0.2, 0.03, 0.25, LawParameters(*PARAMETERS, REST, REVERSAL))
    assert wheel_law(float(ForceLaw.thesis), *arguments) == thesis_law(*arguments)
    assert wheel_law(float(ForceLaw.coupled), *arguments) == coupled_law(*arguments)
    assert thesis_law(*arguments)[8] != coupled_law(*arguments)[8]


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("motion", [(0.0, 0.0, 0.0), (0.0, 0.1, 0.0), (1e-300, 0.0, -1e-300), (5.0, -5.0, -5.0)])
def test_finite_at_rest_and_far_out(law, motion):
    assert np.isfinite(law(*motion, LawParameters(*PARAMETERS, REST, REVERSAL))).all()
