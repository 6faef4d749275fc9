"""``ddagr next-drive``: from rivals or a diagnosis to a manoeuvre."""

import json

import pytest

from ddagr_gym.cli import main
from ddagr_gym.commands.next_drive import answer_text
from ddagr_gym.control.manoeuvres import MANOEUVRES


@pytest.fixture
def small_bank(monkeypatch):
    bank = {name: MANOEUVRES[name] for name in ("straight", "two_headings")}
    monkeypatch.setattr("ddagr_gym.diagnosis.next_drive.MANOEUVRES", bank)


def test_rivals_by_hand(tmp_path, capsys, small_bank):
    path = tmp_path / "next.json"
    rivals = ["--rival", "slope=0.02", "--rival", "accelerometer_bias=0.2"]
    assert main(["next-drive", *rivals, "--output", str(path)]) == 0
    assert "Drive two_headings: " in capsys.readouterr().out
    answer = json.loads(path.read_text())
    assert answer["manoeuvre"] == "two_headings"
    assert set(answer) == {"manoeuvre", "why", "separates", "power", "minutes", "alternatives"}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "either a diagnosis or"),
        (["nowhere"], "ddagr diagnose"),
        (["--rival", "slop=0.1"], "slope"),
        (["--rival", "slope=0.1", "--sensors", "lidar"], "imu"),
    ],
)
def test_bad_input_is_one_sentence(capsys, arguments, words):
    assert main(["next-drive", *arguments]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert "Traceback" not in error


def test_an_answer_of_nothing_is_its_sentence():
    nothing = {"manoeuvre": "", "why": "No manoeuvre helps.", "alternatives": []}
    assert answer_text(nothing) == "No manoeuvre helps."
