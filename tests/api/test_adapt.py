"""``ddagr_gym.adapt`` and ``ddagr adapt``: what is refused, what is warned of, what is written."""

import json
from dataclasses import replace
from types import SimpleNamespace

import pytest

import ddagr_gym
from ddagr_gym import cli
from ddagr_gym.adaptation import run
from ddagr_gym.api.adapt import corrected_by_calibration, corrected_by_diagnosis
from ddagr_gym.config import dump_config
from ddagr_gym.diagnosis.answer.verdict import Diagnosis, Estimate, Finding, GatesUsed
from ddagr_gym.diagnosis.result.files import save
from ddagr_gym.errors import InputError, InputWarning
from ddagr_gym.evaluation.controllers import find_controller
from ddagr_gym.physics.effects import load_effects, save_effects
from ddagr_gym.physics.effects.slope import Slope
from ddagr_gym.presets import ddagr, get_soil

FINDING = Finding("slope", {"angle": Estimate(0.05, "rad", (0.045, 0.055))}, 30.0, 8.0, 4.0, 20.0)
ANSWER = Diagnosis(
    ("slope",),
    True,
    (FINDING,),
    "The ground slopes.",
    {"nominal": {"yaw_rate": 2.0}},
    {},
    {},
    ("a.csv",),
    GatesUsed(nulls=60, bank="a test", level=0.05),
    1.0,
    "0",
)


@pytest.fixture
def diagnosis(tmp_path):
    """Maker of a folder as ``ddagr diagnose`` writes it."""

    def make(**changes):
        folder = tmp_path / "diagnosis"
        folder.mkdir(exist_ok=True)
        answer = replace(ANSWER, **changes)
        save(answer, folder / "diagnosis.json")
        (folder / "robot.yaml").write_text(dump_config(ddagr()))
        (folder / "soil.yaml").write_text(dump_config(get_soil("thesis_a1")))
        known = [{"angle": (0.045, 0.055)}] if "slope" in answer.verdict else []
        effects = load_effects(["slope=0.05"]) if known else ()
        save_effects(folder / "effects.yaml", effects, intervals=known, source="a test")
        return folder

    return make


@pytest.fixture
def few_turns(monkeypatch):
    """Adaptations of a few turns."""
    little = {"rounds": 1, "taught": 2, "stages": ((2, 1),), "selection": 2}
    whole = run.Effort
    monkeypatch.setattr(run, "Effort", lambda report=2: whole(**little, report=report))


def test_a_diagnosis_is_read_with_its_intervals(diagnosis):
    found = corrected_by_diagnosis(diagnosis())
    assert [item.name for item in found.effects] == ["slope"]
    assert found.intervals == ({"angle": (0.045, 0.055)},)
    assert found.verdict == ("slope",)
    assert corrected_by_diagnosis(diagnosis() / "diagnosis.json").effects == found.effects


def test_what_has_no_name_is_refused(diagnosis):
    folder = diagnosis(verdict=("unknown",), findings=(), complete=False)
    with pytest.raises(InputError, match=r"verdict: unknown.*--anyway"):
        ddagr_gym.adapt(diagnosis=folder)


@pytest.mark.parametrize(
    ("given", "known"),
    [
        ({}, ("husky", "lete_sand_wong")),
        ({"robot": "warthog"}, ("warthog", "lete_sand_wong")),
        ({"soil": "firm_ground"}, ("husky", "firm_ground")),
    ],
)
def test_a_controller_knew_what_drives_were_diagnosed_with(diagnosis, monkeypatch, given, known):
    seen = []
    monkeypatch.setattr("ddagr_gym.api.adapt._check_same_robot", lambda found, nominal: None)
    monkeypatch.setattr(run, "adapted", lambda usable, *nominal, **_: seen.extend(nominal[:2]))
    ddagr_gym.adapt(diagnosis=diagnosis(robot="husky", soil="lete_sand_wong"), **given)
    assert (seen[0].name, seen[1]) == (known[0], get_soil(known[1]))


def test_a_diagnosis_of_another_robot_is_refused(diagnosis):
    with pytest.raises(InputError, match="of the robot 'ddagr' and the controller knew 'husky'"):
        ddagr_gym.adapt(robot="husky", diagnosis=diagnosis())


def test_an_incomplete_diagnosis_is_warned_of(diagnosis, few_turns, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    with pytest.warns(InputWarning, match="not complete"):
        result = ddagr_gym.adapt(diagnosis=diagnosis(complete=False), turns=2, cache="~/steps")
    assert "not complete" in str(result)
    assert len(list((tmp_path / "steps").iterdir())) == 1  # the journal of turns


@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        ({}, "nothing to adapt to"),
        ({"recordings": ["a.csv"], "diagnosis": "d"}, "leave out one"),
        ({"diagnosis": "d", "ground": "sand"}, "no calibration"),
        ({"calibration": "cal", "robot": "husky"}, "a calibration and robot are given: leave out one of them, cal has"),
        ({"calibration": "cal", "soil": "firm_ground"}, "a calibration and soil are given"),
        ({"diagnosis": "absent"}, "cannot be read as a diagnosis"),
        ({"diagnosis": "d", "turns": 1}, "turns is 1"),
    ],
)
def test_bad_sources_are_one_sentence(given, complaint):
    with pytest.raises(InputError, match=complaint):
        ddagr_gym.adapt(**given)


def test_a_comparison_is_told_apart_from_a_diagnosis(diagnosis, monkeypatch):
    answer = replace(ANSWER, change=SimpleNamespace())
    monkeypatch.setattr("ddagr_gym.diagnosis.result.files.load", lambda _: answer)
    with pytest.raises(InputError, match=r"compares with ordinary drives.*give the recordings themselves"):
        ddagr_gym.adapt(diagnosis=diagnosis())


def test_a_diagnosis_without_a_simulator_is_refused(diagnosis):
    folder = diagnosis()
    (folder / "robot.yaml").unlink()
    with pytest.raises(InputError, match=r"holds no robot\.yaml"):
        ddagr_gym.adapt(diagnosis=folder)


def test_the_command_writes_a_bundle_that_drives(diagnosis, few_turns, tmp_path, capsys):
    words = ["adapt", "--diagnosis", str(diagnosis()), "--turns", "2", "--output", str(tmp_path / "adapted")]
    assert cli.main(words) == 0
    printed = capsys.readouterr().out
    assert "In the corrected simulator the median radius error goes from" in printed
    folder = tmp_path / "adapted"
    written = {path.name for path in folder.iterdir() if not path.name.startswith(".")}
    files = {"controller.yaml", "robot.yaml", "soil.yaml", "effects.yaml"}
    assert written == files | {"adaptation.json", "index.html"}
    answer = json.loads((folder / "adaptation.json").read_text())
    assert answer["effects"][0]["name"] == "slope"
    page = (folder / "index.html").read_text()
    assert page.count("<img") == 2
    assert "Sloping ground" in page
    assert not list(tmp_path.glob(".adapted*"))  # nothing of the work is left
    assert find_controller(str(folder), ddagr_gym.envs.TurnSettings().turn(0.8, "left", 0.2)) is not None
    assert cli.main(words) == 2  # an earlier output is not replaced


def test_one_of_several_grounds_is_named(monkeypatch, tmp_path):
    """The filter's prior and the turns are of the ground that the turns are driven on."""
    monkeypatch.setattr("ddagr_gym.calibration.files.load", lambda folder: SimpleNamespace(grounds=("sand", "yard")))
    with pytest.raises(InputError, match="calibrated on sand, yard: name one of them with --ground"):
        ddagr_gym.adapt(calibration=tmp_path)


def test_turns_on_a_calibrated_ground_are_on_its_slope(monkeypatch, tmp_path):
    slopes = (
        SimpleNamespace(ground="yard", gradient=(0.0, 0.04)),
        SimpleNamespace(ground="sand", gradient=(0.03, 0.0)),
    )
    known = SimpleNamespace(grounds=("sand", "yard"), slopes=slopes)
    draws = SimpleNamespace(robot=ddagr())
    monkeypatch.setattr("ddagr_gym.calibration.files.load", lambda folder: known)
    monkeypatch.setattr("ddagr_gym.envs.calibrated_draws.load_draws", lambda folder, ground: draws)
    (tmp_path / "soil_sand.yaml").write_text(dump_config(get_soil("thesis_a1")))
    save_effects(tmp_path / "effects.yaml", (), source="a calibration")
    found = corrected_by_calibration(tmp_path, "sand")
    (slope,) = found.effects
    assert slope == Slope.of_gradient(0.03, 0.0)
    assert found.soil == get_soil("thesis_a1")
