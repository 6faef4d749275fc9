"""``ddagr isolability``: files, text, figure."""

import json
from dataclasses import replace

import pytest

from ddagr_gym.api.nominal import planned_nominal, thresholds_from
from ddagr_gym.cli import main, warnings_as_lines
from ddagr_gym.diagnosis.gates.threshold_files import default_thresholds, save_thresholds
from ddagr_gym.diagnosis.planning.isolability import Detectable, Isolability, isolability
from ddagr_gym.errors import InputError
from ddagr_gym.identification.nuisances import NuisancePriors
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.reporting.isolability_figure import isolability_figure
from ddagr_gym.reporting.isolability_text import table_text


@pytest.fixture
def drive_csv(tmp_path):
    path = tmp_path / "short.csv"
    path.write_text("t,command_right,command_left\n0,0.8,0.8\n2,0.8,-0.8\n4,0.8,0.8\n")
    return path


def test_writes_table_json_and_figure(tmp_path, capsys, monkeypatch, drive_csv):
    from ddagr_gym.physics.effects import registry

    few = {name: registry.effect_kinds()[name] for name in ("slope", "gyro_scale", "imu_tilt")}
    monkeypatch.setattr("ddagr_gym.diagnosis.search.scan.absolute_effect_kinds", lambda frames_apart: few)
    folder = tmp_path / "out"
    arguments = ["isolability", "--manoeuvres", str(drive_csv), "--sensors", "imu", "encoders"]
    assert main([*arguments, "--output", str(folder)]) == 0
    mapping = json.loads((folder / "isolability.json").read_text())
    assert mapping["schema"] == "ddagr-isolability/1"
    assert set(mapping["effects"]) == {"slope", "gyro_scale", "imu_tilt"}
    text = (folder / "isolability.txt").read_text()
    bank = default_thresholds("ddagr")
    gates = f"null bank {bank.bank} of {bank.nulls} drives"
    assert f"ddagr on thesis_a1: short (6 s) with imu, encoders; gates: {gates}" in text
    assert text.strip() in capsys.readouterr().out
    assert (folder / "isolability.png").stat().st_size > 10_000
    # a second run does not overwrite unasked
    assert main([*arguments, "--output", str(folder)]) == 2
    assert "--overwrite" in capsys.readouterr().err


def test_without_output_the_table_is_printed_and_nothing_written(tmp_path, capsys, monkeypatch, drive_csv):
    from ddagr_gym.physics.effects import registry

    few = {name: registry.effect_kinds()[name] for name in ("slope", "gyro_scale")}
    monkeypatch.setattr("ddagr_gym.diagnosis.search.scan.absolute_effect_kinds", lambda frames_apart: few)
    monkeypatch.chdir(tmp_path)
    assert main(["isolability", "--manoeuvres", str(drive_csv), "--sensors", "imu", "encoders"]) == 0
    said = capsys.readouterr().out
    assert "least detectable" in said
    assert "gyro_scale" in said
    assert "figure" not in said
    assert list(tmp_path.iterdir()) == [drive_csv]


@warnings_as_lines()
def test_soil_that_is_not_named_is_that_of_the_robots_thresholds_and_said(capsys):
    nominal, uncertainty = planned_nominal("ddagr", None, None, None)
    assert (nominal.soil_name, uncertainty, capsys.readouterr().err) == ("thesis_a1", 1.0, "")
    nominal, uncertainty = planned_nominal("warthog", None, None, None)
    assert (nominal.soil_name, uncertainty) == ("firm_ground", 4.0)
    assert "no soil is given: the warthog is taken to be on firm_ground" in capsys.readouterr().err
    nominal, uncertainty = planned_nominal("warthog", "lete_sand_wong", None, None)
    assert (nominal.soil_name, uncertainty, capsys.readouterr().err) == ("lete_sand_wong", 1.0, "")


@pytest.mark.parametrize(
    ("words", "soil", "uncertainty", "said"),
    [((), "firm_ground", 4.0, "(4 times as uncertain as usual)"), (("--soil", "firm_ground"), "firm_ground", 1.0, ":")],
)
def test_the_table_is_of_that_soil_as_uncertain_as_it_is(monkeypatch, capsys, tmp_path, words, soil, uncertainty, said):
    asked = {}

    def tabulated(robot, soil, *_, soil_name, soil_uncertainty, **__):
        asked.update(soil=soil, soil_name=soil_name)
        return replace(table(), robot=robot.name, soil=soil_name, soil_uncertainty=soil_uncertainty)

    monkeypatch.setattr("ddagr_gym.diagnosis.planning.isolability.isolability", tabulated)
    assert main(["isolability", "--robot", "warthog", *words, "--output", str(tmp_path / "out")]) == 0
    assert asked == {"soil": get_soil(soil), "soil_name": soil}
    assert f"warthog on {soil} {said}".replace(" :", ":") in capsys.readouterr().out
    assert json.loads((tmp_path / "out" / "isolability.json").read_text())["soil_uncertainty"] == uncertainty


def test_the_uncertainty_is_that_of_the_diagnosis_that_is_planned(monkeypatch):
    asked = []

    def plan(*_, setting, **__):
        asked.append(setting.priors)
        raise InputError("asked")

    monkeypatch.setattr("ddagr_gym.diagnosis.planning.isolability.plan", plan)
    for uncertainty in (1.0, 4.0):
        with pytest.raises(InputError, match="asked"):
            isolability(get_robot("warthog"), get_soil("firm_ground"), (), (), soil_uncertainty=uncertainty)
    assert asked == [NuisancePriors(), NuisancePriors().with_soil(4.0)]


def test_negative_seed_is_one_sentence(tmp_path, capsys):
    assert main(["isolability", "--seed", "-1", "--output", str(tmp_path / "out")]) == 2
    assert "seed is -1: give at least 0." in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_gates_ship_with_the_robot_or_come_from_chance(tmp_path):
    assert thresholds_from(None, get_robot("ddagr"), "thesis_a1") == default_thresholds("ddagr")
    assert thresholds_from(None, get_robot("husky"), "thesis_a1") is None
    given = replace(default_thresholds("ddagr"), bank="given")
    save_thresholds(given, tmp_path / "gates.json")
    assert thresholds_from(tmp_path / "gates.json", get_robot("ddagr"), "thesis_a1") == given


@warnings_as_lines()
def test_gates_of_another_soil_are_warned_of(capsys):
    thresholds_from(None, get_robot("ddagr"), "thesis_a1")
    assert capsys.readouterr().err == ""
    thresholds_from(None, get_robot("ddagr"), "loose_sand")
    assert "the thresholds were made for soil thesis_a1 instead of loose_sand" in capsys.readouterr().err


def test_unknown_manoeuvre_is_one_sentence(tmp_path, capsys):
    assert main(["isolability", "--manoeuvres", "strait", "--output", str(tmp_path / "out")]) == 2
    assert "straight" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def table() -> Isolability:
    inf = float("inf")
    sizes = (
        Detectable("slope", "angle", "rad", 0.0087, 0.002, 0.23),
        Detectable("imu_tilt", "roll", "rad", 0.0087, 0.003, 0.34),
        Detectable("gyro_scale", "scale", "-", 0.02, inf, inf),
    )
    share = ((float("nan"), 0.013, 1.0), (0.02, float("nan"), 1.0), (float("nan"), float("nan"), float("nan")))
    apart = ((inf, 4.0, 0.23), (5.0, inf, 0.34), (inf, inf, inf))
    names = ("slope", "imu_tilt", "gyro_scale")
    return Isolability("ddagr", "a", ("straight",), 20.0, ("imu",), "chi-square", names, sizes, share, apart)


def test_text_names_rivals_and_what_is_not_seen():
    lines = table_text(table()).splitlines()
    assert lines[4].split()[:3] == ["slope", "angle", "0.002"]
    assert "imu_tilt (0.01)" in lines[4]
    assert "not seen" in lines[6]


def test_figure_shows_effects_that_cannot_be_seen(tmp_path):
    png, svg = isolability_figure(table().as_mapping(), tmp_path / "figure.png")
    assert png.stat().st_size > 10_000
    assert svg.is_file()
