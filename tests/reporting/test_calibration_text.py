"""What a calibration leaves as in the data sheet, in the words of its tables and lists."""

from __future__ import annotations

from types import SimpleNamespace

from ddagr_gym.calibration.result import CALIBRATED, DATA_SHEET, CalibratedParameter, PartDecision
from ddagr_gym.calibration.summary import NO_SCATTER, NOT_NEEDED
from ddagr_gym.reporting.calibration_text import (
    AS_STATED,
    headline,
    parameter_row,
    part_rows,
    refused_groups,
    refused_heading,
)


def refused(name: str, helps: str) -> CalibratedParameter:
    return CalibratedParameter(
        name=name, part="p", ground="", unit="s", data_sheet=0.0, expected=0.0, expected_deviation=0.3, value=0.0,
        interval=None, calibrated=False, reason=NOT_NEEDED, helps=helps, change=0.0, deviation=None,
        scatter=NO_SCATTER, estimates=(),
    )  # fmt: skip


LEFT = (refused("command_delay", "steps"), refused("command_filter", "steps"), refused("mass", "reversals"))


def test_a_reason_is_said_once_above_all_parameters_that_it_is_of():
    groups = refused_groups(SimpleNamespace(parameters=LEFT))
    assert groups == {NOT_NEEDED: ["command delay, command filter: steps.", "mass: reversals."]}
    said = refused_heading(NOT_NEEDED)
    assert said.startswith("As in the data sheet, since of each of them: forecasts of left-out drives are worse")
    assert said.endswith("or not at all. Drives that would help:")


def test_tables_say_what_is_in_the_model_and_what_is_as_in_the_data_sheet():
    assert parameter_row(LEFT[0])[3:] == (AS_STATED, "", "")
    decisions = (
        PartDecision("command_delay", True, 0.5, 0.1),
        PartDecision("command_ramp", False, 0.0, 0.1),
        PartDecision("gyro_scale", False, 0.0, 0.1),
    )
    assert [row[1] for row in part_rows(SimpleNamespace(parts=decisions))] == ["yes", "no", AS_STATED]


def test_the_headline_says_which_measure_it_has():
    made = SimpleNamespace(
        robot="rover", drives=(1, 2), grounds=("yard",), parameters=LEFT,
        forecasts=[
            SimpleNamespace(metric="wheel_speed", horizon=None, rms=rms, model=model)
            for model, rms in ((DATA_SHEET, 0.1), (CALIBRATED, 0.02))
        ],
    )  # fmt: skip
    assert headline(made).endswith(
        "the root mean square error of the wheel speeds over all samples is 20 % of the data sheet's."
    )
