"""From a corrected simulator to a controller: draws, teaching, what is kept, what is remembered."""

import json
import os
import re
from dataclasses import asdict, replace

import numpy as np
import pytest

from ddagr_gym.adaptation import turns as turns_module
from ddagr_gym.adaptation.corrected import Corrected
from ddagr_gym.adaptation.files import as_json, deviations, summary
from ddagr_gym.adaptation.run import ADAPTABLE, adapted, refitted_prior, score, surely_better
from ddagr_gym.adaptation.teaching import taught
from ddagr_gym.adaptation.turns import CorrectedTurns, DrivenTurn, MeasuredTurns, sizes
from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.adapted_controller import NODES, AdaptedSettings
from ddagr_gym.evaluation.bundles import Bundle
from ddagr_gym.physics.effects import load_effects
from ddagr_gym.presets import ddagr, get_soil


def turn(error=0.01, lateral=0.02, heading=0.0, success=True):
    return DrivenTurn(0, "left", error, success, lateral, heading, None)


def test_sizes_are_drawn_from_their_intervals(on_a_slope):
    drawn = [on_a_slope.draw_effects(np.random.default_rng(n))[0] for n in range(200)]
    angles = np.array([item.angle for item in drawn])
    assert (angles.min(), angles.max()) == (0.045, 0.055)
    assert np.mean(angles) == pytest.approx(0.05, abs=0.0005)
    assert {item.direction for item in drawn} == {0.0}  # no interval, no draw


def test_intervals_belong_to_their_effects():
    with pytest.raises(InputError, match="2 sets of intervals for 1 effects"):
        Corrected(ddagr(), get_soil("thesis_a1"), load_effects(["slope=0.05"]), ({}, {}))


def test_a_turn_is_driven_once_and_goes_on_from_its_file(on_a_slope, tmp_path):
    bundle = Bundle(AdaptedSettings(), ddagr(), get_soil("thesis_a1"))
    journal = tmp_path / "turns.jsonl"
    first = MeasuredTurns(CorrectedTurns(on_a_slope), journal).measure(bundle, 0)
    journal.write_text(journal.read_text() + '{"key": "cut o')
    again = MeasuredTurns(CorrectedTurns(on_a_slope), journal)
    again.turns.drive = lambda *_: pytest.fail("driven twice")
    assert again.measure(bundle, 0) == first
    assert len(first.curvature) == NODES
    assert first.side == "left"


def test_what_is_driven_after_a_cut_off_line_is_kept(on_a_slope, tmp_path, monkeypatch):
    bundle, journal = Bundle(AdaptedSettings(), ddagr(), get_soil("thesis_a1")), tmp_path / "turns.jsonl"
    journal.write_text('{"key": "cut o')
    monkeypatch.setattr(
        turns_module, "judged", lambda columns, commanded, robot, number: replace(turn(), number=number)
    )
    monkeypatch.setattr(CorrectedTurns, "drive", lambda *_: {})
    turns = MeasuredTurns(CorrectedTurns(on_a_slope), journal)
    driven = [turns.measure(bundle, number) for number in (0, 1)]
    again = MeasuredTurns(CorrectedTurns(on_a_slope), journal)
    monkeypatch.setattr(CorrectedTurns, "drive", lambda *_: pytest.fail("driven twice"))
    assert [again.measure(bundle, number) for number in (0, 1)] == driven


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("3\n", "line 1 holds no mapping"),
        ("[" * 100_000, "line 1 holds no mapping"),
        ('{"turn": {}}', "'key'"),
        ('{"key": "a", "turn": {"number": 0}}', "missing required field `side`"),
        ('{"key": "a", "turn": 3}', "Expected `object`"),
        (json.dumps({"key": "a", "turn": asdict(turn(error="far"))}), "Expected `float | null`"),
    ],
)
def test_a_journal_of_something_else_is_one_sentence(text, reason, on_a_slope, tmp_path):
    journal = tmp_path / "turns.jsonl"
    journal.write_text(text)
    with pytest.raises(InputError, match=f"is no journal of driven turns .*{re.escape(reason)}.*: delete it"):
        MeasuredTurns(CorrectedTurns(on_a_slope), journal)


def test_a_pipe_is_no_journal(on_a_slope, tmp_path):
    os.mkfifo(tmp_path / "turns.jsonl")
    with pytest.raises(InputError, match="it is not a regular file"):
        MeasuredTurns(CorrectedTurns(on_a_slope), tmp_path / "turns.jsonl")


def test_teaching_removes_what_a_slope_does(on_a_slope):
    bundle = Bundle(AdaptedSettings(), ddagr(), get_soil("thesis_a1"), on_a_slope.effects)
    turns = MeasuredTurns(CorrectedTurns(on_a_slope))
    before = turns.measure(bundle, 8)
    after = turns.measure(taught(bundle, turns, (0, 2), 2), 8)
    assert abs(before.heading) > 0.2
    assert abs(after.heading) < 0.6 * abs(before.heading)
    assert np.ptp(after.curvature) < np.ptp(before.curvature)


def test_the_best_is_kept_and_told(on_a_slope, little):
    turns = MeasuredTurns(CorrectedTurns(on_a_slope))
    found = adapted(on_a_slope, ddagr(), get_soil("thesis_a1"), turns, controller="B4", effort=little)
    assert found.kept == min(found.scores, key=found.scores.get)
    assert found.kept != "nominal"  # which fails all turns on this slope
    assert found.used == ("slope",)
    assert score(found.after) < score(found.before)
    written = json.loads(json.dumps(as_json(found, on_a_slope)))
    assert written["before"]["turns"] == little.report
    assert written["after"]["success"]["value"] >= written["before"]["success"]["value"]


@pytest.mark.parametrize("controller", ADAPTABLE)
def test_knowledge_that_misleads_is_not_kept(controller, little, on_a_slope):
    """The turns are those of a robot whose gyro is right; the diagnosis says that it is not."""
    right = replace(on_a_slope, effects=(), intervals=())
    wrong = replace(right, effects=load_effects(["gyro_scale=1.3"]))
    turns = MeasuredTurns(CorrectedTurns(right))
    effort = replace(little, taught=0, report=0)
    found = adapted(wrong, ddagr(), get_soil("thesis_a1"), turns, controller=controller, effort=effort)
    assert found.scores["known"] > found.scores["nominal"]
    assert found.kept == "nominal"
    assert found.used == ()
    assert as_json(found, wrong)["after"] is None


@pytest.mark.parametrize("controller", ADAPTABLE)
def test_the_counted_turns_are_those_that_are_asked_for(controller, on_a_slope, little):
    asked = []
    turns = MeasuredTurns(CorrectedTurns(on_a_slope), progress=lambda: asked.append(1))
    adapted(on_a_slope, ddagr(), get_soil("thesis_a1"), turns, controller=controller, effort=little)
    assert len(asked) == little.turns(controller)


def test_the_tracker_keeps_gains_that_are_better_there(little):
    """A gyro that reads too much, which the tracker knows, and motors that are late, which only turns can tell."""
    effects = load_effects(["gyro_scale=1.08"])
    corrected = Corrected(ddagr(), get_soil("thesis_a1"), effects, ({},), ("gyro_scale",), sentence="A test.")
    turns = MeasuredTurns(CorrectedTurns(corrected))
    found = adapted(corrected, ddagr(), get_soil("thesis_a1"), turns, controller="B6", effort=little)
    assert set(found.scores) == {"nominal", "known", "tuned"}
    assert found.kept in ("known", "tuned")
    assert found.used == ("gyro_scale",)
    assert found.bundle.adapted_from == "B6"
    assert abs(found.after[0].heading) < 0.5 * abs(found.before[0].heading)
    assert set(found.search["best"]) == {"proportional", "course", "ahead"}


@pytest.mark.parametrize(
    ("gained", "sure"),
    [((0.01, 0.01, 0.01, 0.01), True), ((0.05, -0.04, 0.03, 0.0), False), ((-0.01,) * 4, False), ((0.0,) * 4, False)],
)
def test_gains_are_better_where_their_turns_can_tell(gained, sure):
    """By hand: means 0.01, 0.01, -0.01 and 0; t at 95 % for 4 turns is 2.35, and the second mean's error is 0.02."""
    driven = [turn(error=0.06 - value) for value in gained]
    assert surely_better(driven, [turn(error=0.06)] * 4) is sure


def test_a_failed_turn_costs_more_than_any_error():
    failed = [turn(error=0.0, success=False)] * 3
    assert surely_better([turn(error=None)] * 3, failed) is False
    assert surely_better([turn(error=0.5), turn(error=0.6), turn(error=0.7)], failed)


def test_another_controller_is_one_sentence(on_a_slope):
    with pytest.raises(InputError, match="'B5'"):
        adapted(on_a_slope, ddagr(), get_soil("thesis_a1"), MeasuredTurns(CorrectedTurns(on_a_slope)), controller="B5")


def test_the_prior_follows_the_soil():
    soil = get_soil("thesis_a1")
    strong = replace(soil, cohesion=2.0 * soil.cohesion, friction_angle=1.3 * soil.friction_angle)
    weak_prior, strong_prior = (refitted_prior(ddagr(), item, 0.5) for item in (soil, strong))
    assert strong_prior.traction_limit_over_load > 1.2 * weak_prior.traction_limit_over_load


def test_summary_by_hand():
    driven = [turn(0.01), turn(-0.03), turn(None, None, None, False)]
    assert sizes(driven).tolist() == [0.01, 0.03, 1.0]
    assert deviations([turn(heading=np.pi / 2), turn(None, None, None)], 0.33).tolist() == pytest.approx([0.35, 1.0])
    found = summary(driven, 0.33)
    assert (found["radius_error"]["value"], found["turns"]) == (0.03, 3)
    assert found["success"]["value"] == pytest.approx(2 / 3, abs=1e-4)


def test_a_soil_that_does_not_carry_the_robot_is_refused_in_one_sentence():
    soil = get_soil("thesis_a1")
    mud = replace(
        soil,
        cohesion=0.03 * soil.cohesion,
        cohesive_modulus=0.03 * soil.cohesive_modulus,
        frictional_modulus=0.03 * soil.frictional_modulus,
    )
    with pytest.raises(InputError, match="carries the ddagr in no turn"):
        refitted_prior(ddagr(), mud, 0.5)
