"""The search for gains, on few candidates and scenarios."""

import json

import numpy as np
import pytest

from benchmarks import gain_search
from benchmarks.gain_search import (
    PLANT_SEED,
    SPACES,
    STAGES,
    VALIDATION_SET,
    GainSearch,
    check_names,
    episodes_of,
    objective,
    write_gains,
)
from ddagr_gym.config import load_config
from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.ladder_gains import LadderGains, gains_file, ladder_gains
from ddagr_gym.tasks import FailedTasksError, TaskRunner
from tests.needs_ray import NEEDS_RAY

FEW = ((4, 1), (2, 2))
RAY = pytest.param(
    (2, "local"),
    id="ray",
    marks=[
        pytest.mark.ray,
        pytest.mark.slow,
        NEEDS_RAY,
    ],
)


def test_objective_by_hand():
    outcomes = [(0.01, True), (-0.02, True), (0.03, True), (None, False)]
    # median of 1, 2, 3 and 100 percent is 2.5; order statistic at 95 percent is 100
    assert objective(outcomes) == pytest.approx(0.025 + 0.25 * 1.0 + 0.25)
    assert objective([(0.01, True)]) == pytest.approx(0.01 + 0.0025)
    assert objective([(0.01, False)]) > objective([(0.9, True)]) - 1.0
    assert objective([(7.0, True)]) == objective([(1.0, True)])


def test_budget_is_counted():
    assert episodes_of(STAGES) == 64 * 8 + 16 * 16 + 4 * 16 + 40
    assert episodes_of(FEW) == 4 + 2 + 2


def test_values_span_the_box_logarithmically():
    space = SPACES["B4"]
    low, high = space.values(np.zeros(4)), space.values(np.ones(4))
    middle = space.values(np.full(4, 0.5))
    for name, least, most in space.axes:
        assert (low[name], high[name]) == (least, most)
        assert middle[name] == pytest.approx((least * most) ** 0.5, rel=1e-3)


TRACKER = ("course", "ahead", "side_slip", "aligning")


@pytest.mark.parametrize("controller", SPACES)
def test_every_space_changes_its_own_controller_only(controller):
    before = ladder_gains()
    after = SPACES[controller].apply(before, SPACES[controller].values(np.full(len(SPACES[controller].axes), 0.37)))
    changed = {name for name in vars(before) if getattr(before, name) != getattr(after, name)}
    fields = {"B2": "yaw_rate", "B3": "radial", "B4": "force_balance", "B5": "predictive", "B6": "path_tracker"}
    expected = fields.get(controller, controller)
    single = {"true_path": {"true_path_heading"}, "B6": {f"path_tracker_{name}" for name in TRACKER}}
    assert changed == {expected} | single.get(controller, set())
    assert ("true_path_heading" in changed) == (controller == "true_path")
    assert ("path_tracker_course" in changed) == (controller == "B6")


def test_search_resumes_and_is_repeatable(tmp_path):
    counted = []
    first = GainSearch("B2", tmp_path / "a", stages=FEW, progress=counted.append).run()
    assert sum(counted) == episodes_of(FEW)
    journal = (tmp_path / "a").read_text().splitlines()
    assert len(journal) == episodes_of(FEW)
    (tmp_path / "b").write_text("\n".join(journal[:3]) + "\n" + journal[3][:10])
    again = GainSearch("B2", tmp_path / "b", stages=FEW)
    assert len(again._driven) == 3
    assert again.run() == first
    assert GainSearch("B2", tmp_path / "c", stages=FEW, seed=1).run()["finalists"] != first["finalists"]
    assert first["objective"] == min(item["objective"] for item in first["finalists"])
    assert first["best"] == first["finalists"][0]["values"]
    assert len(first["finalists"]) == 3  # two, and the gains chosen by hand
    by_hand = dict(zip((name for name, _, _ in SPACES["B2"].axes), SPACES["B2"].start, strict=True))
    assert {"values": by_hand, "objective": first["objective_by_hand"]} in first["finalists"]


@pytest.mark.parametrize("engine", [pytest.param((2, ""), id="two processes"), RAY])
def test_every_engine_finds_the_same_bits(tmp_path, engine):
    expected = GainSearch("B2", tmp_path / "here", stages=FEW).run()
    with TaskRunner(engine[0], cluster=engine[1]) as runner:
        assert GainSearch("B2", tmp_path / "there", stages=FEW, runner=runner).run() == expected
    assert sorted((tmp_path / "there").open()) == sorted((tmp_path / "here").open())


def test_an_episode_that_fails_is_named_and_the_others_are_kept(tmp_path, monkeypatch):
    drive = gain_search.drive_turn

    def fails_on_the_second(controller, settings, seed, episode):
        if seed == second:
            raise ZeroDivisionError("a wheel of radius 0")
        return drive(controller, settings, seed, episode)

    second = gain_search.load_scenarios(VALIDATION_SET)[1].seed
    monkeypatch.setattr(gain_search, "drive_turn", fails_on_the_second)
    with pytest.raises(FailedTasksError, match=r"4 of 8 tasks failed: B2 with .* on 1: raised \(ZeroDivisionError"):
        GainSearch("B2", tmp_path / "journal", stages=((8, 2),)).run()
    assert {json.loads(line)["number"] for line in (tmp_path / "journal").open()} == {0}


def test_search_finds_a_known_optimum(tmp_path, monkeypatch):
    space = SPACES["B4"]
    wanted = np.array([0.7, 0.3, 0.5, 0.6])

    def outcome(values):
        point = [np.log(max(values[n], 1e-9) / low) / np.log(high / low) for n, low, high in space.axes]
        return float(0.1 * np.linalg.norm(np.array(point) - wanted)), True

    def drive(self, episodes):
        return [outcome(values) for values, _ in episodes]

    monkeypatch.setattr(GainSearch, "_drive", drive)
    found = GainSearch("B4", tmp_path / "journal").run()
    # 32 Sobol points alone come within 0.3 of the optimum
    assert found["objective"] < 0.1 * 0.25 * 1.25
    assert len(found["finalists"]) == STAGES[-1][0] + 1


def test_gains_chosen_by_hand_win_where_nothing_is_better(tmp_path, monkeypatch):
    space = SPACES["B3"]
    by_hand = dict(zip((name for name, _, _ in space.axes), space.start, strict=True))

    def drive(self, episodes):
        return [(0.01 if values == by_hand else 0.02, True) for values, _ in episodes]

    monkeypatch.setattr(GainSearch, "_drive", drive)
    assert GainSearch("B3", tmp_path / "journal").run()["best"] == by_hand


def test_only_the_validation_set_is_read(tmp_path, monkeypatch):
    asked = []
    load = gain_search.load_scenarios
    monkeypatch.setattr(gain_search, "load_scenarios", lambda name: asked.append(name) or load(name))
    GainSearch("B3", tmp_path / "journal", stages=((2, 1),)).run()
    assert asked == [VALIDATION_SET] == ["V"]


def test_the_path_tracker_is_searched_on_development_plants_of_its_own(tmp_path, monkeypatch):
    asked = []
    find = gain_search.scenario
    monkeypatch.setattr(gain_search, "scenario", lambda *given: asked.append(given) or find(*given))
    monkeypatch.setattr(gain_search, "load_scenarios", lambda name: pytest.fail(f"set {name} was read"))
    GainSearch("B6", tmp_path / "journal", stages=((2, 2),)).run()
    assert set(asked) == {("level", 0, PLANT_SEED), ("slope_3", 1, PLANT_SEED)}
    assert find("level", 0, PLANT_SEED)[1].soils != find("level", 0)[1].soils


def test_written_gains_read_back(tmp_path):
    record = {"controller": "B5", "best": {"lateral": 33.0, "offset_rate": 0.07}}
    written = write_gains([record], tmp_path / "gains.yaml")
    assert load_config(tmp_path / "gains.yaml", LadderGains) == written
    assert written.predictive.lateral == 33.0
    assert written.yaw_rate == ladder_gains().yaw_rate


def test_shipped_gains_are_those_of_the_record():
    records = json.loads(gains_file().with_name("gain_search.json").read_text())
    gains = ladder_gains()
    assert {record["controller"] for record in records} == set(SPACES)
    for record in records:
        assert SPACES[record["controller"]].apply(gains, record["best"]) == gains
        assert record["stages"] == [list(stage) for stage in STAGES]


def test_unknown_names_are_one_sentence(tmp_path):
    with pytest.raises(InputError, match="B5"):
        check_names(["B1"])
    with pytest.raises(InputError, match="no controller"):
        check_names([])
    with pytest.raises(InputError, match="controller with gains"):
        GainSearch("B0", tmp_path / "journal")
