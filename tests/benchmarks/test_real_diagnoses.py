"""What is kept of the diagnoses of real drives, and a run that goes on."""

import json
from dataclasses import replace
from types import SimpleNamespace

import pytest

from benchmarks import real_diagnoses
from benchmarks.real_diagnoses import diagnosed, draw, entry, learned, main
from ddagr_gym.diagnosis.result.files import save
from tests.reporting.made_diagnosis import diagnosis
from tests.reporting.test_drivetrain_section import ANSWER, DELAY

pytest.importorskip("matplotlib", reason="needs the extra report")

NAMES = ("open/warthog_asphalt", "open/warthog_sand")
CEILING = {"heading after 5 s": 1.0, "wheel speed": 0.3, "position after 1 s": 0.2}
ASKED = replace(diagnosis(), drivetrain=ANSWER, findings=(DELAY,), verdict=(DELAY.name,))


def test_errors_are_those_of_all_stretches_together():
    kept = entry(ASKED, CEILING)
    assert kept["verdict"] == ("command_delay",)
    assert kept["sizes"]["command_delay command_delay"]["value"] == 0.24
    assert kept["errors"]["heading after 5 s"] == {
        "unit": "rad",
        "nominal": 3.25,
        "corrected": 1.21,
        "kinematic": 1.27,
        "learned": 1.0,
    }
    assert kept["share_of_learned"]["heading after 5 s"] == pytest.approx((3.25 - 1.21) / (3.25 - 1.0))
    assert kept["parts"]["command_delay"]["kept"]


def test_a_share_of_hardly_anything_means_nothing():
    assert entry(ASKED, {**CEILING, "wheel speed": 1e9})["share_of_learned"]["wheel speed"] is None


def test_without_a_drivetrain_there_are_no_errors_to_draw(tmp_path):
    assert "errors" not in entry(diagnosis(), {})
    draw({NAMES[0]: entry(diagnosis(), {})}, tmp_path / "empty.png")
    assert (tmp_path / "empty.png").stat().st_size > 0


def test_a_drive_whose_page_is_there_is_not_diagnosed_again(tmp_path, monkeypatch):
    asked: list[str] = []

    def diagnose(path, **options):
        asked.append(path.name)
        assert options["soil"] == {"warthog_asphalt": "firm_ground", "warthog_sand": "lete_sand_wong"}[path.name[:-7]]

        def report(folder):
            folder.mkdir()
            save(ASKED, folder / "diagnosis.json")

        return SimpleNamespace(report=report)

    monkeypatch.setattr(real_diagnoses, "diagnose", diagnose)
    monkeypatch.setattr(real_diagnoses, "_learned", lambda name: CEILING)
    assert diagnosed(NAMES[0], tmp_path, 1).verdict == ("command_delay",)
    assert learned(NAMES[0], tmp_path) == CEILING
    monkeypatch.setattr(real_diagnoses, "_learned", lambda name: {**CEILING, "wheel speed": 9.0})
    assert learned(NAMES[0], tmp_path) == CEILING
    main([str(tmp_path), "--drives", *NAMES, "--output", str(tmp_path / "results")])
    assert asked == ["warthog_asphalt.csv.gz", "warthog_sand.csv.gz"]
    written = json.loads((tmp_path / "results" / "real_diagnoses.json").read_text())
    assert list(written) == list(NAMES)
    assert (tmp_path / "results" / "real_diagnoses.png").is_file()
