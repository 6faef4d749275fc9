"""``ddagr_gym.check``: findings, text, notebook and files; the command's own tests cover what it says."""

from __future__ import annotations

import json

import pytest

import ddagr_gym
from ddagr_gym.errors import InputError
from ddagr_gym.presets import get_robot


@pytest.fixture(scope="module")
def flipped(drive):
    """The drive with its gyro upside down, as a table."""
    table = drive.to_pandas()
    table["yaw_rate"] = -table["yaw_rate"]
    return ddagr_gym.check(table, robot="ddagr")


def test_a_flipped_gyro_is_found_in_a_table(flipped):
    assert not flipped.sound
    assert "sign_and_scale" in {finding.check for finding in flipped.suspicious}
    assert "The gyro turns the wrong way." in str(flipped)
    assert repr(flipped).startswith("<CheckResult: table 1: ")


def test_a_sound_drive_passes(drive):
    result = ddagr_gym.check(drive)
    assert result.sound
    assert result.suspicious == ()
    assert "\npass " in result.text(everything=True)
    assert "\npass " not in str(result)


def test_a_notebook_shows_headline_and_table_with_texts_escaped(drive, page_text):
    recording = drive.recording.with_meta(source="<b>a&b</b>.csv")
    text = page_text(ddagr_gym.check(recording))
    assert "<b>a&b</b>.csv" in text
    assert "not testable" in text


def test_reports_of_several_runs_are_those_of_the_command(drive, tmp_path):
    pytest.importorskip("matplotlib")
    other = ddagr_gym.simulate("s_weave", rate=50.0, pose_rate=5.0)
    runs = [drive.recording.with_meta(source="one.sim"), other.recording.with_meta(source="two.sim")]
    result = ddagr_gym.check(runs)
    lines: list[str] = []
    assert result.report(tmp_path / "checked", progress=lines.append) == tmp_path / "checked"
    names = {path.name for path in (tmp_path / "checked").iterdir()} - {".ddagr-output"}
    assert names == {"one.json", "one.png", "two.json", "two.png", "together.json"}
    assert [line.split(" (")[0] for line in lines] == ["drawing: 50 %", "drawing: 100 %"]
    result.to_json(tmp_path / "all.json")
    content = json.loads((tmp_path / "all.json").read_text())
    assert [run["source"] for run in content["runs"]] == ["one.sim", "two.sim"]
    assert content["runs"][0] == json.loads((tmp_path / "checked" / "one.json").read_text())
    assert content["together"] == json.loads((tmp_path / "checked" / "together.json").read_text())["findings"]
    with pytest.raises(InputError, match="overwrite=True"):
        result.report(tmp_path / "checked")


def test_a_report_that_fails_leaves_nothing(drive, tmp_path, monkeypatch):
    def fails(*arguments, **options):
        raise OSError("no space left")

    monkeypatch.setattr("ddagr_gym.reporting.check_figure.save_check_figure", fails)
    with pytest.raises(OSError, match="no space"):
        ddagr_gym.check(drive).report(tmp_path / "checked")
    assert list(tmp_path.iterdir()) == []


def test_two_robots_and_bad_seeds_are_refused(drive):
    other = ddagr_gym.simulate("straight", get_robot("husky"), "firm_ground", rate=50.0)
    with pytest.raises(InputError, match="one robot at a time"):
        ddagr_gym.check([drive, other])
    with pytest.raises(InputError, match="seed is -1"):
        ddagr_gym.check(drive, seed=-1)


def test_a_run_that_does_not_name_its_robot_goes_with_those_that_do(drive):
    unnamed = drive.recording.with_meta(robot="", geometry=None)
    assert len(ddagr_gym.check([drive, unnamed]).reports) == 2
    runs = [drive, drive.recording.with_meta(robot="rover"), unnamed]
    with pytest.raises(InputError, match="of the robots ddagr, rover: check one robot at a time, with --robot NAME"):
        ddagr_gym.check(runs)
