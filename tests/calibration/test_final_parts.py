"""Parts that all windows decide on: the ramp gives way to a dead time, and the data sheet holds unless it forecasts
worse."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest

from ddagr_gym.calibration.final_parts import decide_with_all_windows
from ddagr_gym.calibration.joint_fit import Standing
from ddagr_gym.calibration.part_selection import TRIED_DELAY, Candidate, Selection
from ddagr_gym.calibration.parts import DATA_SHEET_PARTS, RobotModel, complete_robot, shared_parameters
from ddagr_gym.calibration.result import PartDecision
from ddagr_gym.presets import get_robot

DRIVES = 4

WARTHOG = get_robot("warthog")

ALL_PARTS = RobotModel(complete_robot(WARTHOG), shared_parameters(complete_robot(WARTHOG)))


def standing(delay: float) -> Standing:
    return Standing({"command_delay": delay}, np.zeros((0, 8)), True)


@dataclass
class Windows:
    """In place of fits to all windows: losses by the parts that are free and by the dead time that a fit starts from.

    Attributes:
        with_ramp: loss with the ramp, as selected.
        without_ramp: loss without it, by the dead time at the start [s].
        gains: share by which the loss falls with a part of the data sheet.
        only_places: whether the losses are of places alone, and wheel speeds are forecast alike by all.
    """

    with_ramp: float = 1.0
    without_ramp: dict[float, float] = field(default_factory=lambda: {0.1: 1.3, TRIED_DELAY: 1.3})
    gains: dict[str, float] = field(default_factory=dict)
    only_places: bool = False
    fits: int = 0

    data = SimpleNamespace(robot=WARTHOG)

    def fitted(self, model: RobotModel, start: Standing, iterations: int, rival: float) -> SimpleNamespace:
        self.fits += 1
        # what is compared with has no rival itself
        assert rival == (np.inf if self.fits == 1 else 1.0)
        return SimpleNamespace(model=model, standing=start)

    def forecasts(self, fitted: SimpleNamespace) -> tuple[()]:
        return ()

    def judge(self, fitted: SimpleNamespace, made: tuple[()]) -> Candidate:
        free = fitted.model.free
        loss = self.with_ramp
        if "command_ramp" not in free:
            loss = self.without_ramp[fitted.standing.values["command_delay"]]
        for name, share in self.gains.items():
            loss *= 1.0 - share if name in free else 1.0
        losses = {fold: loss * (1.0 + 1e-3 * fold) for fold in range(DRIVES)}
        wheels = dict.fromkeys(losses, 1.0) if self.only_places else losses
        return Candidate(fitted.standing, wheels, dict.fromkeys(losses, 1), losses, 1.0)


def decided(windows: Windows, out: frozenset[str], start: Standing) -> tuple[Selection, dict[str, PartDecision]]:
    ramp = PartDecision("command_ramp", "command_ramp" not in out, 0.05, 0.01)
    given = Selection(out | DATA_SHEET_PARTS, (ramp,), start)
    found = decide_with_all_windows(windows, ALL_PARTS, given, lambda name, make: make(), lambda line: None)
    return found, {item.name: item for item in found.decisions}


NO_RAMP = frozenset({"command_ramp"})
NOTHING = frozenset[str]()


@pytest.mark.parametrize(
    ("losses", "kept", "growth"),
    [
        ({0.1: 1.3, TRIED_DELAY: 1.3}, True, 0.3),  # missed from both
        ({0.1: 1.0, TRIED_DELAY: 0.9}, False, 0.0),  # as good from where it is: not tried from the longer one
        ({0.1: 1.3, TRIED_DELAY: 0.97}, False, -0.03),  # only from the longer dead time as good
        ({0.1: 1.3, TRIED_DELAY: 1.01}, False, 0.01),  # worse by less than 2 %
    ],
)
def test_a_ramp_stays_only_if_all_windows_miss_it(losses, kept, growth):
    found, decisions = decided(Windows(without_ramp=losses), NOTHING, standing(0.1))
    assert decisions["command_ramp"].kept is kept
    assert decisions["command_ramp"].growth == pytest.approx(growth)
    assert ("command_ramp" in found.left_out) is not kept


def test_a_ramp_that_was_not_selected_is_not_tried():
    windows = Windows(without_ramp={0.1: 1.0})
    found, decisions = decided(windows, NO_RAMP, standing(0.1))
    assert windows.fits == 1 + len(DATA_SHEET_PARTS)
    assert decisions["command_ramp"] == PartDecision("command_ramp", False, 0.05, 0.01)
    assert found.left_out == NO_RAMP | DATA_SHEET_PARTS


def test_places_alone_decide_on_the_data_sheet_and_not_on_the_ramp():
    losses = {0.1: 1.3, TRIED_DELAY: 1.3}
    windows = Windows(without_ramp=losses, gains={"half_track": 0.05}, only_places=True)
    _, decisions = decided(windows, NOTHING, standing(0.1))
    assert (decisions["command_ramp"].kept, decisions["geometry"].kept) == (False, True)


def test_a_dead_time_that_is_long_already_is_not_tried_from_a_shorter_one():
    windows = Windows(without_ramp={0.5: 1.3})
    assert decided(windows, NOTHING, standing(0.5))[1]["command_ramp"].kept


@pytest.mark.parametrize(("share", "kept"), [(0.0, False), (0.01, False), (0.05, True), (-0.1, False)])
def test_the_data_sheet_holds_unless_forecasts_gain(share, kept):
    found, decisions = decided(Windows(without_ramp={0.1: 1.0}, gains={"half_track": share}), NO_RAMP, standing(0.1))
    assert {name for name in DATA_SHEET_PARTS if decisions[name].kept} == ({"geometry"} if kept else set())
    assert decisions["geometry"].growth == pytest.approx(1.0 / (1.0 - share) - 1.0)
    assert ("geometry" in found.left_out) is not kept
