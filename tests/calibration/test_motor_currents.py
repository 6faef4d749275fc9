"""Currents as evidence of a calibration: fitted, forecast, written down and drawn, and absent where there are none."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.motor_current_drives import EFFICIENCY, ROBOT, SOIL, VOLTAGE, true_drive
from benchmarks.motor_currents import no_currents
from ddagr_gym.calibration import files
from ddagr_gym.calibration.current_evidence import current_evidence
from ddagr_gym.calibration.forecast_errors import all_forecasts, forecast_errors
from ddagr_gym.calibration.joint_fit import complete_model, first_weights, fit_model, weigh_and_fit
from ddagr_gym.calibration.left_out import forecasts
from ddagr_gym.calibration.parts import PARTS, first_values
from ddagr_gym.calibration.result import Calibration, Covariance, CurrentEvidence
from ddagr_gym.calibration.run import ready_drives
from ddagr_gym.calibration.settings import CalibrationSettings
from ddagr_gym.identification.gauss_newton import linearised
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.checks.currents import CurrentKind
from ddagr_gym.reporting.current_figure import current_figure

SETTINGS = CalibrationSettings(window=5.0, fitted=8, judged=8, supply_currents=True)


def ready(recording):
    return ready_drives([recording], ["ground"], get_robot(ROBOT), {"ground": get_soil(SOIL)}, SETTINGS)


@pytest.fixture(scope="module")
def drive():
    return true_drive(1, CurrentKind.SUPPLY, seconds=60.0, current_rate=5.0)


@pytest.fixture(scope="module")
def data(drive):
    return ready(drive.recording)


def test_drives_with_currents_bring_their_constants(data):
    model, _ = complete_model(data)
    names = {p.name for p in model.parameters}
    assert {"current_gain_right", "current_offset_left", "current_loss"} <= names
    assert data.windows.measured.shape[2] == 10
    assert first_weights(data, data.windows).sigma.shape[2] == 10


def test_drives_without_currents_are_prepared_to_the_bit_as_before(drive, data):
    channels = {n: v for n, v in drive.recording.channels.items() if not n.startswith(("current", "battery"))}
    plain = ready(replace(drive.recording, channels=channels))
    assert plain.currents is None
    np.testing.assert_array_equal(plain.windows.measured, data.windows.measured[..., :8])
    assert [p.name for p in complete_model(plain)[0].parameters if p.name.startswith("current")] == []
    kept = complete_model(data)[0].parameters
    assert complete_model(plain)[0].parameters == tuple(p for p in kept if not p.name.startswith("current"))


def test_supply_currents_are_left_out_unless_asked_for(drive):
    settings = replace(SETTINGS, supply_currents=False)
    plain = ready_drives([drive.recording], ["ground"], get_robot(ROBOT), {"ground": get_soil(SOIL)}, settings)
    assert plain.currents is None
    assert plain.windows.measured.shape[2] == 8
    assert any("draw from their supply, are left out" in note for note in plain.notes[0])


@pytest.fixture(scope="module")
def started(data):
    """The model at its start, with its forecasts of left-out quarters."""
    model, held = complete_model(data)
    start = {**held, **first_values(model.parameters)}
    windows = data.spread(SETTINGS.fitted)
    weights = first_weights(data, windows)
    found = fit_model(data, windows, model, weights, start, 1, iterations=1)
    made = tuple(forecasts(data, found, data.spread(SETTINGS.judged), weights, 1))
    return found, all_forecasts(data, found, made, held, 1)


def test_left_out_currents_are_forecast_beside_the_usual_errors(data, started):
    found, compared = started
    assert all(item.windows.measured.shape[2] == 8 for item in compared)
    assert all(item.predictions[name].shape[2] == 8 for item in compared for name in item.predictions)
    assert {error.metric for error in forecast_errors(compared, 0)} >= {"heading", "wheel_speed"}
    evidence = current_evidence(data, found, compared)
    assert evidence.kind == "supply"
    assert {item.name: item.unit for item in evidence.constants}["current_gain_left"] == "A/W"
    assert {error.bank for error in evidence.errors} == {"right", "left"}


def test_the_picture_shows_measured_and_forecast_currents(started, tmp_path):
    _, compared = started
    figure = current_figure(compared)
    along = figure.axes[0]
    measured = np.concatenate([item.currents[0][..., 0].ravel() for item in compared])
    drawn = np.concatenate([np.ravel(line.get_ydata()) for line in along.lines if line.get_marker() == "."])
    assert np.isfinite(drawn).sum() == np.isfinite(measured).sum()
    figure.savefig(tmp_path / "currents.png")


def calibration(currents: CurrentEvidence | None) -> Calibration:
    return Calibration(
        files.SCHEMA, files.SCHEMA_VERSION, "0", "warthog", "warthog", {}, (), 6.0, (), (), Covariance((), ()), (), (),
        (), True, 0, 0.0, currents,
    )  # fmt: skip


def test_the_file_names_currents_only_where_there_are_some(data, started, tmp_path):
    assert "currents" not in json.loads(files.as_text(calibration(None)))
    evidence = current_evidence(data, *started)
    files.save(calibration(evidence), tmp_path / files.NAME)
    assert files.load(tmp_path).currents == evidence
    files.save(calibration(None), tmp_path / files.NAME)
    assert files.load(tmp_path).currents is None


@pytest.mark.slow
def test_currents_tell_their_gain_and_leave_the_load_as_known(data):
    """The gain that nobody told the fit; the load's deviation is about what it was (``benchmarks.motor_currents``)."""
    absent = frozenset(p.name for p in PARTS if p.name.endswith(("limit", "ramp")) or p.name == "no_load_speed")
    found = {}
    for name, chosen in (("with", data), ("without", no_currents(data))):
        complete, held = complete_model(chosen)
        model = complete.without(absent | {"limit_imbalance"}, chosen.robot)
        start = {**held, **first_values(model.parameters)}
        found[name], _ = weigh_and_fit(chosen, chosen.spread(SETTINGS.fitted), model, start, 1)
    evidence = current_evidence(data, found["with"], ())
    gain = {item.name: item.value for item in evidence.constants}["current_gain_right"]
    assert gain == pytest.approx(1.0 / (EFFICIENCY * VOLTAGE), rel=0.2)
    inverse = {name: np.linalg.inv(linearised(m.problem, m.fitted).information) for name, m in found.items()}
    load = {name: np.sqrt(np.diag(inverse[name]))[m.free.index("load_compliance")] for name, m in found.items()}
    # 1.24 of this drive, 1.13 in the median of the benchmark's ten
    assert 0.7 < load["with"] / load["without"] < 1.4
