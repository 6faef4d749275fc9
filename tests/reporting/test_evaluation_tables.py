"""Tables of an evaluation's page by hand-made episodes."""

import math

import pytest

from ddagr_gym.evaluation.report_data import Arm, SetNote, badness, best_arm, judged_set
from ddagr_gym.evaluation.summary import summaries
from ddagr_gym.reporting.evaluation_tables import (
    answer_rows,
    claim_rows,
    claims_sentence,
    doubts,
    failure_rows,
    infeasible_sentence,
    learned_rows,
    radius_note,
    replay_command,
    sentence,
    set_matrix,
    transfer_rows,
    with_span,
    worst_rows,
)

from .evaluation_example import evaluation, rows_of


def test_the_answer_is_the_best_arm_that_can_be_deployed():
    found = evaluation()
    assert best_arm(found).name == "ppo_ekf"  # true_path is closer and sees the truth
    # |e_R| of 1, 1, 1, 2, 1, 2 %: the third smallest of six is 1 %, the largest 2 %
    assert sentence(found).startswith("ppo_ekf turns closest: half of its turns are within 1.0 % of the radius, 95 %")
    assert "within 2.0 %, and 100.0 % end" in sentence(found)
    assert [row["name"] for row in answer_rows(found, True) if row["best"]] == ["ppo_ekf"]
    assert [row["name"] for row in answer_rows(found, False)] == ["true_path"]


def test_a_failure_makes_the_percentile_fail():
    row = next(row for row in answer_rows(evaluation(), True) if row["name"] == "B1")
    assert row["cells"][1]["value"] == "failed"
    assert row["cells"][1]["span"].endswith("failed")
    assert row["cells"][3]["value"] == "50.0 %"  # 5, 4 and 3 % of six fit


def test_an_ablation_is_no_answer():
    rows = rows_of("ppo_ekf", [0.01, 0.02]) + rows_of("ppo_ekf@frozen", [0.001, 0.002])
    arms = [Arm("ppo_ekf", "learned", learned=True), Arm("ppo_ekf@frozen", "learned", learned=True)]
    found = evaluation(rows=rows, summary=summaries(rows), arms=arms)
    assert sentence(found).startswith("ppo_ekf turns closest")
    assert [row["name"] for row in answer_rows(found, True)] == ["ppo_ekf"]
    assert [row["name"] for row in learned_rows(found)] == ["ppo_ekf", "ppo_ekf@frozen"]
    assert not Arm("runs@home/policy.npz", "").ablation


def test_an_interval_around_one_half_is_said_to_decide_nothing():
    near = rows_of("ppo_ekf", [0.01, 0.04] * 20) + rows_of("B4", [0.03] * 40) + rows_of("B1", [0.2] * 40)
    arms = [Arm("B1", ""), Arm("B4", ""), Arm("ppo_ekf", "", learned=True)]
    text = doubts(evaluation(rows=near, summary=summaries(near), arms=arms))
    assert text.startswith("Paired, it is closer than B1 in 100 % of scenarios")
    assert text.endswith("Whether it is better than B4 is open: 50 % lies inside.")
    clear = [row for row in near if row["arm"] != "B4"]
    assert "open" not in doubts(evaluation(rows=clear, summary=summaries(clear), arms=[arms[0], arms[2]]))


def test_negative_intervals_are_read_as_such():
    assert with_span({"value": -0.05, "interval": [-0.06, -0.04]})["span"] == "-6.0 to -4.0"
    assert with_span({"value": 0.05, "interval": [0.04, 0.06]})["span"] == "4.0–6.0"
    assert with_span({"value": 0.05, "interval": None})["span"] == ""
    assert with_span(None)["value"] == "–"


def test_failures_are_worse_than_any_error_and_come_first():
    failed, wide, near = rows_of("B1", [None, 0.3, 0.01])
    assert sorted([near, wide, failed], key=badness) == [near, wide, failed]
    worst = worst_rows(evaluation())
    assert [row["arm"] for row in worst] == ["B1", "B4", *["ppo_ekf"] * 5, "true_path"]
    assert (worst[0]["scenario"], worst[0]["error"], worst[0]["exit"]) == ("S1 4", "undefined", "–")
    assert worst[0]["end"] == "left the headland"
    # set T counts too, but not its infeasible scenario with 20 %
    assert (worst[2]["scenario"], worst[2]["error"]) == ("T 0", "+10.0 %")


def test_the_command_is_one_word_however_the_policy_is_called():
    row = rows_of("runs/my policy.npz", [0.1])[0]
    assert replay_command(row) == "ddagr evaluate --replay 'runs/my policy.npz:S1:0'"


def test_failures_are_counted_with_their_causes():
    found = [row for row in failure_rows(evaluation()) if row["arm"] == "B1"]
    assert found[0]["count"] == "3 of 6"
    assert found[0]["why"] == "2 reached the row and did not fit it; 1 left the headland"
    assert (found[1]["set"], found[1]["count"]) == ("T", "1 of 2")


def test_claims_that_were_not_driven_are_counted_only():
    found = evaluation()
    assert [row["verdict"] for row in claim_rows(found)] == ["held", "not held"]
    assert claim_rows(found)[1]["measured"] == "failed"
    assert claims_sentence(found) == "1 held, 1 did not, 1 were not driven."


def test_transfer_compares_the_same_scenarios():
    rows = {row["name"]: row["cells"] for row in transfer_rows(evaluation())}
    assert set(rows) == {"B1", "ppo_ekf"}
    # S1 0 to 2: 9, 5 and 4 %; T without the infeasible one: 10 and 2 %
    assert rows["B1"] == ["5.0 %", "9.0 %", "66.7 %", "2.0 %", "10.0 %", "50.0 %"]


def test_learned_arms_stand_beside_the_headline():
    arms = [Arm("ppo_ekf", "learned", learned=True), Arm("ppo_raw", "raw", learned=True)]
    rows = rows_of("ppo_ekf", [0.01, 0.02]) + rows_of("ppo_raw", [0.1, 0.01])
    versus = {"value": 0.5, "interval": [0.1, 0.9]}
    found = evaluation(rows=rows, summary=summaries(rows), arms=arms, over_headline={"ppo_raw": versus})
    assert [row["headline"] for row in learned_rows(found)] == [True, False]
    assert [row["cells"][3] for row in learned_rows(found)] == [
        {"value": "–", "span": ""},
        {"value": "50 %", "span": "10–90"},
    ]


def test_the_headline_by_one_seed_stands_below_the_headline():
    rows = rows_of("ppo_ekf", [0.01, 0.02])
    alone = {"ppo_ekf, training seed 3 alone": summaries(rows)["ppo_ekf"]["S1"]}
    arms = [Arm("ppo_ekf", "learned", learned=True)]
    found = learned_rows(evaluation(rows=rows, summary=summaries(rows), arms=arms, headline_alone=alone))
    assert [row["name"] for row in found] == ["ppo_ekf", "ppo_ekf, training seed 3 alone"]
    assert [row["headline"] for row in found] == [True, False]
    assert found[1]["cells"][0]["value"] == "1.0 %"  # the lower of two


def test_the_radius_note_says_how_well_a_radius_is_defined():
    gaps = (0.002, 0.004, 0.03)
    turns = rows_of("B1", [0.01, 0.02, 0.03])
    rows = [row | {"radius_disagreement": gap} for row, gap in zip(turns, gaps, strict=True)]
    text = radius_note(evaluation(rows=rows, summary=summaries(rows), arms=[Arm("B1", "")], headline=""))
    assert "Of 3 episodes, 0 have no radius" in text
    assert "by 0.4 % in half of the successful turns" in text
    assert "more than 3.0 % in one of twenty" in text
    none = [row | {"success": False} for row in rows]
    assert "exact circle" not in radius_note(evaluation(rows=none, arms=[Arm("B1", "")], headline=""))


def test_sets_that_an_arm_did_not_drive_are_dashes():
    cells = {row["name"]: row["cells"] for row in set_matrix(evaluation(), "success_rate")}
    assert cells["B4"][1]["value"] == "–"
    assert cells["ppo_ekf"][1]["value"] == "50.0 %"


def test_nothing_feasible_has_no_answer():
    rows = rows_of("B1", [0.1, 0.2], infeasible=(0, 1))
    found = evaluation(
        rows=rows, summary=summaries(rows), arms=[Arm("B1", "")], sets=[SetNote("S1", "", 2, 2, "")], headline="",
        infeasible=[{"scenario": "S1 0"}, {"scenario": "S1 1"}],
    )  # fmt: skip
    assert "No scenario of set S1 can be made" in sentence(found)
    assert answer_rows(found, True)[0]["cells"][0]["value"] == "–"
    assert infeasible_sentence(found).startswith("2 of 2 scenarios are left out")


def test_it_is_said_how_often_a_scenario_without_a_bound_was_made():
    rows = rows_of("B1", [0.1, 0.2], infeasible=(0, 1))
    rows += [row | {"run": run} for run in (0, 1) for row in rows_of("ppo_ekf", [0.01, 0.2], infeasible=(0, 1))]
    found = evaluation(
        rows=rows, summary=summaries(rows), arms=[Arm("B1", ""), Arm("ppo_ekf", "", learned=True)],
        sets=[SetNote("S1", "", 2, 2, "")], infeasible=[{"scenario": "S1 0"}, {"scenario": "S1 1"}],
    )  # fmt: skip
    assert infeasible_sentence(found).endswith("makes them; ppo_ekf makes 50 % of those that it drove all the same.")


@pytest.mark.parametrize(("names", "judged"), [(("S0", "S1", "V"), "S1"), (("S0", "V"), "V"), (("S4", "T"), "S4")])
def test_the_set_in_range_answers(names, judged):
    assert judged_set(names) == judged


def test_infinity_is_the_size_of_no_radius():
    assert math.isinf(badness(rows_of("B1", [None])[0])[1])
