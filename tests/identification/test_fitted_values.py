"""Robot and soil with the values of a fit."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.identification.fitted_values import soil_with_values, with_values


def test_strength_scales_cohesion_and_the_tangent_of_friction(robot, soil):
    changed = with_values(robot, soil, {"soil_strength": math.log(0.8)})[1]
    assert changed.cohesion == pytest.approx(0.8 * soil.cohesion)
    assert math.tan(changed.friction_angle) == pytest.approx(0.8 * math.tan(soil.friction_angle))


@pytest.mark.parametrize(
    ("values", "field", "bound"),
    [
        ({"soil_strength": 4.0}, "friction_angle", 1.2),
        ({"sinkage_exponent": 3.0}, "sinkage_exponent", 3.0),
        ({"exit_angle_ratio": 2.0}, "exit_angle_ratio", 1.0),
        ({"exit_angle_ratio": -2.0}, "exit_angle_ratio", 0.0),
    ],
)
def test_a_draw_that_no_soil_has_is_taken_at_the_bound(robot, soil, values, field, bound):
    assert getattr(with_values(robot, soil, values, held=True)[1], field) == bound


def test_a_fit_that_no_soil_has_is_refused(robot, soil):
    with pytest.raises(InputError, match="sinkage_exponent"):
        with_values(robot, soil, {"sinkage_exponent": 3.0})


@pytest.mark.parametrize(("own", "found", "kept"), [(0.0, 0.7, 0.7), (0.8, -0.5, 0.3), (0.8, 0.9, 1.0)])
def test_what_is_felt_of_a_tilt_by_sinkage_is_kept_within_none_and_all(robot, soil, own, found, kept):
    changed = with_values(replace(robot, sinkage_tilt=own), soil, {"sinkage_tilt": found})[0]
    assert changed.sinkage_tilt == pytest.approx(kept)


def test_draws_of_a_soil_do_not_ask_whether_the_wheels_can_be(robot, soil):
    """Of a draw with a radius that no wheel has, the soil is still one."""
    with pytest.raises(InputError, match="minor_radius"):
        with_values(robot, soil, {"outer_radius": -2.0})
    assert soil_with_values(soil, {"outer_radius": -2.0}) == soil
