"""The set of changed pairs: what it holds, what its drives show, and how answers are scored."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.changed_pairs import __main__ as command
from benchmarks.changed_pairs import answers as answering
from benchmarks.changed_pairs.drives import label_of, simulate
from benchmarks.changed_pairs.figure import draw
from benchmarks.changed_pairs.plan import BEGINNING, HIDDEN, SINGLES, SWITCHED, plan
from benchmarks.changed_pairs.robots import ROBOTS, simulated_robot
from benchmarks.changed_pairs.score import score, sure_and_wrong
from benchmarks.concealed.cases import ALL_STRUCTURES
from benchmarks.concealed.catalogue import LIBRARY_FORMS, least_size
from benchmarks.concealed.change import Site, with_ground
from benchmarks.concealed.drive import SAMPLE_PERIOD, SUBSTEPS, drive
from benchmarks.concealed.plant import nominal_plant
from benchmarks.mid_drive_drives import driven, with_state_of
from ddagr_gym.errors import InputError
from ddagr_gym.physics.effects.registry import effect_kinds
from ddagr_gym.presets import get_robot


def finding(name, others=(), **sizes):
    """Part of an answer."""
    names = (name, *others)
    return {
        "name": name,
        "equivalence_set": {item: 1.0 / len(names) for item in names},
        "parameters": {field: {"value": value, "interval": interval} for field, (value, interval) in sizes.items()},
    }


def answer(*findings, complete=True, detectable=None):
    """An answer with names, or none."""
    verdict = [item["name"] for item in findings] or ["none"]
    return {"verdict": verdict, "complete": complete, "findings": list(findings), "detectable": detectable or {},
            "seconds": 1.0}  # fmt: skip


def label(kind, *effects, begins=None):
    """A label with effects (name, parameters)."""
    verdict = [name for name, _ in effects] or ["none"]
    entries = [{"name": n, "variant": "", "tag": "same", "parameters": p} for n, p in effects]
    return {"kind": kind, "verdict": verdict, "effects": entries, "structure": "", "begins": begins}


def test_a_set_holds_what_the_plan_says():
    pairs = plan(3)
    kinds = Counter(pair.kind for pair in pairs)
    assert kinds == {
        "null": 20, "structural null": 20, "single": SINGLES, "double": 24, "outside": 24, "beginning": BEGINNING,
    }  # fmt: skip
    singles = Counter(pair.case.verdict[0] for pair in pairs if pair.kind == "single")
    assert set(singles) == set(LIBRARY_FORMS) <= set(effect_kinds())
    assert all(singles[name] == 6 for name in HIDDEN)
    assert all(singles[name] in (2, 3) for name in singles if name not in HIDDEN)
    assert {pair.case.verdict[0] for pair in pairs if pair.begins is not None} == set(SWITCHED)
    assert [pair.case.number for pair in pairs] == list(range(1, 209))
    assert plan(3) == pairs
    assert plan(4) != pairs


@pytest.mark.slow
def test_drives_of_a_pair_are_on_one_field_and_show_what_changed_from_its_time_on():
    (pair, *_) = (pair for pair in plan(3) if pair.begins is not None and pair.case.verdict == ["gyro_bias"])
    before, after = simulate(pair, 3)
    told = label_of(pair, 3)
    assert [len(log["t"]) for log in before] == [3000] * 3
    assert told["kind"] == "beginning"
    bare = simulate(replace(pair, case=replace(pair.case, effects=()), begins=None), 3)[1]
    late = np.arange(len(after["t"])) >= round(pair.begins / SAMPLE_PERIOD)
    gap = after["imu_gz"] - bare["imu_gz"]
    np.testing.assert_array_equal(gap[~late], 0.0)
    bias = told["effects"][0]["parameters"]["bias"]
    assert np.mean(gap[late]) == pytest.approx(bias, rel=0.2)
    distance = np.hypot(np.nanmean(after["x"]) - np.nanmean(before[0]["x"]), np.nanmean(after["y"]))
    assert distance > 5.0


def test_ruts_that_are_there_after_leave_the_state_of_the_robot_before_as_it_is():
    bare = nominal_plant()
    full = with_ground(bare, rut_mode=2, rut_gain=1.0)
    quiet = with_state_of(full, bare)
    commands, start = np.full((100 * SUBSTEPS, 2), 2.0), np.zeros(3)
    before, after = driven(quiet, full, 100, commands, start), drive(bare, commands, start)
    for name in ("x", "sinkage_3", "torque_left"):
        np.testing.assert_allclose(before[name], after[name], rtol=1e-9, atol=1e-12)
    changed = driven(quiet, full, 0, np.full((300 * SUBSTEPS, 2), 2.0), start)
    assert changed["sinkage_3"][-1] < 0.6 * changed["sinkage_1"][-1]


def test_nothing_that_changes_in_a_second_drive_is_drawn():
    forms = {(form.name, form.variant) for pair in plan(3) for form, _ in pair.case.effects}
    assert ("soil_change", "onset") not in forms
    assert {pair.case.structure for pair in plan(3) if pair.kind == "structural null"} == set(ALL_STRUCTURES) - {""}


@pytest.mark.slow
@pytest.mark.parametrize(("robot", "turning"), [("ddagr", 0.17), ("warthog", 0.14), ("husky", 0.14)])
def test_every_robot_drives_the_programme_and_turns_less_than_without_slip(robot, turning):
    (pair, *_) = (pair for pair in plan(3, robot) if pair.kind == "null")
    before, after = simulate(pair, 3)
    for log in (*before[1:], after):
        assert np.sqrt(np.mean((log["enc_right"] - log["cmd_right"]) ** 2)) < 0.1
        sides = log["enc_right"] - log["enc_left"]
        assert np.sum(log["imu_gz"] * sides) / np.sum(sides**2) == pytest.approx(turning, abs=0.03)
        sheet = get_robot(robot)
        assert turning < sheet.outer_radius / (2.0 * sheet.half_track)


def test_sets_of_different_robots_are_drawn_apart_and_sizes_grow_with_the_robot():
    labels = {robot: [pair.case.verdict for pair in plan(3, robot)] for robot in ROBOTS}
    assert labels["ddagr"] != labels["warthog"] != labels["husky"]
    assert simulated_robot("warthog").size_factor("payload") == pytest.approx(470.0 / 168.0)
    assert simulated_robot("ddagr").size_factor("payload") == 1.0
    assert simulated_robot("husky").size_factor("gyro_bias") == 1.0


def test_a_change_of_a_robots_body_starts_from_that_robot():
    pairs = [pair for pair in plan(3, "husky") if pair.case.verdict == ["payload"]]
    plant = simulated_robot("husky").put_into(nominal_plant())
    (form, size), site = pairs[0].case.effects[0], Site(())
    change = form.build(size * least_size(form), np.random.default_rng(0), site)
    assert change.plant(plant).body.mass == 75.0 + change.parameters["mass"]
    assert change.plant(plant).body.half_track == plant.body.half_track


def test_results_of_different_robots_have_files_of_their_own():
    assert answering.result_of("ddagr") == answering.RESULT
    assert len({answering.result_of(robot) for robot in ROBOTS}) == len(ROBOTS)


def test_an_unknown_robot_is_refused():
    with pytest.raises(InputError, match="ddagr, warthog, husky"):
        plan(3, "jackal")


@pytest.mark.slow
def test_motors_that_weaken_in_mid_drive_leave_the_drive_before_as_it_was():
    (pair, *_) = (pair for pair in plan(3) if pair.begins is not None and pair.case.verdict == ["payload"])
    after = simulate(pair, 3)[1]
    bare = simulate(replace(pair, case=replace(pair.case, effects=()), begins=None), 3)[1]
    switch = round(pair.begins / SAMPLE_PERIOD)
    np.testing.assert_array_equal(after["enc_right"][:switch], bare["enc_right"][:switch])
    assert np.any(after["enc_right"][switch:] != bare["enc_right"][switch:])


def test_figures_count_what_they_say():
    bias = {"bias": 0.01}
    labels = {
        "pair_1": label("null"),
        "pair_2": label("structural null"),
        "pair_3": label("single", ("gyro_bias", bias)),
        "pair_4": label("single", ("gyro_bias", bias)),
        "pair_5": label("single", ("payload", {"mass": 20.0})),
        "pair_6": label("beginning", ("gyro_bias", bias), begins=30.0),
        "pair_7": label("double", ("gyro_bias", bias), ("slope", {"angle": 0.05})),
    }
    least = {"gyro_bias": {"bias": 0.002}, "payload": {"mass": 15.0}}
    timed = finding("gyro_bias") | {"onset": {"interval": [28.0, 32.0]}}
    answers = {
        "pair_1": answer(),
        "pair_2": answer(finding("slope")),
        "pair_3": answer(finding("gyro_bias", bias=(0.011, [0.009, 0.013])), detectable=least),
        "pair_4": answer(finding("slope", ["gyro_bias"]), detectable=least),
        "pair_5": answer(detectable=least),
        "pair_6": answer(timed, detectable=least),
        "pair_7": answer(finding("gyro_bias", bias=(0.02, [0.018, 0.022]))),
    }
    found = score(labels, answers)
    assert {name: found[name]["value"] for name in ("false_alarms", "false_alarms_structural")} == {
        "false_alarms": 0.5, "false_alarms_structural": 1.0,
    }  # fmt: skip
    assert found["right_name"]["count"] == 3
    assert found["right_name"]["value"] == pytest.approx(1.0 / 3.0)
    assert found["in_set"]["value"] == pytest.approx(2.0 / 3.0)
    assert found["right_name_hidden"]["count"] == 0  # 20 kg is less than twice 15
    assert found["time_inside"]["value"] == 1.0
    assert found["both_of_double"]["value"] == 0.0
    assert found["one_of_double"]["value"] == 1.0
    assert found["interval_holds"]["value"] == 0.5
    assert found["sure_and_wrong"]["value"] == pytest.approx(1.0 / 7.0)
    assert [item["pair"] for item in found["failures"]] == ["pair_2", "pair_4", "pair_5", "pair_7"]


def test_a_wrong_name_beside_the_right_one_is_sure_and_wrong():
    told = label("single", ("gyro_bias", {"bias": 0.01}))
    assert sure_and_wrong(told, answer(finding("gyro_bias"), finding("slope")))
    assert not sure_and_wrong(told, answer(finding("gyro_bias"), finding("slope"), complete=False))
    assert not sure_and_wrong(told, answer(finding("slope", ["gyro_bias"])))


def test_another_seed_than_the_one_committed_to_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(answering, "COMMITMENT", tmp_path / "commitment.json")
    secret = tmp_path / "secret.json"
    assert command.main(["--draw", str(secret)]) == 0
    assert answering.secret_seed(secret) == json.loads(secret.read_text())["seed"]
    assert command.main(["--draw", str(secret)]) == 2
    other = tmp_path / "other.json"
    other.write_text('{"seed": 5}')
    with pytest.raises(InputError, match="another seed"):
        answering.secret_seed(other)
    assert command.main(["--secret", str(other)]) == 2
    assert "another seed" in capsys.readouterr().err


def test_the_picture_is_drawn(tmp_path):
    labels = {"pair_1": label("null"), "pair_2": label("single", ("gyro_bias", {"bias": 0.01}))}
    found = score(labels, {"pair_1": answer(), "pair_2": answer(finding("gyro_bias"))})
    draw(found, tmp_path / "pairs.png")
    assert (tmp_path / "pairs.png").stat().st_size > 10_000
