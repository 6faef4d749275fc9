"""What a soil does, in the sentence of a diagnosis."""

from dataclasses import replace

import pytest

from ddagr_gym.diagnosis.answer.soil_at_work import SINKAGE, TRACTION, SoilAtWork, SoilQuantity, WorkingPoint
from ddagr_gym.diagnosis.answer.verdict import Estimate, Finding
from ddagr_gym.diagnosis.result.sentences import headline
from ddagr_gym.diagnosis.result.soil_words import finding_in_words, soil_in_words

POINT = WorkingPoint(0.15, 0.2, 0.25, 410.0)
LEFT, RIGHT = "under the left wheels", "under the right wheels"


def quantity(name, change, interval):
    unit = "m" if name == SINKAGE else "N"
    return SoilQuantity(name, unit, 60.0, (50.0, 70.0), 80.0, (70.0, 90.0), change, interval)


def soil(*quantities, told_apart=False, first=LEFT, second=RIGHT):
    return SoilAtWork(first, second, POINT, quantities, 0.8, told_apart)


WEAKER = quantity(TRACTION, -0.25, (-0.3, -0.2))
SPLIT = Finding(
    "soil_split",
    {"strength": Estimate(0.7, "-", (0.6, 0.8)), "stiffness": Estimate(0.5, "-", (0.2, 1.3))},
    50.0, 10.0, 5.0, 40.0,
)  # fmt: skip


def test_what_both_do_together_takes_the_place_of_sizes_that_are_not_told_apart():
    found = replace(SPLIT, soil=soil(WEAKER))
    assert headline(("soil_split",), True, [found]).startswith(
        "The soil under the left wheels gives 20 to 30 % less traction than under the right wheels (its strength and "
        "stiffness cannot be told apart)"
    )


def test_sizes_that_are_known_by_themselves_stay():
    found = replace(SPLIT, soil=soil(WEAKER, told_apart=True))
    assert finding_in_words(found) == finding_in_words(SPLIT)
    assert "weaker" in finding_in_words(found)


@pytest.mark.parametrize(
    ("quantities", "words"),
    [
        ((quantity(TRACTION, 0.25, (0.1, 0.4)),), "gives 10 to 40 % more traction than the nominal soil"),
        (
            (quantity(TRACTION, 0.1, (-0.1, 0.4)), quantity(SINKAGE, 0.5, (0.2, 0.8))),
            "lets wheels sink 20 to 80 % deeper than the nominal soil",
        ),
        ((quantity(SINKAGE, -0.5, (-0.8, -0.2)),), "lets wheels sink 20 to 80 % less than the nominal soil"),
    ],
)
def test_the_first_that_differs_for_certain_is_said(quantities, words):
    assert soil_in_words(soil(*quantities, first="on these drives", second="the nominal soil")) == (
        f"the soil on these drives {words}"
    )


def test_what_may_be_next_to_nothing_is_not_said():
    assert soil_in_words(soil(quantity(TRACTION, 0.2, (0.04, 0.4)))) == ""
    assert soil_in_words(soil(quantity(TRACTION, -0.2, (-0.4, -0.04)))) == ""


def test_where_nothing_differs_for_certain_the_sizes_are_said():
    found = replace(SPLIT, soil=soil(quantity(TRACTION, 0.1, (-0.1, 0.4))))
    assert soil_in_words(found.soil) == ""
    assert finding_in_words(found).startswith("the soil on the left is")
    assert finding_in_words(found).endswith("(its strength and stiffness cannot be told apart)")
