"""A simulated robot with a drivetrain that its data sheet does not have: the diagnosis names its parts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ddagr_gym
from benchmarks.simulated_robots import RATE, steps
from ddagr_gym.api import drivetrain_fit
from ddagr_gym.calibration.run import LittleExplainedError
from ddagr_gym.diagnosis import pipeline
from ddagr_gym.diagnosis.search.scanned_model import SearchResult, scan_model
from ddagr_gym.errors import InputError, InputWarning
from ddagr_gym.presets import get_robot
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.reporting.drivetrain_section import DRIVETRAIN_FOLDER

DELAY = 0.3
LOAD = 0.06  # 1/(kg m^2): the turning torque of the soil takes a tenth of the bank speeds until the integral part is up


def driven(seconds: float) -> Recording:
    robot = get_robot("ddagr")
    own = replace(robot.drivetrain, command_delay=DELAY, load_compliance=LOAD, integral_rate=2.0)
    made = ddagr_gym.simulate(
        steps(5, seconds), replace(robot, drivetrain=own), "thesis_a1", rate=RATE, pose_rate=5.0, seed=5
    )
    return made.recording.with_meta(source="yard.csv")


def search_nothing(session, start, cache, enough):
    """A search that finds no name: what it does on a real drive takes minutes."""
    return SearchResult((scan_model(session.problem, start.refitted),))


@pytest.fixture
def asked(monkeypatch):
    monkeypatch.setattr(pipeline, "search", search_nothing)
    monkeypatch.setattr(pipeline, "unlike_commands", lambda accepted, gates, common: {"encoder_left": 9.0})
    monkeypatch.setattr(drivetrain_fit, "_ONE_DRIVE", {"fitted": 16, "compared": 12, "settlings": 1})


@pytest.fixture(scope="module")
def searched(tmp_path_factory):
    """Cache of a diagnosis of 70 s whose checks and search need not be done again."""
    return tmp_path_factory.mktemp("searched") / "cache"


@pytest.mark.slow
def test_parts_are_named_and_the_pages_say_so(asked, tmp_path):
    result = ddagr_gym.diagnose(driven(180.0), cache=tmp_path / "cache")
    assert {"command_delay", "load"} <= set(result.verdict)
    found = {finding.name: finding for finding in result.findings}
    assert float(found["command_delay"].parameters["command_delay"]) == pytest.approx(DELAY, abs=0.03)
    # with one drive a heavier load and a softer soil do nearly the same: the size is known to a factor
    assert LOAD / 3.0 < float(found["load"].parameters["load_compliance"]) < 3.0 * LOAD
    assert result.diagnosis.drivetrain.explained > 0.8
    # the refit of the whole robot that follows may trade some of it for the motors' rate
    assert result.robot.drivetrain.command_delay == pytest.approx(DELAY, abs=0.05)
    folder = result.report(tmp_path / "answer")
    page = (folder / "index.html").read_text()
    assert "Between command and wheel" in page
    assert f'href="{DRIVETRAIN_FOLDER}/calibration.html"' in page
    assert (folder / DRIVETRAIN_FOLDER / "calibration.html").is_file()
    assert "dead time of the commands" in str(result)


@pytest.mark.slow
def test_sensors_are_named_beside_it(asked):
    """A turned IMU, an encoder with other counts and a gyro with another sensitivity, in one drive."""
    made = driven(180.0)
    along, across, angle = made["specific_force_x"], made["specific_force_y"], 0.3
    turned = {
        "specific_force_x": np.cos(angle) * along + np.sin(angle) * across,
        "specific_force_y": np.cos(angle) * across - np.sin(angle) * along,
        "encoder_left": 1.2 * made["encoder_left"],
        "yaw_rate": 1.1 * made["yaw_rate"],
    }
    result = ddagr_gym.diagnose(replace(made, channels={**made.channels, **turned}), names_only=True)
    found = {finding.name: finding.parameters for finding in result.findings}
    assert {"encoder_scale", "gyro_scale", "imu_misalignment", "command_delay"} <= set(found)
    assert float(found["encoder_scale"]["left"]) == pytest.approx(1.2, abs=0.02)
    assert float(found["encoder_scale"]["right"]) == pytest.approx(1.0, abs=0.02)
    assert float(found["gyro_scale"]["scale"]) == pytest.approx(1.1, abs=0.02)
    assert float(found["imu_misalignment"]["yaw"]) == pytest.approx(angle, abs=0.05)
    assert {"encoder_scale", "gyro_scale", "imu_misalignment"} <= {effect.name for effect in result.effects}
    assert "the left encoder reads" in str(result)


@pytest.mark.slow
def test_a_bank_with_another_gain_is_named_beside_it(asked):
    """The right bank does what it is told over 0.85: its log holds less than the robot obeyed."""
    made = driven(180.0)
    told = {"command_right": 0.85 * made["command_right"]}
    result = ddagr_gym.diagnose(replace(made, channels={**made.channels, **told}), names_only=True)
    found = {finding.name: finding.parameters for finding in result.findings}
    assert {"command_gain", "command_delay", "load"} <= set(found)
    gains = found["command_gain"]
    assert float(gains["right"]) / float(gains["left"]) == pytest.approx(1.0 / 0.85, abs=0.02)
    assert "than the model's for the same command" in str(result)
    (effect,) = [item for item in result.effects if item.name == "command_gain"]
    assert (effect.right, effect.left) == (float(gains["right"]), float(gains["left"]))


@pytest.mark.slow
def test_encoders_that_both_read_too_much_are_named_beside_it(asked):
    """No drivetrain makes wheels faster than they were told; commands of another scale would do the same."""
    made = driven(180.0)
    read = {name: 1.1 * made[name] for name in ("encoder_right", "encoder_left")}
    result = ddagr_gym.diagnose(replace(made, channels={**made.channels, **read}), names_only=True)
    found = {finding.name: finding for finding in result.findings}
    assert {"command_delay", "load"} <= set(found)
    (scale,) = [found[name] for name in ("encoder_scale", "command_gain") if name in found]
    assert "encoder_scale" in scale.equivalence_set
    for size in scale.parameters.values():
        assert float(size) == pytest.approx(1.1, abs=0.03)


def test_a_recording_that_cannot_tell_its_drivetrain_keeps_its_answer_and_says_why(asked, monkeypatch):
    def refuse(*inputs, **named):
        raise InputError("yard.csv has 3 windows: give a longer drive.")

    monkeypatch.setattr("ddagr_gym.calibration.run.ready_drives", refuse)
    with pytest.warns(InputWarning, match="the drivetrain cannot be fitted: yard.csv has 3 windows"):
        result = ddagr_gym.diagnose(driven(40.0), names_only=True)
    assert result.diagnosis.drivetrain is None


def test_a_drivetrain_that_explains_little_is_no_answer_and_that_is_said(asked, searched, monkeypatch):
    def fit(*inputs, **named):
        assert 0.0 < inputs[4].least_explained < 0.5
        raise LittleExplainedError(0.07)

    monkeypatch.setattr("ddagr_gym.calibration.run.calibrate_drives", fit)
    lines = []
    result = ddagr_gym.diagnose(driven(70.0), names_only=True, cache=searched, progress=lines.append)
    assert result.diagnosis.drivetrain is None
    assert any("explain 7% of the squared error of left-out wheel speeds: no answer" in line for line in lines)


def test_an_error_inside_the_fit_is_no_property_of_the_recording(asked, searched, monkeypatch):
    def fail(*inputs, **named):
        raise InputError("Drivetrain.coulomb_friction is -2e-13.")

    monkeypatch.setattr("ddagr_gym.calibration.run.calibrate_drives", fail)
    with pytest.raises(InputError, match="coulomb_friction"):
        ddagr_gym.diagnose(driven(70.0), names_only=True, cache=searched)


@pytest.mark.parametrize("robot", ["ddagr", "warthog"])
def test_shipped_thresholds_ask_what_the_simulator_lacks(robot):
    from ddagr_gym.diagnosis.gates.threshold_files import default_thresholds

    assert not default_thresholds(robot).of_ordinary_drives
