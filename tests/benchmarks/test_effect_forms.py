"""Forms of effects in blind cases: which cases are driven, what is counted, what is drawn."""

import pytest

from benchmarks.effect_forms import FORMS, SEEDS, cases, draw, forms_of, kind_of_answer, main, summary

BAND = "soil_patch/band"


def answer(forms, verdict, right=False, complete=True, any_right=False):
    return {
        "case": f"2001 {forms} {verdict}",
        "kind": ["null", "single", "double"][len(forms)],
        "forms": forms,
        "truth": [form.partition("/")[0] for form in forms] or ["none"],
        "verdict": verdict,
        "complete": complete,
        "right": right,
        "any_right": right or any_right,
        "seconds": 20.0,
    }


ANSWERS = [
    answer([BAND], ["soil_patch"], right=True),
    answer([BAND], ["soil_patch"], right=True, complete=False),
    answer([BAND], ["slope"]),
    answer([BAND], ["none"]),
    answer([BAND, "gyro_bias/constant"], ["gyro_bias"], any_right=True),
    answer([], ["none"], right=True),
    answer([], ["slope"]),
]


def test_every_case_has_one_of_the_forms_or_nothing():
    found = cases(FORMS, SEEDS, 10)
    assert all(not set(forms_of(case)).isdisjoint(FORMS) for _, case in found[:-10])
    assert all(not case.effects for _, case in found[-10:])
    assert {form for _, case in found for form in forms_of(case)} >= set(FORMS)


def test_all_forms_are_those_of_all_singles_and_doubles():
    found = cases(["all"], SEEDS[:1], 0)
    assert {case.kind for _, case in found} == {"single", "double"}
    assert len(found) == 80


def test_a_form_that_no_case_has_is_refused_with_the_ones_there_are(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--forms", "soil_patch/star"])
    assert stop.value.code == 2
    told = capsys.readouterr().err
    assert "no case has the form 'soil_patch/star': choose from" in told
    assert BAND in told


def test_answers_are_counted_by_form():
    found = summary(ANSWERS)
    assert found["forms"][BAND] == {
        "singles": {"cases": 4, "right": 2, "complete": 1},
        "doubles": {"cases": 1, "right": 0, "complete": 0},
    }
    assert found["nulls"] == {"cases": 2, "alarms": 1}
    kinds = [kind_of_answer(item) for item in ANSWERS[:5]]
    assert kinds == ["right", "right, incomplete", "wrong", "nothing", "one of two"]


def test_a_picture_is_drawn(tmp_path):
    draw(ANSWERS, tmp_path / "forms.png")
    assert (tmp_path / "forms.png").stat().st_size > 10_000
