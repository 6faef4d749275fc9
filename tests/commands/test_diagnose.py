"""`ddagr diagnose` from files to a folder: what it names, writes, refuses, and where it goes on after a stop."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from ddagr_gym import extras
from ddagr_gym.api.replay import ReplayResult
from ddagr_gym.cli import main
from ddagr_gym.diagnosis import pipeline
from ddagr_gym.diagnosis.answer.verdict import DataDoubt, Diagnosis, GatesUsed
from ddagr_gym.diagnosis.gates.threshold_files import save_thresholds
from ddagr_gym.diagnosis.gates.thresholds import Gate, Thresholds
from ddagr_gym.diagnosis.result.files import as_mapping, load
from ddagr_gym.diagnosis.store import part_folder
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.parameters import Imu, PoseReceiver, Sensors
from ddagr_gym.physics.effects import load_effects
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.recordings.storage import save_parquet
from ddagr_gym.replay_analysis.report import REFITTED
from ddagr_gym.reporting.diagnosis_text import outcome_text
from ddagr_gym.simulator import simulate
from tests.viewers.reading import read

NO_GATES = GatesUsed(nulls=0, bank="", level=0.05)
RATE = 50.0
STEPS = [(0.7, 0.7), (0.9, 0.4), (0.0, 0.0), (0.4, 0.9), (-0.5, 0.5), (1.0, 1.0)]


@pytest.fixture(scope="session")
def work(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two drives of 24 s on ground that slopes, and thresholds that let only large gains pass.

    The soil is not the nominal one: its pressures are 8 % less and its shear length 10 % more.
    """
    folder = tmp_path_factory.mktemp("diagnose")
    robot, nominal = get_robot("ddagr"), get_soil("thesis_a1")
    softer = replace(
        nominal,
        cohesive_modulus=0.92 * nominal.cohesive_modulus,
        frictional_modulus=0.92 * nominal.frictional_modulus,
        shear_modulus=1.1 * nominal.shear_modulus,
    )
    (folder / "drives").mkdir()
    for number, order in enumerate((1, -1)):
        commands = np.concatenate([np.tile(step[::order], (200, 1)) for step in STEPS])
        sensors = Sensors(Imu(sample_rate=RATE), pose=PoseReceiver(5.0))
        slope = "slope=0.06,direction=0.8"
        columns = simulate(robot, softer, commands, sensors=sensors, effects=slope, seed=number)
        made = Recording.from_columns(columns, robot, source=f"run_{number + 1}")
        save_parquet(made, folder / "drives" / f"run_{number + 1}.parquet")
    gates = Thresholds({"slope": Gate(30.0, 0.0)}, dict.fromkeys(CHANNELS, 2.0), 20, "0" * 64)
    save_thresholds(gates, folder / "thresholds.json")
    return folder


def words(work: Path, output: str = "found", *runs: str) -> list[str]:
    names = [str(work / run) for run in runs or ("drives",)]
    return ["diagnose", *names, "--thresholds", str(work / "thresholds.json"), "--output", str(work / output)]


@pytest.fixture(scope="session")
def found(work: Path) -> Path:
    """The folder that the command writes for them."""
    viewers = ["--mcap", str(work / "drives.mcap")] if find_spec("foxglove") else []
    assert main([*words(work), *viewers]) == 0
    return work / "found"


def test_the_drives_are_written_beside_for_viewers(found: Path, work: Path) -> None:
    pytest.importorskip("foxglove", reason="needs the extra foxglove")
    drives = read(work / "drives.mcap")
    assert drives.metadata["verdict"] == "slope"
    assert "run_2" in drives.metadata["recording 2"]
    assert json.loads((work / "drives.layout.json").read_text())["content"]


@pytest.mark.parametrize(
    ("option", "name", "said"),
    [
        ("--mcap", "drives.bag", "give a name that ends in .mcap"),
        ("--rrd", "drives.mcap", "give a name that ends in .rrd"),
    ],
)
def test_files_that_no_viewer_opens_are_refused_first(
    work: Path, option: str, name: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip({"--mcap": "foxglove", "--rrd": "rerun"}[option], reason="needs the extra")
    assert main([*words(work, "nothing"), option, str(work / name)]) == 2
    told = capsys.readouterr()
    assert said in told.err
    assert "step 1" not in told.err
    assert not (work / "nothing").exists()


def test_a_file_inside_the_output_folder_is_refused_first(work: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("foxglove", reason="needs the extra foxglove")
    assert main([*words(work, "nothing"), "--mcap", str(work / "nothing" / "drives.mcap")]) == 2
    assert "which is written as a whole: choose a place beside it" in capsys.readouterr().err
    assert not (work / "nothing").exists()


@pytest.mark.parametrize(("option", "package"), [("--mcap", "foxglove-sdk"), ("--rrd", "rerun-sdk")])
def test_an_absent_package_is_named_first(
    work: Path, option: str, package: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(extras, "find_spec", lambda name: None if name in ("foxglove", "rerun") else object())
    assert main([*words(work, "nothing"), option, str(work / f"drives.{option[2:]}")]) == 2
    told = capsys.readouterr()
    assert f"'{package}', which is not installed" in told.err
    assert "step 1" not in told.err


def test_refitted_robot_and_soil_are_nearer_to_the_true_ones(found: Path) -> None:
    """The pressures of the true soil are 8 % less than the nominal ones."""
    robot, soil = get_robot(str(found / "robot.yaml")), get_soil(str(found / "soil.yaml"))
    assert robot.name == "ddagr"
    nominal = get_soil("thesis_a1").pressure(0.01, 0.1)
    assert abs(soil.pressure(0.01, 0.1) / nominal - 0.92) < 0.08


def test_the_refitted_robot_and_soil_diagnose_and_plan(
    found: Path, work: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Parquet of the same robot, its file and the answer fit together; nothing is left to find in the soil."""
    files = ["--robot", str(found / "robot.yaml"), "--soil", str(found / "soil.yaml")]
    assert main([*words(work, "again"), "--names-only", *files]) == 0
    told = capsys.readouterr()
    assert "The ground slopes" in told.out
    assert "ddagr diagnose:   scanning the library" in told.err
    diagnosis = load(work / "again" / "diagnosis.json")
    assert diagnosis.options.robot_file == str((found / "robot.yaml").resolve())
    assert diagnosis.soil == str((found / "soil.yaml").resolve())


def test_the_slope_is_named_and_certified(found: Path) -> None:
    diagnosis = load(found / "diagnosis.json")
    assert diagnosis.verdict == ("slope",)
    estimate = diagnosis.findings[0].parameters["angle"]
    assert estimate.value == pytest.approx(0.06, abs=0.005)
    fit = diagnosis.fit
    assert fit is not None
    position = fit.channels["position"]["5"]
    assert position.corrected.value < 0.5 * position.refitted.value
    share = fit.gain_share["5"]
    assert share is not None
    assert share.value > 0.7
    assert [source.source for source in diagnosis.data] == ["run_1.parquet", "run_2.parquet"]
    assert diagnosis.findings[0].where is not None
    assert diagnosis.next_drive is not None
    assert diagnosis.next_drive.why
    assert set(diagnosis.detectable_alone) == set(diagnosis.detectable)
    assert diagnosis.detectable_alone["slope"] == diagnosis.detectable["slope"]


def test_the_folder_is_complete(found: Path) -> None:
    names = {path.relative_to(found).as_posix() for path in found.rglob("*") if path.is_file()}
    assert {"index.html", "diagnosis.json", "effects.json", "effects.yaml", "evidence.npz"} <= names
    assert {"robot.yaml", "soil.yaml"} <= names
    assert any(name.endswith(".png") for name in names)
    assert "Sloping ground" in (found / "index.html").read_text()
    assert not part_folder(found).exists()


def test_both_effects_files_hold_what_the_diagnosis_says(found: Path) -> None:
    named = load(found / "diagnosis.json").findings[0].parameters
    for name in ("effects.json", "effects.yaml"):
        (effect,) = load_effects(found / name)
        assert effect.as_mapping()["parameters"] == {key: item.value for key, item in named.items()}


def test_the_loop_closes(found: Path, work: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Replayed and refitted with the effects file, the drives' errors fall as the diagnosis certified.

    A replay compares with the last pose alone, whose noise of 13 mm along each axis the certification averages.
    """
    # the replay's tests look at its page
    monkeypatch.setattr(ReplayResult, "_fill", lambda result, folder, _: result.to_json(folder / "replay.json"))
    output = work / "replayed"
    runs = [str(path) for path in sorted((work / "drives").iterdir())]
    options = ["--soil", "thesis_a1", "--robot", "ddagr", "--refit", "--together", "--output"]
    effects = ["--effects", str(found / "effects.yaml")]
    assert main(["replay", *runs, *options, str(output)]) == 0
    assert main(["replay", *runs, *options, str(output) + "_with", *effects]) == 0
    errors = [_replayed(Path(path)) for path in (str(output), str(output) + "_with")]
    fit = load(found / "diagnosis.json").fit
    assert fit is not None
    certified = fit.channels["position"]["5"]
    assert errors[1] < 0.6 * errors[0]
    assert errors[1] < certified.corrected.value + 0.02


def _replayed(folder: Path) -> float:
    """Root mean square error of the position after 5 s, driven by commands, mean over the runs [m]."""
    report = json.loads((folder / "replay.json").read_text())
    found = [
        item["error"]["rms"]
        for run in report["runs"]
        for mode in run["arms"]
        for item in mode["horizons"]
        if mode["drive"] == "commands" and item["metric"] == "position" and item["horizon"] == 5.0
        if item["model"] == REFITTED and item["error"]["rms"] is not None
    ]
    return float(np.mean(found))


@pytest.mark.slow
def test_a_stopped_diagnosis_goes_on(
    found: Path, work: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Stopped in the certification: nothing at the place of the output; the next start does not search again."""

    def stopped(*arguments: object, **options: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(pipeline, "certify", stopped)
        assert main(words(work, "stopped")) == 130
    assert "goes on" in capsys.readouterr().err
    assert not (work / "stopped").exists()

    def search(*arguments: object, **options: object) -> None:
        raise AssertionError("the search was done again")

    monkeypatch.setattr(pipeline, "search", search)
    assert main(words(work, "stopped")) == 0
    again, before = (as_mapping(load(work / name / "diagnosis.json")) for name in ("stopped", "found"))
    assert {**again, "seconds": 0} == {**before, "seconds": 0}


@pytest.mark.parametrize(
    ("changes", "fragment"),
    [
        (["--map", "no_such_map"], "no_such_map"),
        (["--robot", "husky"], "'ddagr'"),
        (["--soil", "mud"], "mud"),
        (["--threads", "0"], "threads is 0"),
        (["--thresholds", "missing.json"], "ddagr null-bank"),
    ],
)
def test_bad_options_are_one_sentence(
    work: Path, changes: list[str], fragment: str, capsys: pytest.CaptureFixture[str]
) -> None:
    line = words(work, "refused")
    if changes[0] == "--map":
        shutil.copy(work / "thresholds.json", work / "table.csv")
        line[1] = str(work / "table.csv")
    assert main([*line, *changes]) == 2
    error = capsys.readouterr().err
    assert fragment in error
    assert error.count("\n") == 1
    assert not (work / "refused").exists()
    assert not part_folder(work / "refused").exists()


def test_a_folder_without_recordings_is_refused(work: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*words(work)[:1], str(tmp_path), *words(work, "refused")[2:]]) == 2
    assert "holds no recording" in capsys.readouterr().err


def test_an_output_of_something_else_is_refused_at_once(work: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words(work, "drives")) == 2
    assert "no ddagr command wrote" in capsys.readouterr().err
    assert len(list((work / "drives").iterdir())) == 2


def test_what_is_wrong_with_the_recordings_is_printed_first() -> None:
    doubts = (
        DataDoubt("run_1.csv", "yaw_rate", "stuck", "It never changes."),
        DataDoubt("", "", "schema", "Times go back."),
    )
    answer = Diagnosis(("none",), False, (), "Nothing is missing.", {}, {}, {}, (), NO_GATES, 1.0, "0", checks=doubts)
    lines = outcome_text(answer).splitlines()
    assert lines[0] == "Nothing is missing."
    assert lines[2].startswith("The recordings themselves are suspicious")
    assert lines[3:] == ["  run_1.csv yaw_rate: It never changes.", "  Times go back."]


@pytest.mark.slow
def test_drives_from_before_are_taken_by_the_command(work: Path, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    """The second drive is on the slope of the first one: nothing changed."""
    runs = work / "drives"
    words = ["diagnose", str(runs / "run_2.parquet"), "--before", str(runs / "run_1.parquet"), "--window", "2"]
    assert main([*words, "--same-ground", "--output", str(tmp_path / "changed")]) == 0
    told = capsys.readouterr().out
    assert "No change shows against the drive before." in told
    assert "left-out windows are forecast as well as 90 % of those of the drives before" in told
    diagnosis = load(tmp_path / "changed" / "diagnosis.json")
    assert (diagnosis.change.against, diagnosis.change.ground) == ("before", "same")
    names = {path.name for path in (tmp_path / "changed").iterdir()}
    assert {"index.html", "robot.yaml", "soil.yaml", "effects.yaml"} <= names
    assert get_robot(str(tmp_path / "changed" / "robot.yaml")).name == "ddagr"


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--before", "a.parquet", "b.parquet"], "--before takes all that follows it (a.parquet b.parquet)"),
        (["a.parquet", "--calibration", "nowhere"], "nowhere is no folder that `ddagr calibrate` wrote"),
    ],
)
def test_what_is_compared_with_is_looked_at_first(more: list[str], said: str, capsys: pytest.CaptureFixture) -> None:
    assert main(["diagnose", *more, "--output", "nothing"]) == 2
    assert said in capsys.readouterr().err
    assert not Path("nothing").exists()


@pytest.mark.parametrize("option", ["--before", "--calibration"])
def test_a_stopped_comparison_promises_nothing_and_leaves_the_steps_of_a_diagnosis(
    option: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    given: dict[str, object] = {}

    def stopped(*arguments: object, **options: object) -> None:
        given.update(options)
        raise KeyboardInterrupt

    monkeypatch.setattr("ddagr_gym.diagnose", stopped)
    monkeypatch.setattr("ddagr_gym.api.inputs.recordings_from", lambda *arguments: ())
    earlier = part_folder(tmp_path / "changed")
    earlier.mkdir()
    ordinary = tmp_path / "ordinary"
    ordinary.mkdir()
    (ordinary / "robot.yaml").touch()
    assert main(["diagnose", "run.csv", option, str(ordinary), "--output", str(tmp_path / "changed")]) == 130
    assert capsys.readouterr().err == "ddagr: interrupted.\n"
    assert given["cache"] is None
    assert earlier.is_dir()


def test_a_ground_that_is_the_same_and_another_is_refused(
    work: Path, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    runs = work / "drives"
    words = ["diagnose", str(runs / "run_2.parquet"), "--before", str(runs / "run_1.parquet")]
    assert main([*words, "--same-ground", "--other-ground", "--output", str(tmp_path / "changed")]) == 2
    assert "give --same-ground or --other-ground" in capsys.readouterr().err
