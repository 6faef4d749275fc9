"""Parts that all windows decide on: ramp and filter give way to a dead time, and the data sheet holds unless it
forecasts worse."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest

from ddagr_gym.calibration.exchanged_parts import TRIED_DELAY
from ddagr_gym.calibration.final_parts import decide_with_all_windows
from ddagr_gym.calibration.joint_fit import Standing
from ddagr_gym.calibration.part_comparison import Candidate
from ddagr_gym.calibration.part_selection import Selection
from ddagr_gym.calibration.parts import DATA_SHEET_PARTS, RobotModel, complete_robot, shared_parameters
from ddagr_gym.calibration.result import PartDecision
from ddagr_gym.presets import get_robot

DRIVES = 4

WARTHOG = get_robot("warthog")

ALL_PARTS = RobotModel(complete_robot(WARTHOG), shared_parameters(complete_robot(WARTHOG)))


LATE = frozenset({"command_ramp", "command_filter"})


def standing(delay: float, **values: float) -> Standing:
    return Standing({"command_delay": delay} | values, np.zeros((0, 8)), True)


@dataclass
class Windows:
    """In place of fits to all windows: losses by the parts that are free and by the dead time that a fit starts from.

    Attributes:
        late: the ramp or the filter.
        with_late: loss with it, as selected.
        without_late: loss without it, by the dead time at the start [s].
        gains: share by which the loss falls with a part of the data sheet.
        only_places: whether the losses are of places alone, and wheel speeds are forecast alike by all.
        fits_as_well: whether the fits themselves leave the same whatever is free.
    """

    late: str = "command_ramp"
    with_late: float = 1.0
    without_late: dict[float, float] = field(default_factory=lambda: {0.1: 1.3, TRIED_DELAY: 1.3})
    gains: dict[str, float] = field(default_factory=dict)
    only_places: bool = False
    fits_as_well: bool = False
    costs: list[float] = field(default_factory=list)

    data = SimpleNamespace(robot=WARTHOG)

    def fitted(self, model: RobotModel, start: Standing, iterations: int, rival: float) -> SimpleNamespace:
        # what is compared with has no rival itself, and all others have one that was fitted
        assert rival in self.costs if self.costs else np.isinf(rival)
        return SimpleNamespace(model=model, standing=start)

    def forecasts(self, fitted: SimpleNamespace) -> tuple[()]:
        return ()

    def judge(self, fitted: SimpleNamespace, made: tuple[()]) -> Candidate:
        free = fitted.model.free
        loss = self.with_late
        if self.late not in free:
            loss = self.without_late[fitted.standing.values["command_delay"]]
        for name, share in self.gains.items():
            loss *= 1.0 - share if name in free else 1.0
        losses = {fold: loss * (1.0 + 1e-3 * fold) for fold in range(DRIVES)}
        wheels = dict.fromkeys(losses, 1.0) if self.only_places else losses
        cost = self.with_late if self.fits_as_well else loss
        self.costs.append(cost)
        return Candidate(fitted.standing, wheels, dict.fromkeys(losses, 1), losses, cost)


def decided(windows: Windows, out: frozenset[str], start: Standing) -> tuple[Selection, dict[str, PartDecision]]:
    late = PartDecision(windows.late, windows.late not in out, 0.05, 0.01)
    given = Selection(out | DATA_SHEET_PARTS, (late,), start)
    found = decide_with_all_windows(windows, ALL_PARTS, given, lambda name, make: make(), lambda line: None)
    return found, {item.name: item for item in found.decisions}


def without(windows: Windows) -> frozenset[str]:
    """The other one of the two, which was not selected."""
    return LATE - {windows.late}


@pytest.mark.parametrize("late", sorted(LATE))
@pytest.mark.parametrize(
    ("losses", "kept", "growth"),
    [
        ({0.1: 1.3, TRIED_DELAY: 1.3}, True, 0.3),  # missed from both
        ({0.1: 1.0, TRIED_DELAY: 0.9}, False, 0.0),  # as good from where it is: not tried from the longer one
        ({0.1: 1.3, TRIED_DELAY: 0.97}, False, -0.03),  # only from the longer dead time as good
        ({0.1: 1.3, TRIED_DELAY: 1.01}, False, 0.01),  # worse by less than 2 %
    ],
)
def test_ramp_and_filter_stay_only_if_all_windows_miss_them(late, losses, kept, growth):
    windows = Windows(late, without_late=losses)
    found, decisions = decided(windows, without(windows), standing(0.1))
    assert decisions[late].kept is kept
    assert decisions[late].growth == pytest.approx(growth)
    assert (late in found.left_out) is not kept


@pytest.mark.parametrize("late", sorted(LATE))
def test_ramp_and_filter_that_were_not_selected_are_not_tried(late):
    windows = Windows(late, without_late={0.1: 1.0})
    found, decisions = decided(windows, LATE, standing(0.1))
    assert len(windows.costs) == 1 + len(DATA_SHEET_PARTS)
    assert decisions[late] == PartDecision(late, False, 0.05, 0.01)
    assert found.left_out == LATE | DATA_SHEET_PARTS


@pytest.mark.parametrize(("slow", "kept"), [(1.0, False), (1.3, True)])
def test_a_filter_gives_way_to_slower_motors(slow, kept):
    class Motors(Windows):
        def judge(self, fitted, made):
            self.without_late = {0.1: slow if fitted.standing.values["motor_rate"] < 0.0 else 1.3, TRIED_DELAY: 1.3}
            return super().judge(fitted, made)

    start = standing(0.1, command_filter=0.4, motor_rate=1.0)
    _, decisions = decided(Motors("command_filter"), frozenset({"command_ramp"}), start)
    assert decisions["command_filter"].kept is kept


def test_places_alone_decide_on_the_data_sheet_and_not_on_the_ramp():
    losses = {0.1: 1.3, TRIED_DELAY: 1.3}
    windows = Windows(without_late=losses, gains={"half_track": 0.05}, only_places=True)
    _, decisions = decided(windows, without(windows), standing(0.1))
    assert (decisions["command_ramp"].kept, decisions["geometry"].kept) == (False, True)


def test_a_dead_time_that_is_long_already_is_not_tried_from_a_shorter_one():
    windows = Windows(without_late={0.5: 1.3})
    assert decided(windows, without(windows), standing(0.5))[1]["command_ramp"].kept


@pytest.mark.parametrize(("share", "kept"), [(0.0, False), (0.01, False), (0.05, True), (-0.1, False)])
def test_the_data_sheet_holds_unless_forecasts_gain(share, kept):
    found, decisions = decided(Windows(without_late={0.1: 1.0}, gains={"half_track": share}), LATE, standing(0.1))
    assert {name for name in DATA_SHEET_PARTS if decisions[name].kept} == ({"geometry"} if kept else set())
    assert decisions["geometry"].growth == pytest.approx(1.0 / (1.0 - share) - 1.0)
    assert ("geometry" in found.left_out) is not kept


def test_forecasts_alone_ask_for_nothing_that_does_not_fit_better():
    windows = Windows(without_late={0.1: 1.3, TRIED_DELAY: 1.3}, gains={"half_track": 0.05}, fits_as_well=True)
    _, decisions = decided(windows, without(windows), standing(0.1))
    assert not decisions["command_ramp"].kept
    assert not decisions["geometry"].kept
