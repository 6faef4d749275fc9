"""Scores of answers against labels: figures, failures, targets, picture."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from benchmarks.concealed.commitments import commitment
from benchmarks.concealed_figure import tabled
from benchmarks.concealed_truth import size_errors
from benchmarks.score_concealed import (
    TARGETS,
    against_targets,
    main,
    mean,
    median,
    read_equivalents,
    score,
    share,
)
from ddagr_gym.errors import InputError


def label(kind: str, *names: str, **parameters: float) -> dict[str, Any]:
    effects = [
        {"name": n, "variant": "form", "tag": "same", "parameters": parameters}
        for n in names
        if n not in ("none", "unknown")
    ]
    return {"kind": kind, "verdict": list(names), "effects": effects, "structure": ""}


def answer(
    *verdict: str, complete: bool = True, interval: tuple[float, float] | None = None, **also: float
) -> dict[str, Any]:
    findings = [
        {"name": n, "equivalence_set": {n: 1.0, **also}, "parameters": {"delay": {"value": 0.1, "interval": interval}}}
        for n in verdict
        if n not in ("none", "unknown")
    ]
    return {"verdict": list(verdict), "complete": complete, "findings": findings, "seconds": 1.0}


def test_each_figure_counts_what_its_name_says() -> None:
    labels = {
        "a": label("null", "none"),
        "b": label("structural null", "none"),
        "c": label("single", "command_delay", delay=0.1),
        "d": label("single", "command_delay", delay=0.3),
        "e": label("double", "slope", "gyro_bias", delay=0.1),
        "f": label("outside", "unknown"),
        "g": label("outside", "unknown"),
    }
    answers = {
        "a": answer("none"),
        "b": answer("slope"),
        "c": answer("command_delay", interval=(0.05, 0.15)),
        "d": answer("motor_lag", interval=(0.05, 0.15), command_delay=0.4),
        "e": answer("gyro_bias", "slope"),
        "f": answer("unknown", complete=False),
        "g": answer("slope"),
    }
    found = score(labels, answers)
    assert found["false_alarm_rate"]["value"] == 0.5
    assert found["false_alarm_rate_structural"]["value"] == 1.0
    assert found["top1"] == found["top1_all_singles"]
    assert found["top1"]["value"] == 0.5
    assert found["in_set"]["value"] == 1.0
    assert found["top1_doubles"]["value"] == 1.0
    assert found["unknown_outside"]["value"] == 0.5
    assert found["confident_wrong"]["value"] == 0.5
    assert found["coverage"] == {**share([True]), "count": 1}
    assert [entry["case"] for entry in found["failures"]] == ["b", "d", "g"]


def test_effects_below_the_stated_limit_do_not_count_as_missed() -> None:
    labels = {"a": label("single", "command_delay", delay=0.1)}
    missed = {**answer("none"), "detectable": {"command_delay": {"delay": 0.2}}}
    assert score(labels, {"a": missed})["top1"]["count"] == 0
    assert score(labels, {"a": missed})["top1_all_singles"]["value"] == 0.0


def test_a_size_counts_as_detectable_by_its_distance_from_neutral() -> None:
    """ln(strength) = 0.2 is a factor of 1.22 in the library, 0.22 from neutral."""
    labels = {"a": label("single", "soil_change", ln_strength=0.2)}
    distance = math.exp(0.2) - 1.0
    for least, count in ((distance - 0.01, 1), (distance + 0.01, 0)):
        missed = {**answer("none"), "detectable": {"soil_change": {"strength": least}}}
        assert score(labels, {"a": missed})["top1"]["count"] == count


def test_a_wrong_name_beside_it_makes_a_single_effect_no_less_detectable() -> None:
    labels = {"a": label("single", "command_delay", delay=0.1)}
    beside, alone = ({"command_delay": {"delay": least}} for least in (0.2, 0.05))
    named = {**answer("slope"), "detectable": beside, "detectable_alone": alone}
    assert score(labels, {"a": named})["top1"]["count"] == 1


def test_what_can_be_shown_at_no_size_does_not_count_as_missed() -> None:
    labels = {"a": label("single", "payload", mass=400.0)}
    missed = {**answer("none"), "detectable": {"payload": {"mass": None}}}
    assert score(labels, {"a": missed})["top1"]["count"] == 0
    assert score(labels, {"a": missed | {"detectable": {}}})["top1"]["count"] == 1


def test_a_limit_counts_where_it_is_as_low_as_one_that_shows() -> None:
    labels = {"a": label("single", "motor_saturation", speed_limit=0.9)}
    for shows, count in ((1.0, 1), (0.8, 0), (None, 0)):
        missed = {**answer("none"), "detectable": {"motor_saturation": {"speed_limit": shows}}}
        assert score(labels, {"a": missed})["top1"]["count"] == count


def test_sizes_of_another_meaning_count_by_their_equivalents() -> None:
    """The generator's gain of 3.7 means another law than the library's growth."""
    labels = {"a": label("single", "slip_sinkage", gain=3.7)}
    missed = {**answer("none"), "detectable": {"slip_sinkage": {"growth": 0.3}}}
    assert score(labels, {"a": missed})["top1"]["count"] == 1
    for growth, count in ((0.31, 1), (0.29, 0)):
        equivalents = {"a": {"slip_sinkage": {"growth": growth}}}
        assert score(labels, {"a": missed}, equivalents)["top1"]["count"] == count


def test_equivalent_sizes_of_another_set_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "equivalents.json"
    opened = {"set": "sealed", "generator": "f", "seed": 1, "cases": {}}
    path.write_text(json.dumps(opened))
    assert read_equivalents(path, opened) == {}
    with pytest.raises(InputError, match="of another set"):
        read_equivalents(path, opened | {"seed": 2})


def test_intervals_are_compared_in_the_library_s_terms() -> None:
    """The generator states right over left, the library left over right."""
    labels = {"a": label("single", "soil_split", ln_strength_ratio=0.3)}
    found = answer("soil_split")
    for interval, value in (((0.7, 0.8), 1.0), ((1.3, 1.4), 0.0)):
        found["findings"][0]["parameters"] = {"strength": {"value": 0.75, "interval": interval}}
        scored = score(labels, {"a": found})
        assert scored["coverage"]["value"] == value
        assert [entry["truth"] for entry in scored["interval_misses"]] == [math.exp(-0.3)] * (value == 0.0)


def sized(name: str, **values: float | None) -> dict[str, Any]:
    """Answer that names one effect and states its sizes; those that are None stay neutral and state no interval."""
    entries = {
        field: {"value": 1e3, "interval": None} if value is None else {"value": value, "interval": [0.0, 1.0]}
        for field, value in values.items()
    }
    return {**answer(name), "findings": [{"name": name, "equivalence_set": {name: 1.0}, "parameters": entries}]}


@pytest.mark.parametrize(
    ("name", "truth", "stated", "error"),
    [
        ("command_delay", {"delay": 0.1}, {"delay": 0.08}, 0.2),
        # least meaningful: 0.02 s
        ("command_delay", {"delay": 0.01}, {"delay": 0.02}, 0.5),
        # a gain of 1.04 is 0.04 from no effect
        ("gyro_scale", {"scale": 1.04}, {"scale": 1.03}, 0.25),
        # found the wrong way round
        ("gyro_bias", {"bias": 0.004}, {"bias": -0.004}, 2.0),
        # y alone has no relative error
        ("imu_lever_arm", {"x": 0.5, "y": 0.0}, {"x": 0.5, "y": 0.25}, 0.5),
        ("imu_lever_arm", {"x": 0.3, "y": 0.4}, {"x": 0.0, "y": 0.0}, 1.0),
        # a limit is 8 % too high, however far from none
        ("motor_saturation", {"speed_limit": 0.5}, {"speed_limit": 0.54, "acceleration_limit": None}, 0.08),
        # the generator states right over left, the library left over right; least: 0.2
        ("soil_split", {"ln_strength_ratio": math.log(2.0)}, {"strength": 0.75}, 0.5),
        # in units of the least, 0.1 and 0.2: true (3, 4), error (0, 2)
        (
            "soil_change",
            {"ln_strength": math.log(1.3), "ln_stiffness": math.log(1.8)},
            {"strength": 1.3, "stiffness": 2.2},
            0.4,
        ),
    ],
)
def test_the_error_of_a_size_is_relative_to_its_distance_from_neutral(
    name: str, truth: dict[str, float], stated: dict[str, float | None], error: float
) -> None:
    case = ("a", label("single", name, **truth), sized(name, **stated))
    assert size_errors([case]) == [pytest.approx(error)]


def test_sizes_of_wrong_names_other_forms_and_unfitted_ones_have_no_error() -> None:
    delayed = label("single", "command_delay", delay=0.1)
    other = {**delayed, "effects": [{**delayed["effects"][0], "tag": "variant"}]}
    assert size_errors([("a", delayed, sized("motor_lag", lag=0.1))]) == []
    assert size_errors([("a", delayed, sized("command_delay", delay=None))]) == []
    assert size_errors([("a", delayed, {**sized("command_delay", delay=0.1), "verdict": ["unknown"]})]) == []
    assert size_errors([("a", other, sized("command_delay", delay=0.1))]) == []


def test_the_size_error_of_a_set_is_the_median_over_effects() -> None:
    delays = {"a": 0.11, "b": 0.12, "c": 0.2, "d": 0.09}
    labels = {name: label("single", "command_delay", delay=0.1) for name in delays}
    labels["e"] = label("null", "none")
    answers = {name: sized("command_delay", delay=value) for name, value in delays.items()} | {"e": answer("none")}
    found = score(labels, answers)["size_error"]
    assert found["value"] == pytest.approx(0.15)
    assert found["count"] == 4
    assert found["interval"] == pytest.approx([0.1, 1.0])


def test_the_right_name_counts_by_how_many_names_stand_beside_it() -> None:
    labels = {name: label("single", "command_delay", delay=0.1) for name in "abcdef"} | {"n": label("null", "none")}
    answers = {
        "a": answer("command_delay"),
        "b": answer("motor_lag", command_delay=0.4),
        "c": answer("motor_lag", slope=0.2, payload=0.1),
        "d": answer("none"),
        # its own name beside another finding
        "e": answer("command_delay", "slope"),
        # doubted: nothing is named
        "f": {**answer("command_delay"), "verdict": ["unknown"]},
        "n": answer("slope"),
    }
    found = score(labels, answers)
    assert found["in_set"]["value"] == pytest.approx(3.0 / 6.0)
    assert found["in_set_per_size"]["value"] == pytest.approx((1.0 + 0.5 + 0.5) / 6.0)
    assert found["in_set_per_size"]["count"] == 6


def test_power_counts_alarms_of_any_name_on_detectable_singles() -> None:
    labels = {name: label("single", "command_delay", delay=0.1) for name in "abcdef"}
    labels |= {"n": label("null", "none"), "o": label("outside", "unknown")}
    answers = {
        "a": answer("command_delay"),
        "b": answer("payload"),
        "c": answer("unknown", complete=False),
        "d": answer("none"),
        # a run that failed raised no alarm
        "e": {**answer(), "failure": {"exit_code": 2}},
        "f": {**answer("none"), "detectable": {"command_delay": {"delay": 0.2}}},
        "n": answer("slope"),
        "o": answer("unknown"),
    }
    found = score(labels, answers)
    assert found["power"] == share([True, True, True, False, False])
    assert found["power_all_singles"]["value"] == pytest.approx(3.0 / 6.0)


def test_intervals_of_medians_and_means_are_of_the_values_resampled() -> None:
    values = [0.0] * 30 + [1.0] * 10
    assert median(values) == {"value": 0.0, "interval": [0.0, 0.0], "count": 40}
    found = mean(values)
    # standard error of a share: sqrt(0.25 * 0.75/40) = 0.068
    assert found["value"] == 0.25
    assert found["interval"] == pytest.approx([0.25 - 1.96 * 0.068, 0.25 + 1.96 * 0.068], abs=0.03)
    assert median([]) == mean([]) == {"value": None, "interval": None, "count": 0}


def test_a_name_in_a_verdict_of_unknown_is_none() -> None:
    labels = {"a": label("single", "command_delay", delay=0.1)}
    doubtful = {**answer("command_delay", interval=(0.0, 1.0)), "verdict": ["unknown"], "complete": False}
    found = score(labels, {"a": doubtful})
    assert found["in_set"]["value"] == 0.0
    assert found["coverage"]["count"] == 0


def test_a_failed_run_is_a_false_alarm_or_a_miss_and_is_listed() -> None:
    failure = {"exit_code": 2, "message": "the file is empty"}
    failed = {"verdict": [], "complete": False, "findings": [], "seconds": 1.0, "failure": failure}
    labels = {"a": label("null", "none"), "b": label("single", "command_delay", delay=0.1)}
    found = score(labels, {"a": failed, "b": failed})
    assert found["false_alarm_rate"]["value"] == 1.0
    assert found["top1"]["value"] == 0.0
    assert found["confident_wrong"]["value"] == 0.0
    assert found["failed_runs"]["value"] == 1.0
    assert [entry["failure"] for entry in found["failures"]] == [failure, failure]


def test_gain_share_is_of_the_motion_else_of_the_readings_and_counts_what_was_missed() -> None:
    def certified(motion: float | None, readings: float | None, *verdict: str) -> dict[str, Any]:
        entries = {"gain_share": motion, "gain_share_readings": readings}
        fit = {name: {"5": None if value is None else {"value": value}} for name, value in entries.items()}
        return {**answer(*verdict), "fit": fit}

    labels = {name: label("single", "command_delay", delay=0.1) for name in "abcde"} | {"n": label("null", "none")}
    answers = {
        "a": certified(1.0, 0.2, "command_delay"),
        "b": certified(None, 0.5, "command_delay"),
        "c": certified(0.0, 0.0, "unknown"),
        "d": certified(None, None, "command_delay"),
        "e": answer("command_delay"),
        "n": certified(0.9, 0.9, "slope"),
    }
    found = score(labels, answers)
    assert found["gain_share"]["value"] == pytest.approx(0.5)
    assert found["gain_share"]["count"] == 3
    assert found["gain_share_rightly_named"]["value"] == pytest.approx(0.75)


def test_targets_are_bounds_on_both_sides() -> None:
    figures: dict[str, Any] = {name: {"value": None} for name in TARGETS}
    figures["coverage"] = {"value": 0.99}
    figures["false_alarm_rate"] = {"value": 0.05}
    met = {name: entry["met"] for name, entry in against_targets(figures).items()}
    assert met["coverage"] is False
    assert met["false_alarm_rate"] is True
    assert met["top1"] is None


@pytest.fixture
def files(tmp_path: Path) -> dict[str, Path]:
    """Labels with salts, their commitments, answers."""
    labels = {"case_001": label("null", "none"), "case_002": label("single", "command_delay", delay=0.1)}
    opened = {"set": "sealed", "cases": {name: {"label": entry, "salt": "ab"} for name, entry in labels.items()}}
    hashed = {name: {"label": commitment("ab", entry)} for name, entry in labels.items()}
    contents = {
        "labels": opened,
        "commitments": {"cases": hashed},
        "answers": {"case_001": answer("none"), "case_002": answer("slope")},
    }
    paths = {name: tmp_path / f"{name}.json" for name in contents}
    for name, content in contents.items():
        paths[name].write_text(json.dumps(content))
    return paths | {"output": tmp_path / "result.json"}


def test_command_line_writes_figures_and_picture(files: dict[str, Path], capsys: pytest.CaptureFixture[str]) -> None:
    assert main([word for name, path in files.items() for word in (f"--{name}", str(path))]) == 0
    found = json.loads(files["output"].read_text())
    assert found["false_alarm_rate"]["value"] == 0.0
    assert found["top1"]["value"] == 0.0
    assert found["targets"]["top1"]["met"] is False
    assert found["power"]["value"] == 1.0
    assert found["in_set_per_size"]["value"] == 0.0
    assert [entry["case"] for entry in found["failures"]] == ["case_002"]
    assert files["output"].with_suffix(".png").read_bytes()[:4] == b"\x89PNG"
    printed = capsys.readouterr().out
    assert "missed" in printed
    assert "power " in printed
    assert "in_set_per_size" in printed


def test_labels_that_were_changed_after_the_run_are_refused(
    files: dict[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    opened = json.loads(files["labels"].read_text())
    opened["cases"]["case_002"]["label"]["verdict"] = ["slope"]
    files["labels"].write_text(json.dumps(opened))
    assert main([word for name, path in files.items() for word in (f"--{name}", str(path))]) == 2
    assert "case_002" in capsys.readouterr().err
    assert not files["output"].exists()


def test_the_picture_s_table_counts_every_case_once_in_its_row() -> None:
    labels = {
        "a": label("null", "none"),
        "b": label("single", "slope", angle=0.1),
        "c": label("single", "slope", angle=0.1),
        "d": label("double", "slope", "gyro_bias"),
        "e": label("outside", "unknown"),
    }
    answers = {
        "a": answer("unknown"), "b": answer("slope"), "c": answer("payload", "slope"), "d": answer("slope"),
        "e": {"verdict": []},
    }  # fmt: skip
    rows = tabled(labels, answers)
    assert {name: (count, dict(said)) for name, (count, said, _) in rows.items()} == {
        "slope": (2, {"slope": 2, "payload": 1}),
        "nothing (nulls)": (1, {"unknown": 1}),
        "in no library": (1, {"failed": 1}),
        "slope + gyro_bias": (1, {"slope": 1}),
    }
    assert next(iter(rows)) == "slope"


def test_share_of_nothing_is_not_a_number() -> None:
    assert share([])["value"] is None
    assert share([True, False])["value"] == pytest.approx(0.5)
