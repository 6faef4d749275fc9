"""``ddagr_gym.replay``: a drive on a slope, replayed with and without it."""

from __future__ import annotations

import json

import pytest

import ddagr_gym
from ddagr_gym.config import config_from
from ddagr_gym.control.manoeuvres import Manoeuvre
from ddagr_gym.errors import InputError
from ddagr_gym.replay_analysis.report import ReplayReport

TURNS = Manoeuvre("turns", ((4.0, 1.0, 0.5), (4.0, 0.5, 1.0), (4.0, 0.9, 0.9)))


@pytest.fixture(scope="module")
def sloping():
    return ddagr_gym.simulate(TURNS, effects="slope=0.1", rate=25.0, pose_rate=5.0)


@pytest.fixture(scope="module")
def lines() -> list[str]:
    return []


@pytest.fixture(scope="module")
def level(sloping, lines):
    return ddagr_gym.replay(sloping, progress=lines.append)


def test_the_slope_explains_the_error(sloping, level):
    with_slope = ddagr_gym.replay(sloping.recording, effects=["slope=0.1"], soil="thesis_a1")
    before, after = (result.errors(1.0)[0].error.rms for result in (level, with_slope))
    assert after < 0.5 * before


def test_progress_comes_in_lines(level, lines):
    assert lines[-1].startswith("replaying: 100 %")
    assert len(lines) <= 10


def test_text_notebook_and_name(level, page_text):
    assert repr(level) == "<ReplayResult: simulation: 12 s by ddagr on thesis_a1, nominal>"
    assert "driven by wheel speeds" in str(level)
    assert "heading error after 5 s" in page_text(level)


def test_the_document_is_that_of_the_command(level, tmp_path):
    level.to_json(tmp_path / "replay.json")
    assert config_from(json.loads((tmp_path / "replay.json").read_text()), ReplayReport) == level.document


def test_page_and_figures_are_written_whole_or_not_at_all(level, tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")

    def fails(*arguments):
        raise OSError("no space left")

    with monkeypatch.context() as patch:
        patch.setattr("ddagr_gym.reporting.replay_page.replay_page", fails)
        with pytest.raises(OSError, match="no space"):
            level.report(tmp_path / "replayed")
    assert list(tmp_path.iterdir()) == []
    level.report(tmp_path / "replayed")
    names = {path.name for path in (tmp_path / "replayed").iterdir()}
    assert {"index.html", "replay.json", "simulation_commands.png", "simulation_encoders.svg"} <= names


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"robot": "husky"}, "'ddagr', not 'husky'"),
        ({"soil": "mud"}, "unknown soil 'mud'"),
        ({"effects": "magic=1"}, "magic"),
        ({"threads": 0}, "threads is 0"),
        ({"window": 0.01}, "the window is 0.01 s"),
    ],
)
def test_bad_options_are_one_sentence(sloping, options, message):
    with pytest.raises(InputError, match=message):
        ddagr_gym.replay(sloping, **options)


def test_a_table_needs_a_robot(sloping):
    pytest.importorskip("pandas")
    with pytest.raises(InputError, match="in Python"):
        ddagr_gym.replay(sloping.to_pandas())


def test_a_robot_of_ones_own_is_asked_for_by_its_file(sloping):
    with pytest.raises(InputError, match=r"of the robot 'mule': name it with --robot FILE\.yaml"):
        ddagr_gym.replay(sloping.recording.with_meta(robot="mule"))
