"""Frozen scenarios and the campaign over them."""

import json
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.plants import WEAK_MOTORS
from benchmarks.scenario_sets import PLANS, as_scenario, draw_set
from ddagr_gym.errors import InputError
from ddagr_gym.evaluation import campaign
from ddagr_gym.evaluation import scenarios as scenario_module
from ddagr_gym.evaluation.campaign import (
    drive_scenario,
    drive_scenarios,
    episode_row,
    plan,
    run_campaign,
    scenario_settings,
    wanted_episodes,
)
from ddagr_gym.evaluation.controllers import (
    BOUNDS,
    controller_names,
    controller_title,
    find_batch,
    find_controller,
    is_deployable,
    needs_filter,
)
from ddagr_gym.evaluation.dataset import EpisodeDataset
from ddagr_gym.evaluation.scenarios import load_scenarios, save_scenarios, scenario_names
from ddagr_gym.evaluation.summary import summaries
from ddagr_gym.physics.effects.slope import Slope
from ddagr_gym.physics.soil_laws import LAW
from ddagr_gym.policies.archive import Policy, save_policy
from ddagr_gym.policies.design import PolicyDesign
from ddagr_gym.tasks import FailedTasksError
from tests.needs_ray import NEEDS_RAY


@pytest.fixture
def frozen(tmp_path, monkeypatch):
    """A folder with three scenarios in range, frozen, and one on another soil law."""
    folder = tmp_path / "scenarios"
    monkeypatch.setattr(scenario_module, "scenario_folder", lambda: folder)
    monkeypatch.setitem(PLANS, "V", PLANS["V"].__class__("three", 3, PLANS["V"].draw))
    drawn = draw_set("V")
    save_scenarios("V", "three", drawn)
    save_scenarios("T", "one", drawn[:1], law=LAW)
    return folder


def test_a_set_reads_back_as_it_was_drawn(frozen):
    assert scenario_names() == ("T", "V")
    for number, (loaded, drawn) in enumerate(zip(load_scenarios("V"), draw_set("V"), strict=True)):
        seed, episode, recipe = drawn
        expected = as_scenario("V", number, seed, episode, recipe)
        assert loaded.seed == expected.seed
        assert loaded.episode.turn == expected.episode.turn
        assert loaded.episode.robot == expected.episode.robot
        assert loaded.episode.soils == expected.episode.soils
        assert loaded.episode.sensors == expected.episode.sensors
        np.testing.assert_array_equal(loaded.episode.field.values, expected.episode.field.values)


def test_effects_and_drivetrain_of_a_scenario_read_back(frozen):
    drawn = draw_set("V")
    weak = [
        (seed, replace(episode, robot=replace(episode.robot, drivetrain=WEAK_MOTORS)), recipe)
        for seed, episode, recipe in drawn
    ]
    effects = [(Slope(0.05, 1.0 + number),) for number in range(len(weak))]
    save_scenarios("S1", "on a slope", weak, effects=effects)
    loaded = load_scenarios("S1")
    assert [scenario.effects for scenario in loaded] == effects
    assert {scenario.episode.robot.drivetrain for scenario in loaded} == {WEAK_MOTORS}
    assert [scenario.effects for scenario in load_scenarios("V")] == [()] * len(drawn)
    assert scenario_settings(loaded[1]).effects == effects[1]


def test_turns_with_other_effects_are_driven_apart(frozen):
    """A batch has one set of effects: each turn must come out as if driven alone."""
    drawn = draw_set("V")
    save_scenarios("S1", "on slopes", drawn, effects=[(Slope(0.05, 2.0 * number),) for number in range(len(drawn))])
    scenarios = load_scenarios("S1")
    together = drive_scenarios("ppo_raw", scenarios)
    alone = [drive_scenarios("ppo_raw", [scenario])[0] for scenario in scenarios]
    for first, second in zip(together, alone, strict=True):
        assert first.ending == second.ending
        np.testing.assert_array_equal(first.columns["true_x"], second.columns["true_x"])
    assert not np.array_equal(together[0].columns["true_x"][:50], together[1].columns["true_x"][:50])


def test_unknown_set_lists_the_names(frozen):
    with pytest.raises(InputError, match="V"):
        load_scenarios("S9")


@pytest.mark.parametrize("name", PLANS)
def test_every_plan_draws_what_it_says(name):
    plan_ = PLANS[name]
    first = [plan_.draw(np.random.default_rng([1, n]), n) for n in range(4)]
    again = [plan_.draw(np.random.default_rng([1, n]), n) for n in range(4)]
    assert first == again
    for episode, recipe in first:
        assert episode.turn.duration < 25.0
        assert recipe.kind in ("uniform", "random", "step", "patch")


def test_campaign_resumes_where_it_stopped(frozen, tmp_path):
    folder = tmp_path / "episodes"
    whole = run_campaign(["B0", "B1"], ["V"], folder, processes=1)
    assert [(row["controller"], row["number"]) for row in whole] == [(c, n) for c in ("B0", "B1") for n in range(3)]
    parts = EpisodeDataset(folder).parts()
    assert len(parts) == 2 + len(BOUNDS)
    parts[0].unlink()
    (parts[1].parent / ".part-cut-off.parquet").write_bytes(parts[1].read_bytes()[:100])  # killed while it was written
    counted = []
    again = run_campaign(["B0", "B1"], ["V"], folder, processes=1, progress=counted.append)
    assert again == whole
    assert counted[0] == 3 * (1 + len(BOUNDS))
    assert sum(counted) == 3 * (2 + len(BOUNDS))
    assert EpisodeDataset(folder).parts() == parts


def test_rows_of_an_earlier_version_are_taken_over(frozen, tmp_path):
    whole = run_campaign(["B1"], ["V"], tmp_path / "new" / "episodes", processes=1)
    rows = EpisodeDataset(tmp_path / "new" / "episodes").read()
    journal = tmp_path / "old" / "episodes.jsonl"
    journal.parent.mkdir()
    text = "".join(json.dumps(row) + "\n" for row in rows)
    journal.write_text(text + '{"controller": "cut o')
    counted = []
    again = run_campaign(["B1"], ["V"], journal.with_name("episodes"), processes=1, progress=counted.append)
    assert again == whole
    assert counted == [len(rows)]
    assert journal.read_text().startswith(text)


def test_a_campaign_does_not_touch_the_rows_of_another(frozen, tmp_path):
    first = run_campaign(["B0"], ["V"], tmp_path / "rows", processes=1)
    run_campaign(["B1"], ["V"], tmp_path / "rows", processes=1)
    assert run_campaign(["B0"], ["V"], tmp_path / "rows", processes=1) == first


def test_two_workers_find_the_same(frozen, tmp_path):
    one = run_campaign(["B1"], ["V"], tmp_path / "one", processes=1)
    assert run_campaign(["B1"], ["V"], tmp_path / "two", processes=2) == one


@pytest.mark.slow
@pytest.mark.ray
@NEEDS_RAY
def test_a_cluster_finds_the_same(frozen, tmp_path):
    one = run_campaign(["B1", "ppo_ekf"], ["V"], tmp_path / "one", processes=1)
    assert run_campaign(["B1", "ppo_ekf"], ["V"], tmp_path / "two", processes=2, cluster="local") == one


def test_a_failed_episode_is_named_and_the_others_are_kept(frozen, tmp_path, monkeypatch):
    original = campaign.drive_scenario

    def drive(name, scenario):
        if name == "B2":
            raise ZeroDivisionError("a wheel of radius 0")
        return original(name, scenario)

    monkeypatch.setattr(campaign, "drive_scenario", drive)
    with pytest.raises(FailedTasksError, match=r"B2 on V 0 to 2: raised \(ZeroDivisionError"):
        run_campaign(["B2", "B1"], ["V"], tmp_path / "rows", processes=1)
    kept = {row["controller"] for row in EpisodeDataset(tmp_path / "rows").read()}
    assert kept == {"B1", *BOUNDS}


def test_rows_of_other_gains_are_driven_again(frozen, tmp_path, monkeypatch):
    folder = tmp_path / "episodes"
    run_campaign(["B1", "B2"], ["V"], folder, processes=1)
    driven = []
    original = campaign.drive_scenario
    monkeypatch.setattr(
        campaign, "drive_scenario", lambda name, scenario: driven.append(name) or original(name, scenario)
    )
    run_campaign(["B1", "B2"], ["V"], folder, processes=1)
    assert not driven
    version = campaign.controller_version
    monkeypatch.setattr(campaign, "controller_version", lambda name: version(name) + ("2" if name == "B2" else ""))
    run_campaign(["B1", "B2"], ["V"], folder, processes=1)
    assert driven == ["B2"] * 3


def test_a_scenario_is_feasible_if_one_bound_makes_it():
    rows = [
        {"controller": name, "set": "V", "number": number, "success": success}
        for name, number, success in [
            ("true_path", 0, False), ("true_soil", 0, True), ("true_path", 1, False), ("true_soil", 1, False),
            ("B1", 0, False), ("B1", 1, True),
        ]
    ]  # fmt: skip
    judged = campaign._judged(rows, ["B1"], ["V"])
    assert [row["feasible"] for row in judged] == [True, False]
    assert {row["controller"] for row in judged} == {"B1"}


def test_only_the_first_episodes_when_asked(frozen, tmp_path):
    rows = run_campaign(["B1"], ["V"], tmp_path / "journal", processes=1, count=2)
    assert [row["number"] for row in rows] == [0, 1]
    with pytest.raises(InputError, match="at least 1"):
        wanted_episodes(["B1"], ["V"], 0)


def test_plan_leaves_out_what_is_done(frozen):
    tasks = plan(["B0"], ["V"], {("B0", "V", 1)})
    assert [task.numbers for task in tasks] == [(0, 2)]


def test_the_bound_that_knows_one_law_is_left_out_on_another(frozen):
    driven = {(controller, name) for controller, name, _ in wanted_episodes(["B1", "true_soil"], ["V", "T"])}
    assert driven == {("B1", "V"), ("true_soil", "V"), ("B1", "T")}


def test_another_law_gives_another_drive(frozen):
    nominal, other = load_scenarios("V")[0], load_scenarios("T")[0]
    assert nominal.episode.soils == other.episode.soils
    rows = [episode_row("B1", scenario, drive_scenario("B1", scenario)) for scenario in (nominal, other)]
    assert abs(rows[0]["radius_error"] - rows[1]["radius_error"]) > 0.01


def test_rows_are_plain_numbers(frozen):
    scenario = load_scenarios("V")[0]
    row = episode_row("B4", scenario, drive_scenario("B4", scenario))
    assert json.loads(json.dumps(row)) == row
    assert row["success"] is True
    assert abs(row["estimator_radius"]) < 0.2
    assert 0.5 < row["estimator_innovation"] < 2.0


def test_every_controller_of_the_ladder_acts(frozen):
    scenario = load_scenarios("V")[0]
    for name in controller_names():
        run = drive_scenario(name, scenario)
        assert run.ending in (0, 1, 3)
        assert np.abs(run.columns["command_right"]).max() <= 2.0


def test_bounds_are_marked():
    for name in controller_names():
        assert is_deployable(name) == (name not in BOUNDS)
        assert ("not deployable" in controller_title(name)) == (name in BOUNDS)
        assert name.startswith("true_") == (name in BOUNDS)


def test_unknown_controller_lists_the_closest(frozen):
    with pytest.raises(InputError, match="true_curvature"):
        find_controller("true_curve", load_scenarios("V")[0].episode.turn)


@pytest.fixture
def policy_path(tmp_path):
    """An untrained policy in a file, as training writes one."""
    design = PolicyDesign(features="ekf")
    size, rng = len(design.inputs), np.random.default_rng(4)
    record = {"algorithm": "ppo", "seed": 7, "steps": 1, "digest": "0" * 64, "version": "0"}
    policy = Policy(
        design=design,
        weights=(0.01 * rng.standard_normal((2, size)).astype(np.float32),),
        biases=(np.zeros(2, dtype=np.float32),),
        mean=np.zeros(size),
        deviation=np.ones(size),
        training=record,
    )
    return save_policy(policy, tmp_path / "ppo_untrained_seed_7.npz")


@pytest.mark.parametrize("estimate", ["", "@feed_forward"])
def test_policies_drive_side_by_side_what_they_drive_alone(frozen, policy_path, estimate):
    name, scenarios = f"{policy_path}{estimate}", load_scenarios("V")
    together = drive_scenarios(name, scenarios)
    assert len({len(run.columns["t"]) for run in together}) > 1  # they end at different times
    for scenario, run in zip(scenarios, together, strict=True):
        alone = drive_scenario(name, scenario)
        assert run.episode == alone.episode
        assert (run.ending, run.success, run.total_reward) == (alone.ending, alone.success, alone.total_reward)
        assert run.columns.keys() == alone.columns.keys()
        for column, values in alone.columns.items():
            np.testing.assert_array_equal(run.columns[column], values)


def test_grids_of_different_shapes_are_driven_side_by_side_too(tmp_path, monkeypatch, policy_path):
    monkeypatch.setattr(scenario_module, "scenario_folder", lambda: tmp_path / "scenarios")
    drawn = draw_set("S8")[:2]
    save_scenarios("S8", "two", [drawn[0], drawn[1], drawn[0]])
    scenarios = load_scenarios("S8")
    assert len({scenario.episode.field.values.shape for scenario in scenarios}) == 2
    runs = drive_scenarios(str(policy_path), scenarios)
    for scenario, run in zip(scenarios, runs, strict=True):
        assert run.episode == scenario.episode
        np.testing.assert_array_equal(
            run.columns["true_y"], drive_scenario(str(policy_path), scenario).columns["true_y"]
        )


def test_what_wants_the_truth_drives_alone(frozen, policy_path):
    assert find_batch(str(policy_path), 3) is not None
    for name in ("B4", f"{policy_path}@true"):
        assert find_batch(name, 3) is None
    with pytest.raises(InputError, match="frozen"):
        find_batch(f"{policy_path}@frozem", 3)
    sizes = {task.controller: len(task.numbers) for task in plan([str(policy_path), "B4"], ["V"], set())}
    assert sizes == {str(policy_path): 3, "B4": 3}


def test_a_policy_is_driven_like_a_controller(frozen, tmp_path, policy_path):
    rows = run_campaign([str(policy_path), "B1"], ["V"], tmp_path / "journal", processes=1, count=1)
    arm = str(policy_path.parent / "ppo_untrained")
    assert (rows[0]["arm"], rows[0]["run"]) == (arm, 7)
    assert (rows[1]["arm"], rows[1]["run"]) == ("B1", 0)
    assert arm in summaries(rows)
    assert needs_filter(str(policy_path))
    assert is_deployable(str(policy_path))
    assert not is_deployable(f"{policy_path}@true")
    assert "learned" in controller_title(str(policy_path))
