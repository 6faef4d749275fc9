"""What a calibration says of the drivetrain becomes names, sizes and errors of a diagnosis."""

from dataclasses import replace

import pytest

from ddagr_gym.calibration.drivetrain_answer import drivetrain_answer, drivetrain_findings
from ddagr_gym.calibration.part_comparison import is_missed, surely_above
from ddagr_gym.calibration.result import (
    CALIBRATED,
    DATA_SHEET,
    KINEMATIC,
    SCHEMA,
    SCHEMA_VERSION,
    CalibratedParameter,
    Calibration,
    Covariance,
    DriveSummary,
    ForecastError,
    PartDecision,
    Scatter,
    Unexplained,
)
from ddagr_gym.diagnosis.answer.drivetrain import LEAST_GROWTH

RMS = {DATA_SHEET: 4.0, CALIBRATED: 1.0, KINEMATIC: 2.0}


def parameter(name: str, part: str, value: float | None, calibrated: bool = True) -> CalibratedParameter:
    return CalibratedParameter(
        name, part, "", "s", 0.0, 0.0, 0.3, value, (0.1, 0.3) if calibrated else None, calibrated, "", "", 0.2, 0.05,
        Scatter(1, None, None, 0, 0), (),
    )  # fmt: skip


def error(fold: str, model: str, horizon: float | None, rms: float | None) -> ForecastError:
    metric, unit = ("wheel_speed", "rad/s") if horizon is None else ("heading", "rad")
    return ForecastError(fold, "ground", "other drives", model, metric, horizon, unit, 9, rms, (0.9, 1.1), None, None)


def calibration(lateness: float = 0.0) -> Calibration:
    parts = (
        PartDecision("inertia", True, 0.3, 0.1),
        PartDecision("friction", False, -0.01, 0.02),
        PartDecision("load", True, 0.5, 0.1),
        PartDecision("command_delay", True, 0.2, 0.05),
    )
    parameters = (
        parameter("mass", "inertia", 400.0),
        parameter("viscous_rate", "friction", None, calibrated=False),
        parameter("load_compliance", "load", 0.01),
        parameter("command_delay", "command_delay", 0.2),
    )
    errors = tuple(
        error(fold, model, horizon, rms)
        for fold in ("first quarter", "second quarter")
        for horizon in (None, 5.0)
        for model, rms in RMS.items()
    )
    drive = DriveSummary("yard.csv", "", "ground", 600.0, 100.0, 500.0, lateness, ())
    left = (Unexplained("wheel_speed", "turning", 0.7, 0.5, 1.0, 0.1), Unexplained("yaw_rate", "turning", 1, 1, 1, 1))
    return Calibration(
        SCHEMA, SCHEMA_VERSION, "0", "warthog", "warthog", {"ground": ""}, (drive,), 6.0, parts, parameters,
        Covariance((), ()), errors, (), left, True, 0, 1.0,
    )  # fmt: skip


def test_named_are_kept_parts_of_the_drivetrain_in_the_order_of_the_signal():
    answer = drivetrain_answer(calibration(), {"encoder_right": 9.0})
    assert answer.names == ("command_delay", "load")
    assert [part.name for part in answer.parts] == ["command_delay", "load", "friction"]
    assert answer.other == ("mass",)
    assert answer.misfit == {"encoder_right": 9.0}


def test_the_explained_share_is_of_squared_errors_of_the_wheel_speeds_on_what_was_left_out():
    assert drivetrain_answer(calibration(), {}).explained == pytest.approx(1.0 - (1.0 / 4.0) ** 2)


def test_errors_stand_side_by_side_and_what_is_left_is_that_of_the_wheels():
    answer = drivetrain_answer(calibration(), {})
    assert len(answer.forecasts) == 4
    item = answer.forecasts[0]
    assert (item.nominal, item.corrected, item.kinematic) == (4.0, 1.0, 2.0)
    assert [(part.condition, part.share) for part in answer.remaining] == [("turning", 0.7)]


def test_the_gain_of_a_part_is_what_forecasts_lose_without_it_and_its_gate_what_chance_would_lose():
    delay, load = drivetrain_findings(calibration())
    assert (delay.name, load.name) == ("command_delay", "load")
    # nearly every robot has a dead time: what matters is enough there
    assert (delay.gain, delay.gate) == (0.2, LEAST_GROWTH)
    assert (load.gain, load.gate) == (0.5, pytest.approx(surely_above(2) * 0.1))
    assert delay.parameters["command_delay"].interval == (0.1, 0.3)


@pytest.mark.parametrize("error", [0.0, 0.001, 0.1])
def test_the_gate_of_a_part_is_the_one_that_its_selection_used(error):
    given = calibration()
    parts = tuple(replace(part, error=error) if part.name == "load" else part for part in given.parts)
    gate = next(item.gate for item in drivetrain_findings(replace(given, parts=parts)) if item.name == "load")
    assert gate == max(LEAST_GROWTH, surely_above(2) * error)
    assert not is_missed(gate, error, 2)
    assert is_missed(gate + 1e-9, error, 2)
