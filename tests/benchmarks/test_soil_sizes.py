"""Coverage of the sizes of soils: what counts as held, and of which drives."""

import copy
import math

import pytest

from benchmarks.mid_drive_drives import ALWAYS, Switched
from benchmarks.soil_size_drives import OTHER, OWN, own_drive, start_of
from benchmarks.soil_sizes import NAMED, draw, drives, summary
from ddagr_gym.diagnosis.answer.soil_at_work import WorkingPoint

QUANTITY = {
    "name": "traction", "unit": "N", "truth": [60.0, 80.0], "first": 65.0, "first_interval": [55.0, 75.0],
    "second": 70.0, "second_interval": [60.0, 79.0], "change": -0.1, "change_interval": [-0.3, 0.1],
}  # fmt: skip
ANSWER = {
    "drive": "made 1", "simulator": OTHER, "effect": "soil_split", "structure": "", "gain": 2.0 * NAMED,
    "sizes": {
        "strength": {"truth": 1.5, "value": 1.3, "before": [1.2, 1.4], "now": [1.1, 1.6]},
        "stiffness": {"truth": 2.0, "value": 2.0, "before": [1.5, 2.5], "now": [1.0, 4.0]},
    },
    "quantities": {"traction": QUANTITY, "net_pull": QUANTITY | {"change": None, "change_interval": None}},
}  # fmt: skip


def test_shares_are_of_drives_in_which_the_effect_may_be_named():
    hidden = copy.deepcopy(ANSWER) | {"gain": 0.5 * NAMED}
    found = summary([ANSWER, ANSWER | {"simulator": OWN}, hidden])
    assert found["not_named"] == 1
    everything, other = found["all"], found[OTHER]
    assert (everything["drives"], other["drives"]) == (2, 1)
    held = {name: (entry["held"], entry["count"]) for name, entry in other.items() if name != "drives"}
    assert held == {
        "strength before": (0, 1), "strength now": (1, 1), "stiffness before": (1, 1), "stiffness now": (1, 1),
        "both sizes before": (1, 2), "both sizes now": (2, 2), "traction value": (1, 2), "traction change": (1, 1),
        "net_pull value": (1, 2),
    }  # fmt: skip
    assert everything["strength now"]["held"] == 2


def test_the_picture_is_drawn(tmp_path):
    pytest.importorskip("matplotlib", reason="needs the extra report")
    draw([ANSWER], tmp_path / "made.png")
    assert (tmp_path / "made.png").stat().st_size > 5000


def test_every_kind_of_drive_has_its_turn():
    makers = [make.func.__name__ for make in drives()]
    assert {name: makers.count(name) for name in makers} == {"split_drive": 12, "own_drive": 6, "changed_drive": 3}


def test_the_truth_of_a_form_is_that_of_its_drive():
    item = Switched(3, "soil_split", "both", 4.0, ALWAYS, 0.0)
    sizes = item.change().parameters
    assert sizes == item.change().parameters
    assert abs(sizes["ln_stiffness_ratio"]) == pytest.approx(1.5 * abs(sizes["ln_strength_ratio"]))
    assert abs(sizes["ln_strength_ratio"]) == pytest.approx(4.0 * math.log(1.1), rel=0.1)


def test_a_wheel_on_the_weaker_soil_pulls_less():
    drive = own_drive(0)
    left, right = drive.wheels(WorkingPoint(0.15, 0.3, 0.1, 410.0))
    assert (left[0] > right[0]) == (drive.truth.strength > 1.0)
    assert start_of(drive).is_neutral
