"""``ddagr_gym.diagnose``: a slope found in tables, its files, an interruption, and what is refused.

The command's tests cover certification, page and exit codes.
"""

from __future__ import annotations

import json
import math
import shutil
from dataclasses import replace
from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest

import ddagr_gym
from ddagr_gym.api.change import ChangeResult
from ddagr_gym.api.diagnosis_result import DiagnosisResult
from ddagr_gym.diagnosis.answer.next_drive_plan import NextDrivePlan
from ddagr_gym.diagnosis.result.files import load
from ddagr_gym.errors import InputError, InputWarning
from ddagr_gym.exporting.corrected import GIVEN
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.physics.effects import load_effects
from ddagr_gym.presets import get_robot, get_soil
from tests.viewers.reading import read

pytest.importorskip("ruptures")
pytest.importorskip("pandas")

ANGLE = 0.06  # [rad]


@pytest.fixture(scope="module")
def tables():
    """Two drives on a slope as tables without the truth."""
    drives = [
        ddagr_gym.simulate(name, effects=f"slope={ANGLE}", rate=25.0, pose_rate=5.0, seed=seed).to_pandas()
        for seed, name in enumerate(("arcs", "s_weave"))
    ]
    return [table.filter(regex="^(?!true_)") for table in drives]


class Interrupted:
    """Progress that is interrupted when a step begins."""

    def __init__(self, at: str) -> None:
        self.at = at
        self.lines: list[str] = []

    def __call__(self, line: str) -> None:
        self.lines.append(line)
        if self.at in line:
            raise KeyboardInterrupt


@pytest.fixture(scope="module")
def gone_on(tables, tmp_path_factory):
    """Lines of an interrupted diagnosis, those of its continuation, and the result."""
    cache = tmp_path_factory.mktemp("steps") / "cache"
    first, second = Interrupted("verdict"), Interrupted("never")
    with pytest.raises(KeyboardInterrupt):
        ddagr_gym.diagnose(tables, names_only=True, cache=cache, progress=first)
    result = ddagr_gym.diagnose(tables, names_only=True, cache=cache, progress=second)
    return first.lines, second.lines, result


@pytest.fixture(scope="module")
def found(gone_on):
    return gone_on[2]


def test_an_interrupted_diagnosis_goes_on_from_its_cache(gone_on):
    first, second, _ = gone_on
    assert "step 2 of 5, search" in first
    assert any("scanning the library" in line for line in first)
    assert {"step 1 of 5, checks, kept from before", "step 2 of 5, search, kept from before"} <= set(second)
    assert not any("scanning the library" in line for line in second)
    assert second[-1].startswith("diagnosing: 100 %")


def test_the_slope_is_named_with_its_size(found):
    assert found.verdict == ("slope",)
    assert found.complete
    angle = found.findings[0].parameters["angle"]
    assert abs(float(angle) - ANGLE) < 0.005
    assert angle.unit == "rad"
    low, high = angle.interval
    assert low <= ANGLE <= high
    assert str(angle).startswith("0.0")
    assert str(angle).endswith(f" rad ({low:.3g} to {high:.3g})")


def test_effects_robot_and_soil_go_into_the_simulator_and_the_environment(found):
    (slope,) = found.effects
    assert slope.as_mapping()["parameters"]["angle"] == float(found.findings[0].parameters["angle"])
    assert (found.refit_note, found.robot.name) == ("", "ddagr")
    drive = ddagr_gym.simulate("straight", found.robot, found.soil, found.effects, rate=25.0)
    level = ddagr_gym.simulate("straight", found.robot, found.soil, rate=25.0)
    assert abs(drive.truth["x"][-1] - level.truth["x"][-1]) > 0.01
    environment = gymnasium.make("DDAGR-Turn-v0", effects=found.effects, soil=found.soil)
    environment.reset(seed=0)
    environment.close()


def test_a_refit_that_leaves_what_exists_has_a_reason(found):
    outcome = found.outcome
    nowhere = replace(outcome.diagnosis, nuisances={**outcome.diagnosis.nuisances, "sinkage_exponent": 9.0})
    result = ddagr_gym.DiagnosisResult(replace(outcome, diagnosis=nowhere))
    assert (result.robot, result.soil) == (None, None)
    assert "the refitted values are no soil" in result.refit_note


def test_files_are_those_of_the_command_without_a_page(found, tmp_path):
    assert found.report(tmp_path / "found") == tmp_path / "found"
    names = {path.name for path in (tmp_path / "found").iterdir()} - {".ddagr-output"}
    assert names == {"diagnosis.json", "evidence.npz", "effects.json", "effects.yaml", "robot.yaml", "soil.yaml"}
    assert load_effects(tmp_path / "found" / "effects.yaml") == found.effects
    assert get_soil(str(tmp_path / "found" / "soil.yaml")) == found.soil
    found.to_json(tmp_path / "one.json")
    assert load(tmp_path / "one.json") == load(tmp_path / "found" / "diagnosis.json")
    assert json.loads((tmp_path / "one.json").read_text())["soil"] == "thesis_a1"
    with pytest.raises(InputError, match="overwrite=True"):
        found.report(tmp_path / "found")


@pytest.fixture(scope="module")
def saved(found, tmp_path_factory):
    """Folder of the diagnosis, saved."""
    return found.report(tmp_path_factory.mktemp("saved") / "found")


def test_an_export_has_ranges_of_all_that_was_refitted(found, saved):
    spread = found.diagnosis.nuisance_spread
    exported = ddagr_gym.export(saved, "randomisation", draws=100)
    mass, inertia, track = (exported.ranges[name] for name in ("mass", "yaw_inertia", "effective_track"))
    ends = [found.nominal[0].mass * math.exp(value) for value in spread.intervals["mass"]]
    assert (mass.low, mass.high) == (pytest.approx(ends[0], rel=0.015), pytest.approx(ends[1], rel=0.015))
    assert mass.low < mass.value < mass.high
    assert mass.value == pytest.approx(found.robot.mass)
    assert {item.distribution for item in (mass, inertia, track)} == {"normal"}
    assert mass.source.endswith(
        "range: the 90 % intervals of the effects that were named and of its refitted robot and soil"
    )
    assert "- What was refitted of single recordings and not of robot or soil: biases" in str(exported)
    assert "does not say it" not in str(exported)


def test_an_export_draws_soils_together_as_they_were_refitted(saved, tmp_path):
    together = ddagr_gym.export(saved, "randomisation", draws=60).ranges["force_along"]
    shutil.copytree(saved, tmp_path / "apart")
    content = json.loads((saved / "diagnosis.json").read_text())
    content["nuisance_spread"]["correlation"] = np.eye(len(content["nuisance_spread"]["shared"])).tolist()
    (tmp_path / "apart" / "diagnosis.json").write_text(json.dumps(content))
    apart = ddagr_gym.export(tmp_path / "apart", "randomisation", draws=60).ranges["force_along"]
    assert together.high - together.low < 0.5 * (apart.high - apart.low)


def test_an_export_of_an_answer_of_before_says_what_is_fixed(saved, tmp_path):
    shutil.copytree(saved, tmp_path / "before")
    content = json.loads((saved / "diagnosis.json").read_text())
    del content["nuisance_spread"]
    (tmp_path / "before" / "diagnosis.json").write_text(json.dumps(content))
    exported = ddagr_gym.export(tmp_path / "before", "gazebo", draws=3)
    assert exported.ranges["mass"].distribution == "fixed"
    assert "- How sure robot and soil are: this diagnosis does not say it" in str(exported)


def test_what_an_option_gives_is_fixed_in_the_export(saved):
    exported = ddagr_gym.export(saved, "gazebo", robot="ddagr", draws=3)
    assert exported.ranges["mass"].distribution == "fixed"
    assert exported.ranges["force_along"].distribution == "normal"
    assert exported.outcome.corrected.spread.endswith("and of its refitted soil")
    assert "- How sure the given robot may be: what an option gives is fixed" in str(exported)
    both = ddagr_gym.export(saved, "gazebo", robot="ddagr", soil="thesis_a1", draws=3)
    assert both.ranges["yaw_inertia"].distribution == "fixed"
    assert both.outcome.corrected.fixed == (GIVEN.format("robot and soil"),)


def test_the_drives_are_written_for_viewers(found, tmp_path):
    pytest.importorskip("foxglove", reason="needs the extra foxglove")
    assert found.to_mcap(tmp_path / "drives.mcap") == tmp_path / "drives.mcap"
    drives = read(tmp_path / "drives.mcap")
    evidence = found.outcome.evidence
    for name, model in (("nominal", "raw"), ("refitted", "nominal"), ("corrected", "corrected")):
        values = drives.column(f"/residual/{name}", "specific_force_x")[:, 2]
        shown = evidence.standardised(model)[..., CHANNELS.index("specific_force_x")]
        assert np.mean(values**2) == pytest.approx(np.nanmean(shown**2), rel=1e-4)
    events = [item for _, item in drives.messages["/findings/events"]]
    spans = found.findings[0].where.spans
    assert len(events) == len(spans)
    assert {pair.value for pair in events[0].metadata if pair.key == "finding"} == {"slope"}


def test_the_drives_are_written_for_rerun(found, tmp_path):
    chunks = pytest.importorskip("rerun.chunk", reason="needs the extra rerun")
    reader = chunks.RrdReader(found.to_rrd(tmp_path / "drives.rrd"))
    entities = {chunk.entity_path for chunk in reader.stream()}
    assert {"/readings/yaw_rate/corrected", "/residual/yaw_rate/nominal", "/findings/shows/slope"} <= entities


def test_text_and_notebook_have_sentence_and_sizes(found, page_text):
    assert repr(found) == f"<DiagnosisResult: {found.sentence}>"
    assert str(found).startswith(found.sentence)
    for text in (str(found), page_text(found)):
        assert found.sentence in text
        assert "slope angle" in text


def test_an_answer_knows_its_simulator_for_the_next_drive(found, monkeypatch):
    planned = []

    def plan(robot, soil, rivals, **rest):
        planned.append((robot, soil, [rival.name for rival in rivals]))
        return NextDrivePlan.none("Nothing helps.")

    monkeypatch.setattr("ddagr_gym.diagnosis.planning.next_drive.next_drive", plan)
    own = replace(get_soil("thesis_a1"), cohesion=4000.0)
    session = replace(found.outcome.session, soil=own)
    result = ddagr_gym.next_drive(ddagr_gym.DiagnosisResult(replace(found.outcome, session=session)))
    assert (result.headline, result.manoeuvre) == ("Nothing helps.", "")
    assert planned[0][:2] == (get_robot("ddagr"), own)
    assert "slope" in planned[0][2]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"threads": 0}, "threads is 0: give at least 1"),
        ({"window": 0.5}, "window is 0.5: give at least 1"),
        ({"robot": "husky", "soil": "mud"}, "unknown soil 'mud'"),
        ({"thresholds": "missing.json"}, "missing.json cannot be read as thresholds"),
    ],
)
def test_bad_options_are_one_sentence(tables, options, message):
    with pytest.raises(InputError, match=message):
        ddagr_gym.diagnose(tables, names_only=True, **options)


@pytest.mark.parametrize("missing", ["t", "command_right"])
def test_a_missing_column_is_named(tables, missing):
    with pytest.raises(InputError, match=missing):
        ddagr_gym.diagnose([table.drop(columns=missing) for table in tables], names_only=True)


def test_a_cache_of_something_else_is_left_alone(tables, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="holds files of something else"):
        ddagr_gym.diagnose(tables, names_only=True, cache=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_a_cache_that_nothing_would_be_kept_in_is_refused(tables, tmp_path):
    with pytest.raises(InputError, match="is given with a calibration or drives from before: leave it out"):
        ddagr_gym.diagnose(tables, calibration=tmp_path / "calibration", cache=tmp_path / "cache")


def test_windows_unlike_those_of_the_thresholds_are_warned_of(tables):
    with pytest.warns(InputWarning, match="windows of 6 s instead of 3 s"), pytest.raises(InputError, match="overlap"):
        ddagr_gym.diagnose(tables, names_only=True, window=3.0, stride=1.0)


def test_drives_given_twice_are_refused(tables):
    with pytest.raises(InputError, match="the same values"):
        ddagr_gym.diagnose([tables[0], tables[0]], names_only=True)
    assert np.isfinite(tables[0]["t"]).all()


@pytest.fixture
def ascii_locale(monkeypatch):
    """Texts that are written without an encoding are written as on a machine that knows ASCII only."""
    monkeypatch.setattr("io.text_encoding", lambda encoding, level=2: encoding or "ascii")


def test_refitted_robots_are_utf_8_on_any_machine(ascii_locale, tmp_path):
    robot, soil = replace(get_robot("ddagr"), name="r\u00e4um"), get_soil("thesis_a1")
    answer = SimpleNamespace(robot=robot, soil=soil, sentence="M\u00fcll.", with_page=False, nominal=(robot, soil))
    answer._save_effects = answer.to_json = lambda path: None
    DiagnosisResult._save_refitted(answer, tmp_path)
    assert get_robot(str(tmp_path / "robot.yaml")) == robot
    (tmp_path / "robot.yaml").unlink()
    ChangeResult._fill(answer, tmp_path, None)
    assert get_robot(str(tmp_path / "robot.yaml")) == robot
