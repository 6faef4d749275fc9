"""The other soil law: its curves, its forces on a wheel, and drives on it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.control.constant_speeds import ConstantSpeeds
from ddagr_gym.envs.options import make_settings
from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.runs import drive_turn
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects import effect_kinds
from ddagr_gym.physics.soil_laws import (
    LAW,
    NOMINAL_LAW,
    PEAK_OVER_MODULUS,
    REFERENCE_DEPTH,
    RESIDUAL,
    CrustAndResidual,
    crust_pressure,
    ground_effects,
    lay_crust,
    mobilised_strength,
    shear_patch,
)
from ddagr_gym.physics.wheel_forces import soil_vector
from ddagr_gym.presets import get_robot, get_soil

ROBOT, SOIL = get_robot("ddagr"), get_soil("thesis_a1")


def test_shear_has_a_peak_and_a_residual_which_janosi_has_not():
    peak = 0.015
    j = np.linspace(1e-6, 10 * peak, 4000)
    share = np.array([mobilised_strength(v, peak) for v in j])
    assert mobilised_strength(peak, peak) == pytest.approx(1.0, rel=1e-12)
    assert share.max() == pytest.approx(1.0, abs=5e-3)
    assert j[share.argmax()] == pytest.approx(peak, rel=0.2)
    assert share[-1] == pytest.approx(RESIDUAL, abs=0.01)
    assert (np.diff(share) < 0).any()  # no exponential, whatever its modulus, comes down again


def test_pressure_curve_is_no_power():
    depth = np.geomspace(1e-3, 30e-3, 40)
    pressure = np.array([crust_pressure(z) for z in depth])
    exponent = np.diff(np.log(pressure)) / np.diff(np.log(depth))
    assert (np.diff(pressure) > 0).all()
    assert exponent[0] > 0.85
    assert 0.5 < exponent.min() < 0.65
    assert exponent[-1] > exponent.min() + 0.03  # it hardens again


def prepared_row(sinkage=REFERENCE_DEPTH):
    row = np.zeros(layout.SIZE)
    wheel = ROBOT.wheels[0]
    for i in range(4):
        row[layout.WHEEL + i], row[layout.WHEEL + 4 + i] = wheel.minor_radius, wheel.half_width
        row[layout.WHEEL + 8 + i] = wheel.major_radius
        row[layout.SINKAGE + i], row[layout.LOAD + i] = sinkage, 412.0
        row[layout.SOIL + 9 * i : layout.SOIL + 9 * (i + 1)] = soil_vector(SOIL)
    return row


def laid(**motion):
    row = prepared_row()
    lay_crust(row, CrustAndResidual().vector(), np.zeros(layout.EFFECT_MEMORY))
    for name, value in motion.items():
        start = getattr(layout, name.upper())
        row[start : start + (4 if name.startswith("wheel") else 1)] = value
    shear_patch(row, CrustAndResidual().vector(), np.zeros(layout.EFFECT_MEMORY))
    return row


def test_tangent_meets_bekker_at_the_reference_depth():
    row = prepared_row()
    lay_crust(row, CrustAndResidual().vector(), np.zeros(layout.EFFECT_MEMORY))
    soil = row[layout.SOIL : layout.SOIL + 9]
    before = SOIL.frictional_modulus * REFERENCE_DEPTH**SOIL.sinkage_exponent
    after = soil[layout.SOIL_FRICTIONAL_MODULUS] * REFERENCE_DEPTH ** soil[layout.SOIL_EXPONENT]
    assert after == pytest.approx(before, rel=1e-9)
    # the exponent is the curve's slope there
    h = 1e-6
    slope = math.log(crust_pressure(REFERENCE_DEPTH * (1 + h)) / crust_pressure(REFERENCE_DEPTH * (1 - h))) / (2 * h)
    assert soil[layout.SOIL_EXPONENT] == pytest.approx(slope, rel=1e-6)
    assert soil[layout.SOIL_COHESION] < 1e-5 * SOIL.cohesion


def test_patch_opposes_slip_and_skid():
    wheel_speed = 0.2 / (ROBOT.wheels[0].outer_radius)
    rolling = laid(wheel_v_x=0.2, wheel_omega=wheel_speed)
    driving = laid(wheel_v_x=0.2, wheel_omega=1.3 * wheel_speed)
    braking = laid(wheel_v_x=0.2, wheel_omega=0.7 * wheel_speed)
    skidding = laid(wheel_v_x=0.2, wheel_v_y=0.05, wheel_omega=wheel_speed)
    assert abs(rolling[layout.EXTRA_FORCE_X]) < 1e-6
    assert driving[layout.EXTRA_FORCE_X] > 20.0
    assert driving[layout.EXTRA_AXLE_TORQUE] < 0.0
    assert braking[layout.EXTRA_FORCE_X] < -20.0
    assert skidding[layout.EXTRA_FORCE_Y] < -20.0


def test_patch_never_passes_the_soils_strength():
    wheel = ROBOT.wheels[0]
    for slip in (1.5, 3.0, 10.0):
        row = laid(wheel_v_x=0.2, wheel_v_y=0.1, wheel_omega=slip * 0.2 / wheel.outer_radius)
        size = math.hypot(row[layout.EXTRA_FORCE_X], row[layout.EXTRA_FORCE_Y])
        front = math.sqrt(2 * wheel.outer_radius * REFERENCE_DEPTH)
        area = front * (1 + SOIL.exit_angle_ratio) * 2 * wheel.half_width
        assert size < SOIL.cohesion * area + 412.0 * math.tan(SOIL.friction_angle)
    # far beyond the peak only the residual is left: more slip, less force
    spinning = [
        laid(wheel_v_x=0.2, wheel_omega=s * 0.2 / wheel.outer_radius)[layout.EXTRA_FORCE_X] for s in (1.25, 20.0)
    ]
    assert spinning[1] < spinning[0] * 1.05
    assert PEAK_OVER_MODULUS > 1.0


def test_it_cannot_be_named_as_missing_physics():
    assert CrustAndResidual.name not in effect_kinds()


def drive(effects, numerics=None):
    settings = make_settings(soil="thesis_a1", randomisation=False, side="left", effects=effects)
    settings = settings if numerics is None else replace(settings, numerics=numerics)
    return drive_turn(ConstantSpeeds(0.72, 1.48, 0.067, 0.055, 2.0), settings, 1)


def test_drives_differ_between_laws_and_not_between_steps():
    nominal, other = drive(ground_effects(NOMINAL_LAW)), drive(ground_effects(LAW))
    fine = drive(ground_effects(LAW), replace(make_settings().numerics, maximum_step=0.002))
    samples = 1500
    ends = [np.array([run.columns[f"true_{k}"][samples] for k in ("x", "y")]) for run in (nominal, other, fine)]
    assert np.hypot(*(ends[1] - ends[0])) > 0.02
    assert np.hypot(*(ends[2] - ends[1])) < 0.004


def test_unknown_law_lists_the_names():
    with pytest.raises(InputError, match=LAW):
        ground_effects("crust")
