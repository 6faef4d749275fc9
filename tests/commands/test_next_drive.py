"""``ddagr next-drive``: from rivals or a diagnosis to a manoeuvre."""

import json
from dataclasses import asdict, replace
from types import SimpleNamespace

import pytest

from ddagr_gym.cli import main
from ddagr_gym.config import dump_config
from ddagr_gym.control.manoeuvres import MANOEUVRES
from ddagr_gym.diagnosis.answer.next_drive_plan import NextDrivePlan
from ddagr_gym.diagnosis.answer.verdict import Diagnosis, Estimate, Finding, GatesUsed, Options
from ddagr_gym.diagnosis.result.files import save
from ddagr_gym.identification.nuisances import NuisancePriors
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.reporting.next_drive_text import answer_text


@pytest.fixture
def small_bank(monkeypatch):
    bank = {name: MANOEUVRES[name] for name in ("straight", "two_headings")}
    monkeypatch.setattr("ddagr_gym.diagnosis.planning.next_drive.MANOEUVRES", bank)


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
        ([], "either the folder of a diagnosis"),
        (["nowhere"], "ddagr diagnose"),
        (["--rival", "slope=0.1", "--seed", "-1"], "seed is -1: give at least 0"),
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
    assert answer_text(NextDrivePlan.none("No manoeuvre helps.")) == "No manoeuvre helps."


def test_a_diagnosis_knows_its_robot_and_soil(tmp_path, monkeypatch, capsys):
    """Planned for another robot unless it is asked for."""
    planned = []

    def plan(robot, soil, rivals, **rest):
        planned.append((robot.name, soil, [rival.name for rival in rivals]))
        return NextDrivePlan.none("No manoeuvre helps.")

    monkeypatch.setattr("ddagr_gym.diagnosis.planning.next_drive.next_drive", plan)
    finding = Finding(
        "slope", {"angle": Estimate(0.02, "rad"), "direction": Estimate(0.3, "rad")}, 30.0, 8.0, 4.0, 20.0,
        equivalence_set={"slope": 0.6, "accelerometer_bias": 0.4},
    )  # fmt: skip
    bank = GatesUsed(nulls=60, bank="f", level=0.05)
    found = Diagnosis(
        ("slope",), True, (finding,), "It slopes.", {"nominal": {"yaw_rate": 2.0}}, {}, {}, ("a.csv",), bank, 1.0, "0",
        robot="warthog", soil="firm_ground",
    )  # fmt: skip
    save(found, tmp_path / "diagnosis.json")
    assert main(["next-drive", str(tmp_path)]) == 0
    assert main(["next-drive", str(tmp_path), "--robot", "husky", "--soil", "thesis_a1"]) == 0
    rivals = ["slope", "accelerometer_bias"]
    assert planned == [
        ("warthog", get_soil("firm_ground"), rivals),
        ("husky", get_soil("thesis_a1"), rivals),
    ]
    assert "No manoeuvre helps." in capsys.readouterr().out
    own = tmp_path / "own.yaml"
    own.write_text(dump_config(replace(get_robot("husky"), name="mine")))
    options = Options(6.0, 6.0, 0.1, asdict(NuisancePriors()), robot_file=str(own))
    save(replace(found, robot="mine", options=options), tmp_path / "diagnosis.json")
    assert main(["next-drive", str(tmp_path)]) == 0
    assert planned[-1][0] == "mine"
    # a comparison with ordinary drives has no simulator of its own
    changed = replace(found, change=SimpleNamespace(), options=Options(window=6.0, robot_file="calibration"))
    monkeypatch.setattr("ddagr_gym.diagnosis.result.files.load", lambda _: changed)
    assert main(["next-drive", str(tmp_path)]) == 2
    assert "give robot and soil, of a calibration --robot CALIBRATION/robot.yaml" in capsys.readouterr().err
    assert main(["next-drive", str(tmp_path), "--robot", str(own), "--soil", "firm_ground"]) == 0
    assert planned[-1][0] == "mine"
