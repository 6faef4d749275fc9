"""``ddagr_gym.isolability`` and ``ddagr_gym.next_drive``: what drives could show, before any are made."""

from __future__ import annotations

import json

import pytest

import ddagr_gym
from ddagr_gym.control.manoeuvres import MANOEUVRES, Manoeuvre
from ddagr_gym.errors import InputError, InputWarning
from ddagr_gym.physics.effects import registry
from ddagr_gym.physics.effects.slope import Slope

SHORT = Manoeuvre("short", ((2.0, 0.8, 0.8), (2.0, 0.8, -0.8), (2.0, 0.8, 0.8)))


@pytest.fixture(scope="module")
def table():
    """Of three effects and one drive."""
    few = {name: registry.effect_kinds()[name] for name in ("slope", "gyro_scale", "imu_tilt")}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("ddagr_gym.diagnosis.search.scan.absolute_effect_kinds", lambda frames_apart: few)
        return ddagr_gym.isolability(SHORT, ("imu", "encoders"))


def test_sizes_and_rivals_of_effects(table):
    assert set(table.least_detectable) == {"slope", "gyro_scale", "imu_tilt"}
    assert 0.0 < table.least_detectable["slope"] < 0.2  # [rad]
    assert "gyro_scale" not in table.confused_with("slope")
    assert repr(table).startswith("<IsolabilityResult: ddagr on thesis_a1: short (6 s) with imu, encoders")


def test_text_notebook_and_files(table, page_text, tmp_path):
    assert "least detectable" in str(table)
    assert "least detectable" in page_text(table)
    table.to_json(tmp_path / "one.json")
    pytest.importorskip("matplotlib")
    table.report(tmp_path / "out")
    names = {path.name for path in (tmp_path / "out").iterdir()} - {".ddagr-output"}
    assert names == {"isolability.json", "isolability.txt", "isolability.png", "isolability.svg"}
    assert (tmp_path / "out" / "isolability.txt").read_text() == f"{table}\n"
    assert (tmp_path / "one.json").read_text() == (tmp_path / "out" / "isolability.json").read_text()


def test_thresholds_of_another_soil_are_warned_of_and_unknown_drives_refused():
    with pytest.raises(InputError, match="straight"):
        ddagr_gym.isolability("strait")
    with pytest.warns(InputWarning, match="soil thesis_a1 instead of lete_sand_wong"), pytest.raises(InputError):
        ddagr_gym.isolability(SHORT, ("lidar",), soil="lete_sand_wong")


@pytest.fixture
def small_bank(monkeypatch):
    bank = {name: MANOEUVRES[name] for name in ("straight", "two_headings")}
    monkeypatch.setattr("ddagr_gym.diagnosis.planning.next_drive.MANOEUVRES", bank)


def test_two_headings_tell_a_slope_from_a_bias(small_bank, page_text, tmp_path):
    """The slope's pull turns with the robot, the bias does not."""
    lines: list[str] = []
    result = ddagr_gym.next_drive([Slope(0.02), "accelerometer_bias=0.2"], progress=lines.append)
    assert result.manoeuvre == "two_headings"
    assert result.separates == (("slope", "accelerometer_bias"),)
    assert result.minutes is not None
    assert "simulating the rivals" in lines
    assert str(result).startswith("Drive two_headings: ")
    assert "two_headings" in page_text(result)
    result.to_json(tmp_path / "next.json")
    assert json.loads((tmp_path / "next.json").read_text())["manoeuvre"] == "two_headings"


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("nowhere", "ddagr diagnose"),
        (["slop=0.1"], "slope"),
        ([], "rival"),
        (3.0, "neither a diagnosis nor a list of effects"),
        ([0.1], "neither a diagnosis nor a list of effects"),
    ],
)
def test_what_is_no_question_is_refused(given, message):
    with pytest.raises(InputError, match=message):
        ddagr_gym.next_drive(given)
