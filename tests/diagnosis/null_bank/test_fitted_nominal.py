"""A robot and a soil that stand for fitted nuisance parameters, and null drives about them."""

from collections.abc import Callable
from dataclasses import fields, replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.null_bank import fitted_nominal as module
from ddagr_gym.diagnosis.null_bank.bank import NullBank
from ddagr_gym.diagnosis.null_bank.drives import null_recordings, template_of
from ddagr_gym.diagnosis.null_bank.fitted_nominal import FARTHEST, fitted_nominal
from ddagr_gym.diagnosis.setting import Setting
from ddagr_gym.identification.fitted_values import with_values
from ddagr_gym.identification.nuisances import nuisances
from ddagr_gym.identification.parameters import ModelParameter, robot_parameters
from ddagr_gym.identification.window_model import ideal_sensors
from ddagr_gym.parameters import Drivetrain, Robot
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import build_row

ROBOT, SOIL = get_robot("ddagr"), get_soil("thesis_a1")
GLOBAL = [p for p in nuisances(ROBOT, 1, 0.02).parameters if p.entries and p.scope is None and p.prior > 0.0]


DRIVETRAIN = Drivetrain(
    0.2, 0.05, 20.0, integral_rate=2.0, integral_limit=5.0, load_compliance=0.02, acceleration_limit=30.0,
    no_load_speed=5.0, power_limit=40.0, limit_imbalance=0.1, viscous_rate=0.3, coulomb_friction=0.2,
    turning_limit=1.5, mean_ramp=15.0, turning_ramp=8.0,
)  # fmt: skip
DRIVEN = replace(ROBOT, drivetrain=DRIVETRAIN, standard_deviations={f.name: 0.1 for f in fields(Drivetrain)})


@pytest.mark.parametrize("parameter", GLOBAL, ids=lambda parameter: parameter.name)
def test_rows_are_those_that_the_parameter_makes(parameter) -> None:
    """Whatever the fit moves in a row, the robot and the soil have in the same entries."""
    assert_rows_agree(ROBOT, parameter)


@pytest.mark.parametrize("parameter", robot_parameters(DRIVEN), ids=lambda parameter: parameter.name)
def test_rows_of_a_drivetrain_are_those_that_the_parameter_makes(parameter) -> None:
    assert_rows_agree(DRIVEN, parameter)


def assert_rows_agree(robot: Robot, parameter: ModelParameter) -> None:
    sensors = ideal_sensors(0.02)
    value = 0.07
    expected = build_row(robot, SOIL, sensors)[None].copy()
    parameter.apply(expected, value, np.zeros(1, dtype=np.int64))
    moved = build_row(*with_values(robot, SOIL, {parameter.name: value}), sensors)
    assert np.allclose(moved, expected[0], rtol=1e-12)
    assert not np.array_equal(moved, build_row(robot, SOIL, sensors))


def test_shifts_stay_inside_what_a_soil_may_be() -> None:
    _, soil = with_values(ROBOT, SOIL, {"exit_angle_ratio": -5.0, "stress_peak": 5.0})
    assert soil.exit_angle_ratio == 0.0
    assert soil.peak_stress_coefficient_0 == 1.0


def test_null_drives_are_drawn_about_the_fit(drive: Callable[..., Recording], monkeypatch: pytest.MonkeyPatch) -> None:
    """A drive with slow motors gives null drives with slow motors, and a bank of its own."""
    recording = drive(effects=("motor_lag=0.05",), seconds=20.0)
    setting = Setting().with_windows(2.0)
    found = fitted_nominal(ROBOT, SOIL, [recording], setting)
    assert found.credible
    assert found.farthest == "motor_rate"
    centre = (found.robot, found.soil)
    assert centre[0].motor_rate < 0.9 * ROBOT.motor_rate
    template = template_of([recording], (None,) * 8)
    slow, usual = (
        null_recordings(*about, template, "patchy", np.random.default_rng(5))[0] for about in (centre, (ROBOT, SOIL))
    )
    first = int(0.2 / recording.period)
    assert slow["encoder_right"][first] < 0.95 * usual["encoder_right"][first]
    hashes = {
        NullBank(ROBOT, SOIL, setting, (template,) * 20, 0, about).key() for about in (None, centre, (ROBOT, SOIL))
    }
    assert len(hashes) == 3
    assert module.with_values(ROBOT, SOIL, {}) == (ROBOT, SOIL)


def test_a_fit_beyond_the_data_sheet_is_not_credible(drive: Callable[..., Recording]) -> None:
    """Motors that are far slower than told are an effect; null drives with them would hide it."""
    recording = drive(effects=("motor_lag=0.15",), seconds=20.0)
    found = fitted_nominal(ROBOT, SOIL, [recording], Setting().with_windows(2.0))
    assert found.farthest == "motor_rate"
    assert found.deviations > FARTHEST
    assert not found.credible
