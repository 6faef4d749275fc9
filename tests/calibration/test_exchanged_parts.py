"""Where fits begin in which one part of a drivetrain does what another one did."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.calibration.exchanged_parts import (
    TRIED_DELAY,
    other_starts,
    with_integral_less_friction,
    with_late_commands,
    with_slow_motors,
)
from ddagr_gym.calibration.joint_fit import Standing
from ddagr_gym.presets import get_robot

WARTHOG = get_robot("warthog")
FASTER = 1.6
"""Logarithm of a factor on its motor rate."""


def standing(**values: float) -> Standing:
    usual = {
        "motor_rate": FASTER,
        "command_filter": 0.4,
        "command_delay": 0.1,
        "viscous_rate": 0.5,
        "integral_rate": 9.0,
    }
    return Standing(usual | values, np.ones((3, 8)), True)


def starts(part: str, left_out: tuple[str, ...] = (), **values: float) -> list[str]:
    return [name for name, _ in other_starts(part, standing(**values), WARTHOG, frozenset(left_out))]


def test_slow_motors_lag_as_long_as_a_filter_and_faster_motors():
    made = with_slow_motors(standing(), WARTHOG)
    rate = WARTHOG.motor_rate * np.exp(made.values["motor_rate"])
    assert 1.0 / rate == pytest.approx(0.4 + 1.0 / (WARTHOG.motor_rate * np.exp(FASTER)))
    assert 0.0 < made.values["command_filter"] < 0.1
    assert made.values["command_delay"] == 0.1
    assert np.array_equal(made.states, np.ones((3, 8)))


def test_late_commands_change_the_dead_time_alone():
    assert with_late_commands(standing()).values == standing().values | {"command_delay": TRIED_DELAY}


@pytest.mark.parametrize(
    ("part", "left_out", "expected"),
    [
        ("command_filter", (), [", slower motors", ", dead time from 0.3"]),
        ("command_filter", ("speed_loop",), [", dead time from 0.3"]),
        ("command_filter", ("command_delay",), [", slower motors"]),
        ("command_ramp", (), [", dead time from 0.3"]),
        ("command_ramp", ("command_delay",), []),
        ("integral", (), []),
        ("friction", (), [", less integral"]),
        ("friction", ("integral",), []),
    ],
)
def test_a_fit_without_a_part_begins_where_one_that_is_free_can_do_the_same(part, left_out, expected):
    assert starts(part, left_out) == expected


def test_a_dead_time_that_is_long_already_is_not_tried_from_a_shorter_one():
    assert starts("command_ramp", command_delay=0.5) == []


def closed_loop(rate: float, integral: float, friction: float) -> np.ndarray:
    """Response to a step of a linear speed loop, docs/theory/drivetrain.md, eqs. (2) to (4) far from all limits."""
    from scipy.signal import StateSpace, step

    system = StateSpace([[-rate - friction, 1.0], [-integral, 0.0]], [[rate], [integral]], [[1.0, 0.0]], [[0.0]])
    return step(system, T=np.linspace(0.0, 2.0, 50))[1]


def test_an_integral_part_that_only_undoes_friction_goes_with_it():
    rate = WARTHOG.motor_rate * np.exp(FASTER)
    made = with_integral_less_friction(standing(viscous_rate=0.5, integral_rate=0.5 * rate), WARTHOG)
    assert made.values["integral_rate"] == pytest.approx(0.0, abs=1e-12)
    assert closed_loop(rate, 0.5 * rate, 0.5) == pytest.approx(closed_loop(rate, 0.0, 0.0), abs=1e-6)


def test_the_rest_of_an_integral_part_stays_without_friction():
    rate = WARTHOG.motor_rate * np.exp(FASTER)
    made = with_integral_less_friction(standing(viscous_rate=0.5, integral_rate=0.5 * rate + 4.0), WARTHOG)
    assert made.values["integral_rate"] == pytest.approx(4.0)


def test_a_robot_whose_data_sheet_is_sure_of_its_motors_is_tried_too():
    known = standing(viscous_rate=0.5, integral_rate=9.0)
    del known.values["motor_rate"]
    ((_, made),) = other_starts("friction", known, WARTHOG, frozenset())
    assert made.values["integral_rate"] == pytest.approx(9.0 - 0.5 * WARTHOG.motor_rate)
    assert [name for name, _ in other_starts("command_filter", known, WARTHOG, frozenset())] == [", dead time from 0.3"]
    del known.values["integral_rate"]
    assert not list(other_starts("friction", known, WARTHOG, frozenset()))


def test_a_fit_without_friction_has_no_other_start():
    assert starts("friction", viscous_rate=0.0) == []
