"""Effects of the library and parts of the drivetrain in the scores of the blind benchmark."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.changed_pairs.score import sure_and_wrong
from benchmarks.concealed.catalogue import DRIVETRAIN, DRIVETRAIN_FORMS, least_size
from benchmarks.concealed.change import Site
from benchmarks.concealed_figure import draw, tabled
from benchmarks.concealed_names import PART_FAMILIES, as_effects, rightly_named
from benchmarks.concealed_oracle import eligible
from benchmarks.score_concealed import against_targets, in_set, right, score, set_share
from ddagr_gym.diagnosis.answer.drivetrain import PART_TITLES
from ddagr_gym.physics.effects.registry import effect_kinds


def label(kind: str, *names: str, also: dict[str, list[str]] | None = None) -> dict[str, Any]:
    effects = [
        {"name": name, "variant": "form", "tag": "different", "parameters": {}}
        | ({"also": also[name]} if also and name in also else {})
        for name in names
        if name not in ("none", "unknown")
    ]
    return {"kind": kind, "verdict": list(names), "effects": effects, "structure": ""}


def answer(*names: str, sets: tuple[tuple[str, ...], ...] = (), complete: bool = True) -> dict[str, Any]:
    held = sets or tuple((name,) for name in names if name not in ("none", "unknown"))
    findings = [{"name": item[0], "equivalence_set": dict.fromkeys(item, 0.5), "parameters": {}} for item in held]
    return {"verdict": list(names), "complete": complete, "findings": findings, "seconds": 1.0}


def test_every_part_stands_for_effects_of_the_drivetrain_and_says_why() -> None:
    assert set(PART_FAMILIES) == set(PART_TITLES)
    for family in PART_FAMILIES.values():
        assert set(family.effects) <= set(DRIVETRAIN) <= set(effect_kinds())
        assert len(family.reason.split()) > 4
    assert not (set(PART_FAMILIES) & set(effect_kinds())) - {"command_delay"}


@pytest.mark.parametrize(
    ("truth", "said", "expected"),
    [
        ("motor_saturation", ("motor_saturation",), True),
        ("motor_saturation", ("torque_limit",), True),
        ("motor_saturation", ("power_limit", "no_load_speed", "limit_imbalance"), True),
        ("motor_saturation", ("turning_limit", "motor_saturation"), True),
        ("motor_saturation", ("command_ramp",), True),
        ("motor_lag", ("command_ramp",), True),
        ("motor_lag", ("speed_loop", "command_ramp"), True),
        ("motor_lag", ("motor_droop",), False),
        ("motor_lag", ("speed_loop", "load"), False),
        ("motor_droop", ("load", "integral", "integral_limit", "friction"), True),
        ("motor_droop", ("load", "power_limit"), False),
        ("motor_droop", ("command_ramp",), False),
        ("command_delay", ("command_delay",), True),
        ("command_delay", ("command_delay", "speed_limit"), False),
        ("command_deadband", ("friction",), False),
        ("gyro_scale", ("load",), False),
        ("motor_lag", ("unknown",), False),
        ("motor_lag", (), False),
        ("slope", ("slope", "slope"), False),
    ],
)
def test_a_part_counts_as_the_effect_that_it_stands_for(truth: str, said: tuple[str, ...], expected: bool) -> None:
    assert right(label("single", truth), answer(*said)) is expected


def test_parts_are_effects_once_and_other_names_stay() -> None:
    said = ("gyro_bias", "load", "integral", "command_ramp", "command_gain")
    assert as_effects(said) == ["gyro_bias", "command_gain", "motor_droop", "motor_lag"]
    wanted = [frozenset(("motor_saturation",))]
    assert as_effects(["command_ramp"], wanted) == ["motor_saturation"]
    assert as_effects(["motor_lag", "speed_loop"]) == ["motor_lag"]


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        (("motor_droop",), True),
        (("motor_lag",), True),
        (("motor_lag", "motor_droop"), True),
        (("speed_loop", "load", "integral"), True),
        (("motor_droop", "motor_saturation"), False),
        (("motor_saturation",), False),
    ],
)
def test_an_effect_with_two_right_names_may_have_either_or_both(said: tuple[str, ...], expected: bool) -> None:
    soft = label("single", "motor_droop", also={"motor_droop": ["motor_lag"]})
    assert rightly_named(soft, said) is expected


def test_each_effect_of_a_double_needs_a_name_of_its_own() -> None:
    both = label("double", "motor_droop", "motor_lag", also={"motor_droop": ["motor_lag"]})
    assert not rightly_named(both, ["motor_lag"])
    assert not rightly_named(both, ["motor_droop"])
    assert rightly_named(both, ["speed_loop", "load"])
    apart = label("double", "command_delay", "motor_saturation")
    assert rightly_named(apart, ["command_delay", "power_limit", "torque_limit"])
    assert not rightly_named(apart, ["command_delay", "power_limit", "load"])


def test_sets_hold_parts_as_effects() -> None:
    told = label("single", "motor_saturation")
    found = answer("load", "power_limit", sets=(("load",), ("power_limit", "torque_limit")))
    assert in_set(told, found)
    assert set_share(told, found) == 0.5
    assert not in_set(label("single", "motor_lag"), found)
    assert not in_set(told, answer("unknown"))


def test_figures_of_the_drivetrain_are_over_its_cases() -> None:
    labels = {
        "a": label("single", "motor_lag"),
        "b": label("single", "motor_saturation"),
        "c": label("single", "gyro_scale"),
        "d": label("double", "command_delay", "slope"),
        "e": label("double", "gyro_bias", "slope"),
        "n": label("null", "none"),
    }
    answers = {
        "a": answer("speed_loop"),
        "b": answer("load"),
        "c": answer("gyro_scale"),
        "d": answer("command_delay", "slope"),
        "e": answer("slope"),
        "n": answer("none"),
    }
    found = score(labels, answers)
    assert (found["top1_drivetrain"]["value"], found["top1_drivetrain"]["count"]) == (0.5, 2)
    assert (found["in_set_drivetrain"]["value"], found["in_set_drivetrain"]["count"]) == (0.5, 2)
    assert (found["top1_doubles_drivetrain"]["value"], found["top1_doubles_drivetrain"]["count"]) == (1.0, 1)
    assert found["top1"]["count"] == 3
    assert found["one_of_double"]["value"] == 1.0
    assert [entry["case"] for entry in found["failures"]] == ["b", "e"]


def test_faults_of_another_structure_count_whatever_the_size_of_an_effect_that_shows() -> None:
    """The sizes of the later forms mean nothing in the library, so that no limit of it can make them too small."""
    for form in (form for forms in DRIVETRAIN_FORMS.values() for form in forms if form.name != "command_delay"):
        change = form.build(form.low * least_size(form), np.random.default_rng(0), Site(()))
        told = label("single", form.name)
        told["effects"][0]["parameters"] = dict(change.parameters)
        missed = answer("none") | {"detectable": {form.name: dict.fromkeys(("lag", "droop", "width"), 1e3)}}
        assert score({"a": told}, {"a": missed})["top1"]["count"] == 1


def test_the_picture_has_a_place_for_parts_second_names_and_names_of_channels(tmp_path: Path) -> None:
    labels = {
        "a": label("single", "motor_droop", also={"motor_droop": ["motor_lag"]}),
        "b": label("single", "motor_droop"),
        "c": label("single", "gyro_sign"),
    }
    answers = {"a": answer("speed_loop"), "b": answer("load", "integral"), "c": answer("imu_upside_down")}
    rows = {name: (count, dict(said), truth) for name, (count, said, truth) in tabled(labels, answers).items()}
    assert rows == {
        "motor_droop or motor_lag": (1, {"motor_lag": 1}, ["motor_droop", "motor_lag"]),
        "motor_droop": (1, {"motor_droop": 1}, ["motor_droop"]),
        "gyro_sign": (1, {"another name": 1}, ["gyro_sign"]),
    }
    figures = score(labels, answers)
    draw(labels, answers, {**figures, "targets": against_targets(figures)}, tmp_path / "picture.png")
    assert (tmp_path / "picture.png").read_bytes()[:4] == b"\x89PNG"


def test_a_part_of_the_right_effect_is_no_sure_and_wrong_name_of_a_pair() -> None:
    told = label("single", "motor_saturation")
    assert not sure_and_wrong(told, answer("torque_limit"))
    assert sure_and_wrong(told, answer("load"))


def test_a_diagnosis_in_parts_is_not_the_model_that_an_oracle_fits() -> None:
    labels = {"a": label("single", "motor_saturation"), "b": label("single", "motor_saturation")}
    answers = {
        "a": answer("torque_limit") | {"fit": {"gain": {}}},
        "b": answer("motor_saturation") | {"fit": {"x": {}}},
    }
    same = {name: as_told for name, _, as_told in eligible(labels, answers, {})}
    assert same == {"a": False, "b": True}
