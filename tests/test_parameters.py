"""Parameter classes: valid presets pass, every bad value is one sentence that names field, value and remedy."""

import math
from dataclasses import FrozenInstanceError, fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Imu, Numerics, PoseReceiver, Robot, Sensors, Soil, TorusWheel, WheelEncoder
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.validated import Validated

ROBOT, SOIL = get_robot("ddagr"), get_soil("thesis_a1")
VALID: tuple[Validated, ...] = (
    ROBOT.wheels[0],
    SOIL,
    ROBOT,
    Imu(),
    WheelEncoder(),
    PoseReceiver(),
    Numerics(),
    Numerics.finest(),
    Numerics.smooth(),
)
BOUNDED = [
    (item, field.name, field.metadata)
    for item in VALID[:7]
    for field in fields(item)
    if "unit" in field.metadata and not field.metadata.get("length")
]
TUPLES = [(item, field) for item in VALID for field in fields(item) if field.metadata.get("length")]


def _refusal(item, **changes):
    with pytest.raises(InputError) as error:
        item.with_values(**changes)
    message = str(error.value)
    assert message.endswith(".")
    assert "\n" not in message
    return message


@pytest.mark.parametrize(("item", "name", "metadata"), BOUNDED, ids=lambda value: getattr(value, "name", None))
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, None, "wide", True, [1.0], 1j])
def test_what_is_no_finite_number_is_refused(item, name, metadata, value):
    message = _refusal(item, **{name: value})
    assert f"{type(item).__name__}.{name} is" in message
    assert metadata["unit"] in message


@pytest.mark.parametrize(("item", "name", "metadata"), BOUNDED, ids=lambda value: getattr(value, "name", None))
def test_bounds_are_enforced_and_stated(item, name, metadata):
    for bound, outward in ((metadata["low"], -1.0), (metadata["high"], 1.0)):
        if math.isfinite(bound):
            message = _refusal(item, **{name: bound + outward * max(abs(bound), 1.0) * 1e-3})
            assert f"{bound:g}" in message
    if metadata["open_low"]:
        assert "(" in _refusal(item, **{name: metadata["low"]})


@pytest.mark.parametrize(("item", "field"), TUPLES, ids=lambda value: getattr(value, "name", None))
def test_tuples_are_checked_entry_by_entry(item, field):
    count = field.metadata["length"]
    for bad in ((math.nan,) * count, (0.5,) * (count + 1), (0.5,) * (count - 1), 0.5, None, ("a",) * count):
        assert f"{type(item).__name__}.{field.name} is" in _refusal(item, **{field.name: bad})
    assert len(TUPLES) == 5


@pytest.mark.parametrize("item", VALID, ids=lambda item: type(item).__name__)
def test_parameters_are_frozen_and_compare_by_value(item):
    with pytest.raises(FrozenInstanceError):
        setattr(item, fields(item)[0].name, 1.0)
    assert item.with_values() == item


@given(st.floats(0.01, 0.5), st.floats(0.01, 0.5), st.floats(0.01, 2.0))
def test_torus_has_the_smaller_part_as_minor_radius(minor, width, major):
    if minor <= major:
        assert TorusWheel(minor, width, major).outer_radius == minor + major
    else:
        with pytest.raises(InputError, match="minor_radius"):
            TorusWheel(minor, width, major)


@given(st.floats(0.001, 0.1), st.floats(0.01, 0.5))
def test_plate_pressure_is_bekkers(sinkage, width):
    expected = (SOIL.cohesive_modulus / width + SOIL.frictional_modulus) * sinkage**SOIL.sinkage_exponent
    assert SOIL.pressure(sinkage, width) == pytest.approx(expected)


def test_numpy_numbers_are_numbers():
    assert TorusWheel(np.float64(0.05), np.float32(0.1), np.int64(1)).outer_radius == pytest.approx(1.05)


def test_one_wheel_stands_for_four():
    assert ROBOT.with_values(wheels=(ROBOT.wheels[0],)).wheels == ROBOT.wheels


@pytest.mark.parametrize("wheels", [(), (ROBOT.wheels[0],) * 3, (1, 2, 3, 4), None, ROBOT.wheels[0]])
def test_wheels_are_one_or_four_tyres(wheels):
    assert "Robot.wheels" in _refusal(ROBOT, wheels=wheels)


@pytest.mark.parametrize("place", [(0.33, 0.0, 0.4), (0.0, -0.6, 0.4), (0.0, 0.0, -0.1)])
def test_centre_of_mass_lies_between_the_wheels_and_above_ground(place):
    assert "centre_of_mass" in _refusal(ROBOT, centre_of_mass=place)


@pytest.mark.parametrize("deviation", [-1.0, math.nan, "large"])
def test_standard_deviations_are_numbers_from_zero_on(deviation):
    assert "standard_deviations['mass']" in _refusal(ROBOT, standard_deviations={"mass": deviation})


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("section_nodes", 9),
        ("section_nodes", 0),
        ("section_nodes", 72),
        ("section_nodes", 8.0),
        ("section_nodes", "eight"),
        ("contact_nodes", 0),
        ("contact_nodes", 2.5),
        ("contact_nodes", True),
        ("jacobian_contact_nodes", 65),
        ("substeps", 0),
        ("substeps", 10**6),
        ("launch_substeps", -1),
    ],
)
def test_counts_of_the_numerics_are_whole_and_bounded(name, value):
    message = _refusal(Numerics(), **{name: value})
    assert f"Numerics.{name} is {value!r}" in message
    assert "give" in message


def test_sensors_share_one_period():
    assert Sensors(imu=Imu(sample_rate=50.0)).period == 0.02


def test_wheel_positions_follow_the_numbering():
    """1 front right, 2 front left, 3 rear right, 4 rear left."""
    robot: Robot = ROBOT
    assert robot.wheel_x == (0.33, 0.33, -0.33, -0.33)
    assert robot.wheel_y == (-0.58, 0.58, -0.58, 0.58)


def test_every_physical_field_states_its_unit():
    for kind in (TorusWheel, Soil, Imu, WheelEncoder, PoseReceiver):
        assert all("unit" in field.metadata for field in fields(kind)), kind


def test_what_cannot_be_uncertain_is_no_standard_deviation():
    refusal = _refusal(ROBOT, standard_deviations={"mas": 1.0})
    assert refusal == "unknown entry of standard_deviations 'mas': did you mean 'mass'."
    known = replace(ROBOT, standard_deviations={"half_width": 0.01, "command_delay": 0.1})
    assert set(known.standard_deviations) == {"half_width", "command_delay"}
