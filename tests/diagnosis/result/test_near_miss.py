"""What a comparison came near to is said beside `none`, and how far few ordinary drives can see."""

from __future__ import annotations

from dataclasses import replace

from ddagr_gym.diagnosis.answer.change import BEFORE, Change, EffectShift, SizeShift
from ddagr_gym.diagnosis.result.near_miss import few_drives_in_words
from ddagr_gym.diagnosis.result.sentences import change_headline

SIZES = {"x": SizeShift(-0.048, 0.008, "m", 0.1), "y": SizeShift(0.004, 0.006, "m", 0.07)}
NEAR = EffectShift("centre_of_mass_offset", 5.9, 7.6, 0.1, 6.0, SIZES)
FAR = EffectShift("gyro_bias", 2.0, 5.9, 0.9, 6.0, {"bias": SizeShift(0.001, 0.002, "rad/s", 0.01)})
CHANGE = Change("sand", ("a", "b", "c"), 0.05, 0.8, 12, (FAR, NEAR), (), (), {})


def said(change: Change) -> str:
    return change_headline(("none",), True, (), change)


def test_the_effect_nearest_to_its_limit_is_said():
    assert said(CHANGE) == (
        "No change shows against 3 ordinary drives. The nearest is offset centre of mass (x −0.048 m), at "
        "78 % of its limit: further ordinary drives, or --before with the drives themselves, may tell. Smaller changes "
        "may be there: the table says of each effect which change would have been found 80 times in 100."
    )
    before = said(replace(CHANGE, against=BEFORE))
    assert "at 78 % of its limit: further drives from before may tell." in before


def test_what_is_far_from_its_limit_is_not_said():
    assert "nearest" not in said(replace(CHANGE, shifts=(FAR,)))
    assert "nearest" not in said(replace(CHANGE, shifts=()))


def test_what_a_fit_refuted_is_not_called_near():
    sign = EffectShift("accelerometer_sign", 16.0, 5.3, 1e-5, 6.0, {"flip_x": SizeShift(0.9, 0.05, "-", 1.0)})
    assert said(replace(CHANGE, shifts=(sign, FAR))).startswith(
        "No change shows against 3 ordinary drives. By a first step alone it would be reversed accelerometer axis, but "
        "a fit with it explains nothing. Smaller"
    )
    assert "The nearest is offset centre of mass" in said(replace(CHANGE, shifts=(sign, NEAR)))


def test_few_ordinary_drives_are_said_to_see_little():
    assert few_drives_in_words(CHANGE).startswith("Only 3 ordinary drives say what is usual, so that limits are wide")
    assert few_drives_in_words(replace(CHANGE, ordinary=tuple("abcde"))) == ""
    known = tuple(replace(item, degrees=26.0) for item in CHANGE.shifts)
    assert few_drives_in_words(replace(CHANGE, shifts=known)) == ""
    assert few_drives_in_words(replace(CHANGE, against=BEFORE)) == ""
