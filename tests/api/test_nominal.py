"""Robot and soil where none are given: the recordings' own, the thresholds' own, and what is said of a guess."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

import ddagr_gym
from ddagr_gym.api.nominal import UNKNOWN_GROUND, nominal_or_usual, robot_or_recorded, soil_or_usual
from ddagr_gym.diagnosis.gates.threshold_files import shipped_thresholds
from ddagr_gym.errors import InputError, InputWarning
from ddagr_gym.recordings.schema import Recording


def drive(robot: str) -> Recording:
    table = {name: np.zeros(3) for name in ("command_right", "command_left", "yaw_rate")}
    return ddagr_gym.load_recording({"t": np.arange(3.0), **table}).with_meta(robot=robot)


def test_a_given_robot_is_taken_before_the_recorded_one():
    assert robot_or_recorded("husky", [drive("warthog")]) == "husky"


def test_the_recorded_robot_is_taken_where_none_is_given(recwarn):
    assert robot_or_recorded(None, [drive("warthog"), drive("")]) == "warthog"
    assert not recwarn.list


def test_a_robot_that_nobody_names_is_said():
    with pytest.warns(InputWarning, match="does not say which robot drove: it is taken for the ddagr; name the robot"):
        assert robot_or_recorded(None, [drive("")]) == "ddagr"


def test_recordings_of_two_robots_or_of_an_unknown_one_are_refused():
    with pytest.raises(InputError, match="of the robots husky, warthog: give those of one robot"):
        robot_or_recorded(None, [drive("warthog"), drive("husky")])
    with pytest.raises(InputError, match="of the robot 'my_rover': name it with --robot FILE"):
        robot_or_recorded(None, [drive("my_rover")])


def test_the_soil_is_that_of_the_thresholds_or_unknown_ground():
    assert soil_or_usual(None, None, [shipped_thresholds("ddagr")]) == ("thesis_a1", 1.0)
    assert soil_or_usual(None, None, [shipped_thresholds("warthog")]) == ("firm_ground", 4.0)
    assert soil_or_usual(None, None, [None]) == UNKNOWN_GROUND


def test_thresholds_of_a_soil_that_cannot_be_loaded_leave_it_to_those_of_the_robot():
    own = shipped_thresholds("warthog")
    own = replace(own, origin=replace(own.origin, soil="given in Python"))
    assert soil_or_usual(None, None, [own, shipped_thresholds("ddagr")]) == ("thesis_a1", 1.0)


def test_what_is_given_of_a_soil_is_kept():
    bank = [shipped_thresholds("warthog")]
    assert soil_or_usual("lete_sand_wong", None, bank) == ("lete_sand_wong", 1.0)
    assert soil_or_usual("lete_sand_wong", 2.0, bank) == ("lete_sand_wong", 2.0)
    assert soil_or_usual(None, 2.0, bank) == ("firm_ground", 2.0)


@pytest.mark.parametrize(
    ("robot", "thresholds", "ground"),
    [("husky", None, "firm_ground, at 4 times"), ("husky", "ddagr", "thesis_a1, at 1 times"), ("ddagr", None, None)],
)
def test_a_soil_that_is_assumed_is_said_but_for_the_ddagr(robot, thresholds, ground):
    bank = None if thresholds is None else shipped_thresholds(thresholds)
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        nominal_or_usual([drive("")], robot, None, None, bank)
    lines = [str(item.message) for item in warned]
    assert lines == (
        []
        if ground is None
        else [
            f"no soil is given: the {robot} is taken to be on {ground} a soil's usual uncertainty; name a soil with "
            "--soil (soil=... in Python) where it is known."
        ]
    )


def test_a_diagnosis_warns_where_it_is_called():
    """The drive is too short for a diagnosis, which is found after robot and soil."""
    with pytest.warns(InputWarning) as warned, pytest.raises(InputError, match=r"few|rows"):
        ddagr_gym.diagnose(drive(""), names_only=True)
    (said,) = [item for item in warned if "which robot drove" in str(item.message)]
    assert said.filename == __file__


@pytest.mark.parametrize("given", [{"robot": "ddagr"}, {"soil": "thesis_a1"}, {"soil_uncertainty": 1.0}])
def test_nothing_that_a_calibration_says_is_given_beside_it(given, tmp_path):
    said = r"calibration and (robot|soil) are given|soil uncertainty is 1 and there is a"
    with pytest.raises(InputError, match=said):
        ddagr_gym.diagnose(drive(""), calibration=tmp_path, **given)
