"""Which manoeuvre settles classical confusions."""

import math
from dataclasses import asdict, replace
from typing import Any

import pytest

from ddagr_gym.control.manoeuvres import Manoeuvre
from ddagr_gym.diagnosis.answer.verdict import Diagnosis, Estimate, Finding, GatesUsed, Options
from ddagr_gym.diagnosis.planning.next_drive import (
    MOST_MINUTES,
    _answer,
    next_drive,
    rivals_of_diagnosis,
    sensors_of_diagnosis,
    setting_of_diagnosis,
)
from ddagr_gym.diagnosis.planning.separations import Separation
from ddagr_gym.diagnosis.result.equivalence import APART, FORM, LEAST_WEIGHT, runs_apart, unit_of_cost
from ddagr_gym.diagnosis.setting import Setting
from ddagr_gym.errors import InputError
from ddagr_gym.identification.nuisances import NuisancePriors
from ddagr_gym.physics.effects.registry import parse_effect
from ddagr_gym.presets import get_robot, get_soil

STRAIGHT = Manoeuvre("one_heading", ((8.0, 0.8, 0.8),), "straight")
TURN = Manoeuvre("two_headings_short", ((4.0, 0.8, 0.8), (8.0, 0.8, -0.8), (4.0, 0.8, 0.8)), "with a turn")
SPEEDS = Manoeuvre("speeds_short", 2 * ((2.0, 0.2, 0.2), (2.0, 1.4, 1.4)), "two speeds in turn")


def drive(*rivals: str, bank=(STRAIGHT, TURN), **options):
    effects = [parse_effect(text) for text in rivals]
    return next_drive(get_robot("ddagr"), get_soil("thesis_a1"), effects, bank=bank, **options)


def test_slope_against_bias_asks_for_a_change_of_heading() -> None:
    answer = drive("slope=0.02", "accelerometer_bias=0.2")
    assert answer.manoeuvre == "two_headings_short"
    assert answer.separates == (("slope", "accelerometer_bias"),)
    assert answer.minutes == pytest.approx(APART / answer.power)
    assert answer.why.startswith("with a turn: ")
    # the straight is no alternative worth its time, or far behind
    assert all(item.power < 0.1 * answer.power for item in answer.alternatives)


def test_one_heading_alone_settles_nothing() -> None:
    answer = drive("imu_tilt=0.0,pitch=0.03", "accelerometer_bias=0.3")
    assert answer.manoeuvre == ""
    assert answer.separates == ()
    assert answer.minutes is None
    assert f"{MOST_MINUTES:g} min" in answer.why


def test_kinds_of_drag_ask_for_several_speeds() -> None:
    answer = drive("towed_drag=150", "viscous_drag=700", bank=(STRAIGHT, SPEEDS))
    assert answer.manoeuvre == "speeds_short"


def test_a_single_name_asks_for_the_drive_that_shows_it_best() -> None:
    answer = drive("gyro_scale=1.05")
    assert answer.manoeuvre == "two_headings_short"
    assert answer.separates == ()
    assert "stands out" in answer.why


def test_a_place_is_driven_over() -> None:
    far = drive("soil_patch=2.5,centre_x=30.0,centre_y=-20.0", bank=(STRAIGHT,))
    near = drive("soil_patch=2.5,centre_x=1.0,centre_y=0.0", bank=(STRAIGHT,))
    assert far.power == pytest.approx(near.power, rel=0.1)
    # 0.082 with steps of 5 ms and nine contact nodes, 0.097 with a new derivative at every step, 0.175 with derivatives
    # that are kept; steps divided at launches read 1.2 out of their own noise
    assert far.power == pytest.approx(0.082, abs=0.12)


@pytest.mark.parametrize(("lead", "gain"), [(1.0, 3.0), (10.0, 40.0), (200.0, 800.0)])
def test_so_many_runs_leave_the_wrong_name_one_weight_in_twenty(lead: float, gain: float) -> None:
    runs = runs_apart(lead, gain)
    odds = math.exp(-runs * lead / unit_of_cost(runs * gain))
    assert odds / (1.0 + odds) <= LEAST_WEIGHT + 1e-12
    assert runs_apart(0.99 * APART * FORM * gain, gain) == math.inf


def test_a_lead_within_the_error_of_a_form_is_told_by_no_number_of_runs() -> None:
    """A tenth of 800 is much per minute, and within the error each time: the one with less of both comes first."""
    pair = [parse_effect(text) for text in ("slope=0.02", "accelerometer_bias=0.2")]
    even = (1.0, *7 * (0.0,))
    never = dict.fromkeys([(0, 1), (1, 0)], Separation(80.0, even, 800.0))
    soon = dict.fromkeys([(0, 1), (1, 0)], Separation(2.0, even, 4.0))
    answer = _answer((STRAIGHT, TURN), pair, [never, soon])
    assert answer.manoeuvre == TURN.name
    assert answer.separates == (("slope", "accelerometer_bias"),)
    assert answer.alternatives == ()
    nothing = _answer((STRAIGHT,), pair, [never])
    assert nothing.minutes is None
    assert nothing.separates == ()
    assert "No number of runs is enough for slope and accelerometer_bias" in nothing.why


def finding(name: str, weights: dict[str, float], **parameters: float) -> Finding:
    estimates = {key: Estimate(value, "-") for key, value in parameters.items()}
    return Finding(name, estimates, 30.0, 8.0, 4.0, 20.0, equivalence_set=weights)


def diagnosis(*findings: Finding, **entries: Any) -> Diagnosis:
    names = tuple(item.name for item in findings) or ("unknown",)
    gates = GatesUsed(nulls=60, bank="f", level=0.05)
    empty = Diagnosis(names, bool(findings), findings, "", {"nominal": {}}, {}, {}, ("a.csv",), gates, 1.0, "0")
    return replace(empty, **entries)


def test_rivals_and_sensors_of_a_diagnosis() -> None:
    weights = {"slope": 0.6, "accelerometer_bias": 0.3, "imu_tilt": 0.1}
    misfit = {"nominal": {"yaw_rate": 1.0, "encoder_left": 1.0}}
    found = diagnosis(finding("slope", weights, angle=0.03, direction=0.5), misfit=misfit)
    rivals = rivals_of_diagnosis(found)
    assert [rival.name for rival in rivals] == ["slope", "accelerometer_bias", "imu_tilt"]
    assert rivals[0].angle == 0.03
    # five times the least meaningful bias of 0.05 m/s^2
    assert abs(rivals[1].x) == pytest.approx(0.25)
    assert sensors_of_diagnosis(found) == ("imu", "encoders")
    # a limit that was not fitted has no size to plan with
    limited = diagnosis(finding("slope", {"slope": 0.6, "motor_saturation": 0.4}, angle=0.03, direction=0.5))
    assert [rival.name for rival in rivals_of_diagnosis(limited)] == ["slope"]


def test_encoders_that_stand_beside_uneven_radii_are_those_that_the_speed_loop_believes() -> None:
    weights = {"wheel_radius_mismatch": 0.5, "encoder_scale": 0.5}
    rivals = rivals_of_diagnosis(diagnosis(finding("wheel_radius_mismatch", weights, difference=0.04)))
    assert rivals[1].as_mapping()["parameters"] == {"right": 0.98, "left": 1.02, "loop": 1.0}


def test_where_nothing_is_named_what_comes_nearest_is_planned_for() -> None:
    near = finding("slope", {"slope": 1.0}, angle=0.03)
    assert [rival.name for rival in rivals_of_diagnosis(diagnosis(rejected=(near,)))] == ["slope"]


def test_a_plan_has_the_windows_and_priors_of_the_diagnosis() -> None:
    setting = Setting(priors=NuisancePriors().with_soil(4.0)).with_windows(3.0, 6.0)
    options = Options(window=3.0, stride=6.0, block=setting.block, priors=asdict(setting.priors), seed=0)
    assert setting_of_diagnosis(diagnosis(options=options)) == setting
    assert setting_of_diagnosis(diagnosis()) == Setting()
    for wrong, words in (({"stride": None}, "stride"), ({"priors": {"wetness": 1.0}}, "wetness")):
        with pytest.raises(InputError, match=words):
            setting_of_diagnosis(diagnosis(options=replace(options, **wrong)))


def test_without_findings_what_could_hide_is_planned_for() -> None:
    detectable = {"slope": {"angle": 0.002}, "payload": {"mass": 40.0}, "gyro_sign": {}, "gyro_scale": {"scale": None}}
    assert [rival.name for rival in rivals_of_diagnosis(diagnosis(detectable=detectable))] == ["gyro_scale"]
    del detectable["gyro_scale"]
    assert [rival.name for rival in rivals_of_diagnosis(diagnosis(detectable=detectable))] == ["payload"]


@pytest.mark.parametrize(("rivals", "words"), [((), "no rival"), (("slope=0.1", "slope=0.2"), "once")])
def test_bad_rivals_are_one_sentence(rivals, words) -> None:
    with pytest.raises(InputError, match=words):
        drive(*rivals)


def test_power_is_per_minute() -> None:
    twice = Manoeuvre("twice", TURN.segments * 2, "twice")
    one = drive("gyro_scale=1.05", bank=(TURN,))
    two = drive("gyro_scale=1.05", bank=(twice,))
    assert math.isclose(one.power, two.power, rel_tol=0.35)
