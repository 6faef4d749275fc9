"""Where joint refits begin, and a search that goes on where it was stopped."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ddagr_gym.diagnosis.gates.thresholds import Gate, Thresholds
from ddagr_gym.diagnosis.mid_drive import again
from ddagr_gym.diagnosis.search import rivals
from ddagr_gym.diagnosis.search import starting_models as starts
from ddagr_gym.diagnosis.search import stepwise as module
from ddagr_gym.diagnosis.search.gains import Gain, gains
from ddagr_gym.diagnosis.search.initial_guess import nuisance_answer
from ddagr_gym.diagnosis.search.scan import scan
from ddagr_gym.diagnosis.search.scanned_model import Rival, ScannedModel, SearchResult
from ddagr_gym.diagnosis.search.starting_models import StartingModels, starting_models
from ddagr_gym.diagnosis.search.stepwise import search
from ddagr_gym.diagnosis.setting import SHORT
from ddagr_gym.diagnosis.store import StepStore
from ddagr_gym.errors import InputError
from ddagr_gym.identification.effect_parameters import effect_columns, effect_parameters
from ddagr_gym.identification.gauss_newton import Fitted, cost_of, fit
from ddagr_gym.identification.problem import Point, Problem
from ddagr_gym.identification.spells import Spell
from ddagr_gym.physics.effects.registry import effect_kind, parse_effect
from ddagr_gym.recordings.schema import Recording
from tests.diagnosis.conftest import Sloping, session_of

THRESHOLDS = Thresholds({"slope": Gate(3.0, 0.0)}, {}, 20, "a test")


@pytest.fixture(scope="module")
def scanned(sloping: Sloping) -> ScannedModel:
    """The nominal model on sloping ground and what the slope would gain."""
    terms = scan(sloping.problem, sloping.nominal, {"slope": effect_kind("slope")})
    return ScannedModel(sloping.nominal, terms, tuple(gains(terms)), {}, {}, 1.0, {})


def cost_at(sloping: Sloping, point: Point) -> float:
    prediction = sloping.problem.predict(point)
    return cost_of(sloping.problem, point, prediction, sloping.nominal.elimination)[0]


def test_a_damped_guess_begins_with_the_answer_of_soil_and_robot(sloping: Sloping, scanned: ScannedModel) -> None:
    """The scan promises a fall of the cost for the effect and the nuisances' answer together."""
    gain = scanned.gains[0]
    answer = nuisance_answer(sloping.problem, sloping.nominal, scanned.terms, gain)
    assert (answer[sloping.problem.free] != 0.0).any()
    assert (answer[~sloping.problem.free] == 0.0).all()
    point = rivals._damped_guess(sloping.problem, scanned, gain, scanned.terms, sloping.nominal)
    alone = replace(point, values=sloping.nominal.point.values)
    assert cost_at(sloping, point) < cost_at(sloping, alone)
    assert sloping.nominal.cost - cost_at(sloping, point) > 0.5 * gain.gain


def test_a_guess_that_is_far_too_large_is_damped(sloping: Sloping, scanned: ScannedModel) -> None:
    gain = scanned.gains[0]
    exaggerated = Gain(gain.candidate, gain.name, gain.gain, tuple(3.0 * m for m in gain.multiples))
    point = rivals._damped_guess(sloping.problem, scanned, exaggerated, scanned.terms, sloping.nominal)
    guessed = rivals._damped_guess(sloping.problem, scanned, gain, scanned.terms, sloping.nominal)
    assert point.effects[0].angle < 2.0 * guessed.effects[0].angle
    assert cost_at(sloping, point) < sloping.nominal.cost


def test_a_refit_that_is_known_is_not_made_again(
    sloping: Sloping, scanned: ScannedModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refitted(*inputs: object) -> Fitted:
        raise AssertionError("a refit")

    known = Rival("slope", sloping.chosen, 50.0)
    monkeypatch.setattr(rivals, "_trial", refitted)
    monkeypatch.setattr(rivals, "_finish", refitted)
    found = rivals.rivals_of(sloping.problem, scanned, sloping.nominal, THRESHOLDS, 4, {"slope": known})
    assert found == [known]
    with pytest.raises(AssertionError, match="a refit"):
        rivals.rivals_of(sloping.problem, scanned, sloping.nominal, THRESHOLDS, 4)


def test_refits_of_effects_in_a_part_of_the_drive_are_made_anew(
    sloping: Sloping, scanned: ScannedModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[set[str]] = []

    def searched(session: object, start: object, *, known: dict[str, Rival]) -> SearchResult:
        given.append(set(known))
        return found

    first = (Rival("slope", sloping.chosen, 50.0), Rival("gyro_scale", sloping.chosen, 40.0))
    found = SearchResult((scanned, replace(scanned, fitted=sloping.chosen)), (first,))
    monkeypatch.setattr(again, "search", searched)
    monkeypatch.setattr(again, "spells_of", lambda problem, fitted, progress: {"slope": Spell(0, 5.0)})
    session = session_of(sloping.problem, sloping.recordings, THRESHOLDS)
    again.search_in_parts(session, StartingModels(session, sloping.nominal, sloping.nominal), found)
    assert given == [{"gyro_scale"}]


def test_a_search_goes_on_behind_its_last_step(
    sloping: Sloping, scanned: ScannedModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    chosen = replace(scanned, fitted=sloping.chosen)
    done: list[str] = []
    stop = [True]

    def scan_model(problem: object, fitted: object, progress: object) -> ScannedModel:
        done.append("nominal")
        return scanned

    def add(session: object, raw: object, models: list[ScannedModel], steps: object, known: object) -> Any:
        done.append(f"after {models[-1].names}")
        if not models[-1].names:
            return chosen, (Rival("slope", sloping.chosen, 9.0),)
        if stop.pop():
            raise KeyboardInterrupt
        return None

    monkeypatch.setattr(module, "scan_model", scan_model)
    monkeypatch.setattr(module, "_add_effect", add)
    monkeypatch.setattr(module, "_fitted_to_the_end", lambda problem, last: last)
    session = session_of(sloping.problem, sloping.recordings, THRESHOLDS)
    start = StartingModels(session, sloping.nominal, sloping.nominal)
    with pytest.raises(KeyboardInterrupt):
        search(session, start, StepStore(tmp_path / "part", "key").step)
    assert done == ["nominal", "after ()", "after ('slope',)"]
    stop[:] = [False]
    found = search(session, start, StepStore(tmp_path / "part", "key").step)
    assert done[3:] == ["after ('slope',)"]
    assert found.chosen.names == ("slope",)
    assert found.steps[0][0].fitted.point.effects == sloping.chosen.point.effects


@pytest.mark.parametrize("better", [(), ("payload",), ("slope", "payload")])
def test_an_effect_that_explains_nothing_once_it_is_fitted_to_the_end_is_not_added(
    sloping: Sloping, scanned: ScannedModel, monkeypatch: pytest.MonkeyPatch, better: tuple[str, ...]
) -> None:
    """Trial steps count with sensitivities of the model before, by which they may promise what is not there."""
    tried = [Rival(name, sloping.chosen, gain) for name, gain in (("slope", 60.0), ("payload", 50.0))]

    def joint(problem: Problem, rival: Rival, steps: object) -> Fitted:
        return replace(sloping.chosen, cost=sloping.nominal.cost * (0.5 if rival.name in better else 1.05))

    monkeypatch.setattr(module, "rivals_of", lambda *inputs: tried)
    monkeypatch.setattr(module, "_joint", joint)
    monkeypatch.setattr(module, "scan_model", lambda problem, fitted, progress: replace(scanned, fitted=fitted))
    session = session_of(sloping.problem, sloping.recordings, THRESHOLDS)
    added = module._add_effect(session, sloping.nominal, [scanned], [], {})
    assert (() if added is None else tuple(rival.name for rival in added[1])) == (
        ("slope", "payload") if "slope" in better else better
    )


def test_loops_are_told_from_delays(drive, problem_of) -> None:
    """Both are late by the same time; only one rounds the corner of a step."""
    for truth, other in (("motor_lag=0.25,second_pole=1", "command_delay"), ("command_delay=0.2", "motor_lag")):
        problem = problem_of(drive((truth,)))
        raw = fit(problem, iterations=0)
        right = parse_effect(truth)
        wrong = {"command_delay": "command_delay=0.2", "motor_lag": "motor_lag=0.2,second_pole=0.9"}[other]
        costs = [
            fit(problem, replace(raw.point, effects=(effect,)), iterations=6, reuse=raw).cost
            for effect in (right.with_values(**{right.size_names()[0]: 0.15}), parse_effect(wrong))
        ]
        assert costs[1] - costs[0] > 20.0, (truth, costs)


def test_a_swap_knows_its_place_after_an_effect_has_gone() -> None:
    """A beside which B came and A went: steps and places agree no more."""

    def rival(name: str) -> Any:
        return SimpleNamespace(name=name)

    fitted: Any = SimpleNamespace(
        point=SimpleNamespace(effects=[parse_effect("slope=0.1"), parse_effect("gyro_scale=1.1")])
    )
    assert module._place_of([rival("payload"), rival("towed_drag")], fitted) is None
    assert module._place_of([rival("slope"), rival("payload")], fitted) == 0
    assert module._place_of([rival("imu_tilt"), rival("gyro_scale")], fitted) == 1


def test_what_is_confused_with_a_named_effect_has_to_explain_more() -> None:
    """A patch of another form than the library's leaves something that looks like a soil that changes."""

    def scanned(cost: float, *effects: str) -> Any:
        point = SimpleNamespace(effects=tuple(parse_effect(text) for text in effects))
        terms = SimpleNamespace(overlap={"gyro_scale": 0.2, "soil_change": 0.2} if effects else {}, imitated={})
        return SimpleNamespace(fitted=SimpleNamespace(cost=cost, point=point), dispersion=1.0, terms=terms)

    names = ("soil_change", "gyro_scale", "payload")
    gates = Thresholds({name: Gate(40.0, 0.0) for name in names}, {}, 20, "x")
    found = module.further_gates(gates, [scanned(2000.0), scanned(1000.0, "soil_patch=0.5")])
    assert found.of("soil_change").gain == pytest.approx(40.0 + 0.1 * 1000.0)
    assert found.of("gyro_scale").gain == pytest.approx(40.0 + 0.2 * 0.01 * 1000.0)
    assert found.of("payload").gain == pytest.approx(40.0 + 0.01 * 1000.0)
    assert module.further_gates(gates, [scanned(2000.0)]) == gates


def test_a_shape_at_its_lower_bound_moves_inwards(sloping: Sloping) -> None:
    problem, fitted = sloping.problem, sloping.nominal
    lag = parse_effect("motor_lag=0.2,slowing=0")
    (slowing,) = (p for p in effect_parameters((lag,)) if p.field == "slowing")
    point = replace(fitted.point, effects=(lag,))
    assert slowing.step < 0.0 == slowing.low
    assert np.abs(effect_columns(problem, point, [slowing])).max() > 1.0


def test_a_window_that_cannot_be_predicted_is_no_perfect_fit(sloping: Sloping) -> None:
    problem, fitted = sloping.problem, sloping.nominal
    broken = fitted.prediction.copy()
    broken[2, 5:] = np.nan
    total, shares = cost_of(problem, fitted.point, broken, fitted.elimination)
    assert total == np.inf
    assert np.flatnonzero(np.isinf(shares)).tolist() == [2]


def test_a_window_that_no_model_predicts_is_refused_in_a_sentence(
    drive: Callable[..., Recording], problem_of: Callable[..., Problem], monkeypatch: pytest.MonkeyPatch
) -> None:
    recordings = (drive(seconds=8.0),)
    session = session_of(problem_of(*recordings), recordings, THRESHOLDS)
    predict = Problem.predict

    def broken(problem: Problem, point: Point) -> np.ndarray:
        found = predict(problem, point)
        found[problem.blocked.windows.time > 3.0] = np.nan
        return found

    monkeypatch.setattr(Problem, "predict", broken)
    with pytest.raises(InputError, match=r"breaks down in 1 of 3 windows, first at 4\.0 s"):
        starting_models(session)


@pytest.mark.parametrize("far_off", [False, True])
def test_some_windows_of_long_drives_say_whether_the_nominal_model_is_far_off(
    drive: Callable[..., Recording],
    problem_of: Callable[..., Problem],
    monkeypatch: pytest.MonkeyPatch,
    far_off: bool,
) -> None:
    recordings = (drive(seconds=20.0),)
    session = session_of(problem_of(*recordings), recordings, THRESHOLDS).with_windows(3.0, 3.0)
    refitted: list[Problem] = []

    def refit(problem: Problem, progress: object) -> tuple[Fitted, Fitted]:
        refitted.append(problem)
        found = fit(problem, iterations=0)
        return found, found

    monkeypatch.setattr(starts, "refit_nominal", refit)
    monkeypatch.setattr(starts, "FAR_OFF", 0.0 if far_off else np.inf)
    monkeypatch.setattr(starts, "MOST_WINDOWS", 3)
    monkeypatch.setattr(starts, "MANY_WINDOWS", 4)
    monkeypatch.setattr(starts, "SOME_WINDOWS", 2)
    start = starting_models(session)
    counts = [problem.blocked.windows.count for problem in refitted]
    whole = session.problem.blocked.windows.count
    assert whole > 4
    if far_off:
        assert start.session.setting.duration == SHORT
        assert max(counts) < whole
    else:
        assert start.session is session
        assert counts[0] < counts[1] == whole


@pytest.fixture
def refits(monkeypatch: pytest.MonkeyPatch) -> list[Problem]:
    """Problems of the nominal refits, which take no step."""
    made: list[Problem] = []

    def refit(problem: Problem, progress: object) -> tuple[Fitted, Fitted]:
        made.append(problem)
        found = fit(problem, iterations=0)
        return found, found

    monkeypatch.setattr(starts, "refit_nominal", refit)
    return made


def test_windows_that_are_short_already_are_fitted_once(
    drive: Callable[..., Recording],
    problem_of: Callable[..., Problem],
    monkeypatch: pytest.MonkeyPatch,
    refits: list[Problem],
) -> None:
    """Drives in segments of 2 s have no longer windows, whatever is set."""
    recordings = (drive(seconds=8.0),)
    session = session_of(problem_of(*recordings), recordings, THRESHOLDS)
    session = replace(session, setting=replace(session.setting, duration=6.0, stride=6.0))
    monkeypatch.setattr(starts, "FAR_OFF", 0.0)
    start = starting_models(session)
    assert len(refits) == 1
    assert start.session.setting.duration == SHORT
    assert start.session.problem.blocked.windows.count == session.problem.blocked.windows.count


@pytest.mark.parametrize("far_off", [False, True])
def test_a_fast_robot_is_simulated_coarsely_where_the_nominal_model_is_far_off(
    drive: Callable[..., Recording],
    problem_of: Callable[..., Problem],
    monkeypatch: pytest.MonkeyPatch,
    refits: list[Problem],
    far_off: bool,
) -> None:
    recordings = (drive(seconds=24.0),)
    session = session_of(problem_of(*recordings), recordings, THRESHOLDS).with_windows(3.0, 3.0)
    exact = session.problem.predict(session.problem.start())
    monkeypatch.setattr(starts, "FAST", 0.5 * session.robot.maximum_wheel_speed * session.robot.outer_radius)
    monkeypatch.setattr(starts, "FAR_OFF", 0.0 if far_off else np.inf)
    start = starting_models(session)
    assert len(refits) == 2
    assert start.session.setting.far_off is far_off
    assert not np.array_equal(refits[0].predict(refits[0].start()), exact)
    if not far_off:
        np.testing.assert_array_equal(refits[1].predict(refits[1].start()), exact)


@pytest.mark.parametrize("shape", ["motor_lag", "motor_saturation"])
def test_what_shapes_the_answer_to_a_command_has_to_explain_more_beside_a_delay(shape: str) -> None:
    """They differ in how wheels answer a step: what is left of another form of one looks like another one."""
    point = SimpleNamespace(effects=(parse_effect("command_delay=0.2"),))
    terms = SimpleNamespace(overlap={shape: 0.4}, imitated={})
    first = SimpleNamespace(fitted=SimpleNamespace(cost=3000.0, point=SimpleNamespace(effects=())), terms=terms)
    delayed = SimpleNamespace(fitted=SimpleNamespace(cost=500.0, point=point), dispersion=1.0, terms=terms)
    gates = Thresholds({shape: Gate(20.0, 0.0)}, {}, 20, "x")
    assert module.further_gates(gates, [first, delayed]).of(shape).gain == pytest.approx(20.0 + 0.1 * 2500.0)


def test_a_second_effect_keeps_the_overlap_it_had_before_it_was_named() -> None:
    def scanned(cost: float, overlap: dict[str, float], *effects: str) -> Any:
        point = SimpleNamespace(effects=tuple(parse_effect(text) for text in effects))
        fitted = SimpleNamespace(cost=cost, point=point)
        return SimpleNamespace(fitted=fitted, dispersion=1.0, terms=SimpleNamespace(overlap=overlap, imitated={}))

    names = ("command_deadband", "accelerometer_bias", "of_ones_own")
    gates = Thresholds({name: Gate(10.0, 0.0) for name in names[:2]}, {}, 20, "x")
    found = [
        scanned(20000.0, {}),
        scanned(1000.0, {"accelerometer_bias": 0.05, "of_ones_own": 0.1}, "command_deadband=0.1"),
        scanned(0.0, {"of_ones_own": 0.2}, "command_deadband=0.1", "accelerometer_bias=0.2"),
    ]
    raised = module.further_gates(gates, found)
    assert raised.of("accelerometer_bias").gain == pytest.approx(10.0 + 0.05 * 0.01 * 20000.0)
    assert raised.of("command_deadband").gain == pytest.approx(10.0 + 0.01 * 20000.0)
    assert raised.of("of_ones_own").gain == pytest.approx(10.0 + 0.2 * 0.01 * 20000.0)


def test_overlap_says_where_effects_act(sloping: Sloping) -> None:
    """A slope acts on the accelerometer as a bias does, and hardly where an encoder's scale acts."""
    kinds = {name: effect_kind(name) for name in ("accelerometer_bias", "encoder_scale", "gyro_scale")}
    assert scan(sloping.problem, sloping.nominal, kinds).overlap == {}
    overlap = scan(sloping.problem, sloping.chosen, kinds).overlap
    assert 0.3 < overlap["accelerometer_bias"] <= 1.0
    assert 0.0 <= overlap["encoder_scale"] < 0.1
    assert overlap["gyro_scale"] < overlap["accelerometer_bias"]
