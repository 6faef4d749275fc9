"""Weak motors on soft ground: which cases are driven, and what is counted."""

import json

import pytest

from benchmarks.motor_limits import FORMS, NAME, NULLS, RESULT, SEEDS, cases, draw, summary


def answer(truth, verdict, nominal=3.0, complete=True, **sizes):
    return {
        "case": f"2001 {truth} {verdict}",
        "kind": "single",
        "truth": truth,
        "form": FORMS[1] if NAME in truth else "",
        "true_sizes": {"power_limit": 30.0} if NAME in truth else {},
        "verdict": verdict,
        "complete": complete,
        "found_sizes": sizes,
        "encoders_over_limit": {"nominal": nominal, "corrected": 0.5},
        "seconds": 20.0,
    }


ANSWERS = [
    answer([NAME], [NAME], power_limit={"value": 45.0, "unit": "W", "interval": [20.0, 70.0]}),
    answer([NAME], ["none"], nominal=0.8),
    answer([NAME, "gyro_bias"], ["gyro_bias", NAME], complete=False),
    answer(["gyro_bias", NAME], [NAME]),
    answer(["none"], ["none"], nominal=0.5),
    answer(["none"], ["slope"], nominal=0.5),
]


def test_every_case_has_a_weak_motor_or_nothing():
    found = cases(SEEDS)
    nulls = [case for _, case in found if not case.effects]
    assert len(nulls) == NULLS
    for _, case in found[: len(found) - NULLS]:
        assert any(form.name == NAME and form.variant in FORMS for form, _ in case.effects)
    assert cases(SEEDS) == found


def test_counts_are_of_the_cases_that_show():
    found = summary(ANSWERS)
    assert (found["cases"], found["shown"], found["complete"]) == (4, 3, 2)
    assert found["singles"] == {"shown": 1, "right": 1}
    assert found["doubles"] == {"shown": 2, "right": 1, "limit_named": 2}
    assert found["nulls"] == {"cases": 2, "alarms": 1}
    assert found["ratios_of_power"] == [pytest.approx(1.5)]


def test_a_picture_is_drawn(tmp_path):
    draw(ANSWERS, tmp_path / "limits.png")
    assert (tmp_path / "limits.png").stat().st_size > 10_000


def test_kept_counts_are_those_of_the_kept_answers():
    kept = json.loads(RESULT.read_text())
    assert kept["summary"] == summary(kept["answers"])
    assert [item["case"] for item in kept["answers"]] == [f"{seed} {case.name}" for seed, case in cases(SEEDS)]
