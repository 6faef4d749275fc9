"""Ablations: which cases, what counts, and that every arm is what its name says."""

import collections
import json
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks import ablate_concealed
from benchmarks.ablate_concealed import Work, chosen, figures, main
from benchmarks.ablations.arms import (
    First,
    bic_thresholds,
    first_of,
    from_values,
    noise_thresholds,
    parameter_counts,
    scan_raw_nominal,
)
from benchmarks.ablations.examine import ARMS, examine
from benchmarks.ablations.sparse import MEANING, sparse_equation, thresholded
from benchmarks.concealed import manoeuvres
from benchmarks.concealed.cases import Case
from benchmarks.concealed.catalogue import LIBRARY_FORMS
from benchmarks.concealed.simulate import simulate_case
from benchmarks.concealed.sizes import LEAST_MEANINGFUL
from benchmarks.concealed.storage import write_case
from ddagr_gym.diagnosis.gates.threshold_files import default_thresholds
from ddagr_gym.diagnosis.gates.thresholds import Gate, Thresholds
from ddagr_gym.diagnosis.preprocessing.mended_recordings import MendedRecordings
from ddagr_gym.diagnosis.preprocessing.repeated_readings import RepeatedReadings
from ddagr_gym.diagnosis.preprocessing.reversed_gyro import ReversedGyro
from ddagr_gym.diagnosis.search.candidates import candidates_of
from ddagr_gym.diagnosis.search.gains import Gain
from ddagr_gym.diagnosis.search.scanned_model import scan_model
from ddagr_gym.diagnosis.setting import Setting, make_problem
from ddagr_gym.errors import InputError
from ddagr_gym.identification.gauss_newton import fit
from ddagr_gym.identification.problem import Problem
from ddagr_gym.parameters import Imu, PoseReceiver, Sensors, WheelEncoder
from ddagr_gym.physics.effects.base import DriveExtent
from ddagr_gym.physics.effects.registry import effect_kind, effect_kinds
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import simulate

LABELS: dict[str, dict[str, Any]] = {
    **{f"null_{k}": {"kind": "null", "verdict": ["none"]} for k in range(4)},
    **{f"other_{k}": {"kind": "structural null", "verdict": ["none"]} for k in range(4)},
    **{f"single_{k}": {"kind": "single", "verdict": [name]} for k, name in enumerate(list(LEAST_MEANINGFUL) * 2)},
    "double": {"kind": "double", "verdict": ["slope", "gyro_bias"]},
}


def test_cases_are_nulls_of_both_kinds_and_every_effect_before_any_twice() -> None:
    names = chosen(LABELS, 4, 28, 0)
    kinds = collections.Counter(LABELS[name]["kind"] for name in names)
    assert kinds == {"null": 2, "structural null": 2, "single": 28}
    effects = {LABELS[name]["verdict"][0] for name in names if name.startswith("single")}
    assert effects == set(LEAST_MEANINGFUL)
    assert names == chosen(LABELS, 4, 28, 0)
    assert names != chosen(LABELS, 4, 28, 1)
    with pytest.raises(InputError, match="9 nulls"):
        chosen(LABELS, 9, 28, 0)


def problem_of(*effects: str) -> Problem:
    """Windows of 12 s of arcs by the simulator itself."""
    robot, soil = get_robot("ddagr"), get_soil("thesis_a1")
    commands = np.repeat([(0.7, 0.7), (0.9, 0.4), (0.4, 0.9)], 200, axis=0)
    sensors = Sensors(Imu(sample_rate=50.0), WheelEncoder(), PoseReceiver(5.0))
    columns = simulate(robot, soil, commands, sensors=sensors, effects=effects, seed=1)
    return make_problem(robot, soil, (Recording.from_columns(columns, robot),), Setting())


def said(name: str, ratio: float, rough: float = 0.0) -> dict[str, Any]:
    return {**First(name, ratio > 1.0, ratio, rough).as_mapping(), "seconds": 2.0}


def test_figures_of_an_arm() -> None:
    labels = {
        "n1": {"kind": "null", "verdict": ["none"]},
        "n2": {"kind": "structural null", "verdict": ["none"]},
        "s1": {"kind": "single", "verdict": ["slope"]},
        "s2": {"kind": "single", "verdict": ["slope"]},
        "s3": {"kind": "single", "verdict": ["payload"]},
        "s4": {"kind": "single", "verdict": ["payload"]},
    }
    arm = {
        "n1": said("slope", 3.0), "n2": said("slope", 0.5, rough=1.2), "s1": said("slope", 4.0),
        "s2": said("slope", 2.0), "s3": said("payload", 0.9), "s4": said("slope", 9.0),
    }  # fmt: skip
    found = figures(labels, {name: {"arm": entry} for name, entry in arm.items()})["arm"]
    assert found["top1"]["value"] == 0.5
    assert found["first"]["value"] == 0.75
    assert found["false_alarm_rate"]["value"] == 1.0
    assert found["named_on_nulls"]["value"] == 0.5
    assert found["top1_at_same_alarms"]["value"] == 0.25
    assert found["highest_ratio_of_nulls"] == 3.0
    assert found["seconds"]["value"] == 2.0


def test_the_first_effect_is_the_one_furthest_over_its_gate_and_passing_ones_come_before() -> None:
    def scan(gains: dict[str, float], held_out: dict[str, float]) -> Any:
        listed = tuple(Gain(0, name, gain, ()) for name, gain in gains.items())
        return SimpleNamespace(gains=listed, held_out=held_out, misfit={"yaw_rate": 3.0})

    thresholds = Thresholds({"a": Gate(10.0, 1.0), "b": Gate(50.0, 1.0)}, {"yaw_rate": 2.0}, 20, "")
    first = first_of([scan({"a": 30.0, "b": 60.0}, {"a": 5.0, "b": 5.0})], thresholds)
    assert first == First("a", True, 3.0, 1.5)
    # most of what "a" gains is lost on left-out windows: "b" stands first
    assert first_of([scan({"a": 15.0, "b": 51.0}, {"a": 0.0, "b": 5.0})], thresholds).name == "b"
    # at a second nominal model "b" gains more
    scans = [scan({"a": 30.0, "b": 60.0}, {"a": 5.0, "b": 5.0}), scan({"b": 90.0}, {"b": 9.0})]
    assert first_of(scans, thresholds).name == "b"
    assert not first_of([scan({"a": 5.0, "b": 5.0}, {})], thresholds).passes


def test_readings_that_speak_for_themselves_come_first() -> None:
    assert from_values(MendedRecordings((), ())) is None
    repeats = MendedRecordings((), (), (RepeatedReadings("gyro", 0.5, 0.1, 100),), ReversedGyro(-0.9, 500))
    assert (from_values(repeats) or First("", False, 0.0)).name == "sensor_hold"


def test_without_nuisances_nothing_but_states_is_eliminated() -> None:
    """A soil that differs is explained by the refit and stands as an effect where nothing is refitted."""
    problem = problem_of("soil_change=0.7,stiffness=0.6")
    raw = fit(problem, iterations=0)
    model = scan_raw_nominal(problem, raw, get_soil("thesis_a1"))
    assert model.terms.nuisances == 0
    refitted = fit(problem, raw.point, first=raw, iterations=3)
    explained = model.fitted.cost - refitted.cost
    assert explained > 10.0
    gain = next(gain.gain for gain in model.gains if gain.name == "soil_change")
    # a drag says the same of so short a drive
    assert gain > 0.99 * model.gains[0].gain
    # one effect moves less than the refit does, from the same point
    assert 0.5 * explained < gain * model.dispersion < explained


def test_noise_limits_hold_on_a_drive_of_the_same_simulator() -> None:
    """The quantile of a mean square over n samples is 1 + O(sqrt(2/n)), wider where there are fewer."""
    found = noise_thresholds(problem_of())
    assert 1.0 < found.misfit["yaw_rate"] < found.misfit["pose_x"] < found.misfit["local_gyro"]
    # survival function of chi-square with three degrees of freedom in closed form
    gain = found.of("slope").gain
    above = math.erfc(math.sqrt(gain)) + 2.0 * math.sqrt(gain / math.pi) * math.exp(-gain)
    assert above * len(effect_kinds()) == pytest.approx(0.05, rel=1e-6)


def scanned(*names: str) -> list[Any]:
    """Candidates of effects on drives of 3 min over 10 m by 6 m."""
    extent = DriveExtent(180.0, (-5.0, 5.0), (-3.0, 3.0), 1.2, 1.0)
    return [candidate for name in names for candidate in candidates_of(effect_kind(name), extent, 0)]


def test_parameters_are_what_a_scan_fits_and_chooses() -> None:
    """Sizes, a direction as two multiples, places and moments that are tried; a flip or a limit is one choice."""
    expected = {
        "gyro_bias": 1, "gyro_sign": 1, "accelerometer_sign": 1, "motor_saturation": 1, "slope": 2, "imu_tilt": 2,
        "soil_change": 3, "soil_patch": 4,
    }  # fmt: skip
    assert parameter_counts(scanned(*expected)) == expected


def test_an_effect_passes_the_criterion_where_it_falls_whatever_left_out_windows_say() -> None:
    """BIC = 2 cost/dispersion + parameters ln(readings): smaller with the effect from half of the latter on."""
    mask = np.ones((5, 80))
    mask[:, 60:] = 0.0
    problem: Any = SimpleNamespace(blocked=SimpleNamespace(mask=mask))
    thresholds = bic_thresholds(problem, scanned("gyro_bias", "slope"))
    limit = 0.5 * math.log(300.0)
    lost = SimpleNamespace(held_out={"gyro_bias": -50.0, "slope": -50.0})
    for name, count in (("gyro_bias", 1), ("slope", 2)):
        assert thresholds.passes(name, 1.001 * count * limit, lost)
        assert not thresholds.passes(name, 0.999 * count * limit, lost)
    # by how much the criterion falls decides, not by what factor over the gate
    listed = (Gain(0, "gyro_bias", 3.0 * limit, ()), Gain(1, "slope", 4.5 * limit, ()))
    scan: Any = SimpleNamespace(gains=listed, held_out=lost.held_out, misfit={"yaw_rate": 99.0})
    first = first_of([scan], thresholds)
    assert (first.name, first.passes, first.rough) == ("slope", True, 0.0)
    assert first.ratio == pytest.approx(2.25)


def test_the_criterion_names_what_is_there_on_a_drive_of_the_same_simulator() -> None:
    problem = problem_of("gyro_bias=0.02")
    model = scan_model(problem, fit(problem, iterations=0))
    thresholds = bic_thresholds(problem, model.terms.candidates)
    first = first_of([model], thresholds)
    assert first.name == "gyro_bias"
    assert first.alarm
    assert set(thresholds.gates) == {gain.name for gain in model.gains}


def test_sparse_regression_finds_the_terms_that_are_there() -> None:
    rng = np.random.default_rng(0)
    x = rng.standard_normal((900, 4))
    recording = np.repeat(np.arange(3), 300)
    y = 0.8 * x[:, 1] - 0.5 * x[:, 3] + 0.2 * rng.standard_normal(900)
    found = sparse_equation(x, y, recording, ("a", "b", "c", "d"))
    assert set(found.evidence) >= {"b", "d"}
    assert found.evidence["b"] > found.evidence["d"] > 20.0 * max(found.evidence.get(name, 0.0) for name in "ac")
    # 0.89 of 0.93 is not noise
    assert found.held_out == pytest.approx(0.89 / 0.93, abs=0.02)
    least_squares = np.linalg.lstsq(x[:, [1, 3]], y, rcond=None)[0]
    assert thresholded(x, y, 0.3)[[1, 3]] == pytest.approx(least_squares, rel=1e-3)


def test_sparse_regression_selects_nothing_in_noise() -> None:
    rng = np.random.default_rng(1)
    x, y = rng.standard_normal((900, 4)), rng.standard_normal(900)
    found = sparse_equation(x, y, np.repeat(np.arange(3), 300), ("a", "b", "c", "d"))
    assert max(found.evidence.values(), default=0.0) < 20.0
    assert found.held_out < 0.02


def test_terms_mean_effects_of_the_library() -> None:
    assert {name for terms in MEANING.values() for name in terms.values()} <= set(LEAST_MEANINGFUL)


def test_command_line_goes_on_and_writes_result_and_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    labels = {name: {"label": label} for name, label in LABELS.items()}
    (tmp_path / "labels.json").write_text(json.dumps({"cases": labels}))
    made: list[str] = []

    def examined(work: Work) -> str:
        if len(made) == 3:
            made.append("stopped")
            raise KeyboardInterrupt
        if not work.part.exists():
            made.append(work.folder.name)
            arms = {arm: said("slope", 2.0) for arm in ARMS}
            work.part.write_text(json.dumps({"key": "", "arms": arms}))
        return work.folder.name

    monkeypatch.setattr(ablate_concealed, "examined", examined)
    words = [str(tmp_path), "--labels", str(tmp_path / "labels.json"), "--nulls", "2", "--singles", "4"]
    words += ["--output", str(tmp_path / "result.json"), "--processes", "1"]
    with pytest.raises(KeyboardInterrupt):
        main(words)
    assert not (tmp_path / "result.json").exists()
    assert main(words) == 0
    assert len([name for name in made if name != "stopped"]) == len(set(made) - {"stopped"}) == 6
    found = json.loads((tmp_path / "result.json").read_text())
    assert set(found["arms"]) == set(ARMS)
    assert found["arms"]["SINDy"]["false_alarm_rate"]["value"] == 1.0
    assert len(found["cases"]) == 6
    assert (tmp_path / "result.png").read_bytes()[:4] == b"\x89PNG"
    assert not (tmp_path / "result.parts").exists()


@pytest.mark.slow
def test_every_arm_examines_a_case_of_the_generator(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A gyro bias of 8 mrad/s, 40 times its prior: even with the nominal model held fixed it stands first."""
    monkeypatch.setattr(manoeuvres, "DURATION", 20.0)
    case = Case("development", 1, "single", ((LIBRARY_FORMS["gyro_bias"][0], 8.0),))
    logs, _ = simulate_case(case, 1)
    write_case(tmp_path / case.name, logs)
    found = examine(tmp_path / case.name, default_thresholds("ddagr"))
    assert set(found) == set(ARMS)
    assert found["as it is"]["name"] == found["nominal fixed"]["name"] == "gyro_bias"
    assert found["as it is"]["passes"]
    assert found["no null bank"]["name"] == "gyro_bias"
    assert found["BIC forward"]["name"] == "gyro_bias"
    # the same gain over a lower gate
    assert found["no null bank"]["ratio"] > found["as it is"]["ratio"]
    # no equation of accelerations has a term for it
    assert found["SINDy"]["name"] != "gyro_bias"
    assert all(entry["seconds"] >= 0.0 for entry in found.values())
