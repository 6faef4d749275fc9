"""First guesses stay inside what an effect allows."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ddagr_gym.diagnosis.certification.certify import _recording_fold, refitted_on
from ddagr_gym.diagnosis.search.candidates import candidates_of
from ddagr_gym.diagnosis.search.gains import Gain, gains
from ddagr_gym.diagnosis.search.initial_guess import (
    first_guess,
    looped_encoders,
    same_lateness,
    slower_loop,
    turned_to_agree,
    with_usual_shape,
    with_whole_delay,
    with_whole_lag,
)
from ddagr_gym.diagnosis.search.inner_products import Terms
from ddagr_gym.diagnosis.search.scan import scan
from ddagr_gym.identification.gauss_newton import Fitted, fit
from ddagr_gym.identification.problem import Point, Problem
from ddagr_gym.physics.effects import load_effects
from ddagr_gym.physics.effects.base import DriveExtent
from ddagr_gym.physics.effects.gyro_bias import GyroBias
from ddagr_gym.physics.effects.registry import effect_kind, effect_kinds
from ddagr_gym.physics.effects.towed_drag import TowedDrag
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import simulate

EXTENT = DriveExtent(60.0, (-3.0, 3.0), (-2.0, 4.0), 1.2, 3.0)


def test_every_candidate_becomes_an_effect_whatever_its_multiples() -> None:
    for name, kind in effect_kinds().items():
        if name == "sensor_hold":
            continue
        for candidate in candidates_of(kind, EXTENT, 0):
            for size in (0.1, 0.3333333333333333, 1.7, 1e6):
                multiples = [size * (k + 1) / 3.0 for k in range(len(candidate.probes))]
                assert first_guess(candidate, multiples).name == name


def test_reversed_axes_go_all_the_way_together() -> None:
    both = candidates_of(effect_kinds()["accelerometer_sign"], EXTENT, 0)[-1]
    assert first_guess(both, [1.0]).as_mapping()["parameters"] == {"flip_x": 1.0, "flip_y": 1.0}


def loop(value: float, *effects: str) -> Point | None:
    problem: Any = SimpleNamespace(
        nuisances=SimpleNamespace(parameters=(SimpleNamespace(name="mass"), SimpleNamespace(name="motor_rate"))),
        prior=np.array([0.03, 0.0667]),
        robot=SimpleNamespace(motor_rate=4.5),
    )
    return slower_loop(problem, Point(np.array([0.01, value]), np.zeros((1, 8)), load_effects(effects)))


def test_a_slow_loop_is_a_lag_of_the_same_time_constant() -> None:
    told = loop(-0.893, "gyro_scale=1.1")
    assert told is not None
    assert told.values.tolist() == [0.01, 0.0]
    assert [effect.name for effect in told.effects] == ["gyro_scale", "motor_lag"]
    assert 1.0 / 4.5 + told.effects[1].lag == pytest.approx(1.0 / (4.5 * math.exp(-0.893)))


def late(shift: float, *effects: str) -> Point:
    names = (SimpleNamespace(name="mass"), SimpleNamespace(name="command_shift"))
    problem: Any = SimpleNamespace(nuisances=SimpleNamespace(parameters=names))
    return with_whole_delay(problem, Point(np.array([0.01, shift]), np.zeros((1, 8)), load_effects(effects)))


def test_a_delay_takes_over_what_the_meaning_of_rows_had_taken() -> None:
    told = late(0.04, "gyro_scale=1.1", "command_delay=0.06,imbalance=0.5")
    assert told.values.tolist() == [0.01, 0.0]
    delay = told.effects[1]
    for way in (1.0, -1.0):
        assert delay.delay * (1.0 + way * delay.imbalance) == pytest.approx(0.06 * (1.0 + way * 0.5) + 0.04)


@pytest.mark.parametrize("effects", [("gyro_scale=1.1",), ("command_delay=0",), ("command_delay=0.47",), ()])
def test_without_a_delay_rows_mean_what_they_meant(effects: tuple[str, ...]) -> None:
    assert late(0.04, *effects).values.tolist() == [0.01, 0.04]


@pytest.mark.parametrize(("value", "effects"), [(-0.2, ()), (0.893, ()), (-0.893, ("motor_lag=0.1",))])
def test_ordinary_loops_fast_ones_and_those_with_a_lag_stay(value: float, effects: tuple[str, ...]) -> None:
    assert loop(value, *effects) is None


def slow(value: float, *effects: str) -> Point | None:
    names = (SimpleNamespace(name="mass"), SimpleNamespace(name="motor_rate"))
    problem: Any = SimpleNamespace(
        nuisances=SimpleNamespace(parameters=names), robot=SimpleNamespace(motor_rate=get_robot("ddagr").motor_rate)
    )
    return with_whole_lag(problem, Point(np.array([0.01, value]), np.zeros((1, 8)), load_effects(effects)))


@pytest.mark.parametrize("value", [-0.3, 0.2])
@pytest.mark.parametrize("second_pole", [0.0, 0.4])
def test_a_whole_lag_says_the_same_beside_the_rate_of_data_sheets(value: float, second_pole: float) -> None:
    """Whatever the commands are: both are the same two time constants."""
    told = slow(value, "gyro_scale=1.1", f"motor_lag=0.25,second_pole={second_pole}")
    assert told is not None
    assert told.values.tolist() == [0.01, 0.0]
    robot, soil, commands = get_robot("ddagr"), get_soil("thesis_a1"), np.repeat([[0.3, 0.9], [0.8, -0.2]], 60, axis=0)
    changed = replace(robot, motor_rate=robot.motor_rate * math.exp(value))
    before = simulate(changed, soil, commands, effects=(f"motor_lag=0.25,second_pole={second_pole}",))
    after = simulate(robot, soil, commands, effects=told.effects[1:])
    np.testing.assert_allclose(after["true_omega_right"], before["true_omega_right"], atol=1e-9)


@pytest.mark.parametrize(
    ("value", "effects"),
    [
        (-0.3, ("gyro_scale=1.1",)),
        (0.0, ("motor_lag=0.2",)),
        (1.5, ("motor_lag=0.05",)),
        (0.6, ("motor_lag=0.2,second_pole=1",)),
    ],
)
def test_a_lag_stays_where_no_other_says_the_same(value: float, effects: tuple[str, ...]) -> None:
    assert slow(value, *effects) is None


def told_again(*effects: str) -> Point | None:
    return looped_encoders(Point(np.ones(2), np.ones((1, 8)), load_effects(effects)))


@pytest.mark.parametrize("difference", [0.04, -0.06])
def test_uneven_radii_and_encoders_in_the_loop_leave_the_same_traces(
    drive: Callable[..., Recording], difference: float
) -> None:
    """Larger wheels and faster ones of the same bank turn the robot to the same side by as much."""
    told = told_again("gyro_scale=1.0", f"wheel_radius_mismatch={difference}")
    assert told is not None
    assert [effect.name for effect in told.effects] == ["gyro_scale", "encoder_scale"]
    plain, radii, encoders = (
        drive(effects, seconds=4.0) for effects in ((), (f"wheel_radius_mismatch={difference}",), told.effects)
    )
    turned = [float(r.extras["true_yaw"][-1] - plain.extras["true_yaw"][-1]) for r in (radii, encoders)]
    assert math.copysign(1.0, turned[0]) == math.copysign(1.0, difference)
    assert abs(turned[0]) > 0.015
    assert turned[1] == pytest.approx(turned[0], rel=0.05)
    for name in ("encoder_right", "encoder_left"):
        # the encoders count, and the counts of the other speeds fall at other times
        assert float((encoders[name] - radii[name])[50:].mean()) == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize(
    "effects",
    [("slope=0.1",), ("wheel_radius_mismatch=0.1", "slope=0.1"), ("encoder_scale=1.1", "wheel_radius_mismatch=0.1")],
)
def test_only_uneven_radii_without_wrong_encoders_are_told_again(effects: tuple[str, ...]) -> None:
    assert told_again(*effects) is None


@dataclass(frozen=True, eq=False)
class Turned:
    """What a scan of two drives on one slope says, that begin towards different directions of the world.

    Attributes:
        problem: without poses of the second.
        raw: the nominal model.
        terms: of the slope.
        gain: of the slope.
        guess: from the scan, as for one frame.
        away: heading of the second drive less that of the world of the problem.
    """

    problem: Problem
    raw: Fitted
    terms: Terms
    gain: Gain
    guess: Point
    away: float


@pytest.fixture(scope="module", params=[False, True], ids=["no poses", "poses of the first"])
def turned(
    request: pytest.FixtureRequest, drive: Callable[..., Recording], problem_of: Callable[..., Problem]
) -> Turned:
    poses = bool(request.param)
    slope = ("slope=0.06,direction=0.8",)
    problem = problem_of(drive(slope, yaw=0.3, poses=poses), drive(slope, seed=2, yaw=2.5, poses=False))
    raw = fit(problem, iterations=0)
    terms = scan(problem, raw, {"slope": effect_kind("slope")})
    gain = gains(terms)[0]
    effects = (first_guess(terms.candidates[gain.candidate], gain.multiples),)
    return Turned(problem, raw, terms, gain, replace(raw.point, effects=effects), 2.5 if poses else 2.2)


def heading(turned: Turned, point: Point) -> float:
    names = [parameter.name for parameter in turned.problem.nuisances.parameters]
    return float(point.values[names.index("heading_2")])


def test_a_recording_without_poses_is_turned_until_its_slope_agrees(turned: Turned) -> None:
    point = turned_to_agree(turned.problem, turned.terms, turned.gain, turned.guess)
    assert heading(turned, point) == pytest.approx(turned.away, abs=0.2)
    assert point.effects[-1].angle == pytest.approx(0.06, abs=0.01)
    assert point.effects[-1].angle > 1.5 * turned.guess.effects[-1].angle
    # the windows of the recording turn with it, those of the other stay
    change = (point.states - turned.guess.states)[:, 2]
    second = turned.problem.blocked.windows.recording == 1
    np.testing.assert_allclose(change[second], heading(turned, point))
    assert not change[~second].any()


def test_a_fit_does_not_forget_the_heading_that_a_slope_shows(turned: Turned) -> None:
    point = turned_to_agree(turned.problem, turned.terms, turned.gain, turned.guess)
    fitted = fit(turned.problem, point, iterations=3, renewals=2).point
    assert heading(turned, fitted) == pytest.approx(turned.away, abs=0.2)
    off = (turned.problem.starts(fitted.values) - fitted.states)[:, 2]
    assert np.abs(off).max() < 0.2


def test_other_effects_and_drives_with_poses_keep_their_headings(
    turned: Turned, drive: Callable[..., Recording], problem_of: Callable[..., Problem]
) -> None:
    other = replace(turned.guess, effects=load_effects("motor_lag=0.1"))
    assert turned_to_agree(turned.problem, turned.terms, turned.gain, other) is other
    followed: Any = SimpleNamespace(nuisances=problem_of(drive(), drive(seed=2)).nuisances)
    assert turned_to_agree(followed, turned.terms, turned.gain, turned.guess) is turned.guess


def test_drives_out_and_back_show_the_slope_that_one_frame_would_hide(
    drive: Callable[..., Recording], problem_of: Callable[..., Problem]
) -> None:
    slope = ("slope=0.06,direction=0.8",)
    there, back = (drive(slope, seed=seed, yaw=yaw, poses=False) for seed, yaw in ((1, 0.0), (2, math.pi)))
    problem = problem_of(there, back)
    kinds = {"slope": effect_kind("slope")}
    terms = scan(problem, fit(problem, iterations=0), kinds)
    alone = scan(problem_of(there), fit(problem_of(there), iterations=0), kinds)
    assert gains(replace(terms, turned=()))[0].gain < 0.2 * gains(alone)[0].gain
    assert gains(terms)[0].gain > gains(alone)[0].gain
    point = turned_to_agree(problem, terms, gains(terms)[0], replace(problem.start(), effects=load_effects(*slope)))
    names = [parameter.name for parameter in problem.nuisances.parameters]
    assert abs(math.remainder(point.values[names.index("heading_2")] - math.pi, 2.0 * math.pi)) < 0.2
    assert point.effects[0].angle == pytest.approx(0.06, rel=0.4)


def test_sizes_for_an_unseen_drive_leave_its_heading_as_the_fit_to_all_drives_has_it(turned: Turned) -> None:
    point = turned_to_agree(turned.problem, turned.terms, turned.gain, turned.guess)
    fitted = fit(turned.problem, point, iterations=1)
    for unseen in (0, 1):
        found = refitted_on(turned.problem, fitted, _recording_fold(turned.problem, unseen))
        assert heading(turned, found) == heading(turned, fitted.point)
        assert found.effects[0].direction != fitted.point.effects[0].direction


@pytest.mark.parametrize("effect", ["command_delay=0.3", "motor_lag=0.3,second_pole=1"])
def test_a_dead_time_and_a_second_pole_trail_commands_alike(drive: Callable[..., Recording], effect: str) -> None:
    """At a steady speed the robot is as far behind."""
    (own,) = load_effects((effect,))
    other = same_lateness(own)
    assert other is not None
    assert other.name != own.name
    plain, first, second = (drive(effects, seconds=4.0) for effects in ((), (own,), (other,)))
    behind = [float((plain.extras["true_x"] - r.extras["true_x"])[-1]) for r in (first, second)]
    assert behind[0] > 0.05
    assert behind[1] == pytest.approx(behind[0], rel=0.1)


@pytest.mark.parametrize("effect", ["slope=0.1", "motor_lag=-0.02", "motor_lag=0.2,turning=1", "command_delay=0"])
def test_other_effects_and_quick_motors_have_no_lateness_to_translate(effect: str) -> None:
    assert same_lateness(load_effects((effect,))[0]) is None


def test_a_lag_longer_than_any_dead_time_becomes_the_longest() -> None:
    assert same_lateness(load_effects(("motor_lag=2",))[0]) == load_effects(("command_delay=0.49",))[0]


def fitted_with(cost: float, *effects: Any) -> Any:
    return SimpleNamespace(cost=cost, point=Point(np.zeros(2), np.zeros((1, 8)), effects))


def test_only_a_load_with_an_unusual_hitch_has_another_start() -> None:
    usual, far = TowedDrag(20.0), TowedDrag(20.0, hitch_distance=1.0)
    started = []

    def refitted(point: Point) -> Any:
        started.append(point.effects)
        return fitted_with(90.0, *point.effects)

    for effects in ((usual,), (far, GyroBias(0.1))):
        stays = fitted_with(90.0, *effects)
        assert with_usual_shape(stays, 180.0, refitted) is stays
    assert started == []
    with_usual_shape(fitted_with(90.0, GyroBias(0.1), far), 180.0, refitted)
    assert started == [(GyroBias(0.1), usual)]


@pytest.mark.parametrize(("cost", "chosen"), [(90.0, "usual"), (107.9, "usual"), (108.1, "best"), (150.0, "best")])
def test_the_usual_hitch_is_taken_unless_it_explains_less_by_more_than_a_fifth(cost: float, chosen: str) -> None:
    best, usual = fitted_with(90.0, TowedDrag(20.0, hitch_distance=1.0)), fitted_with(cost, TowedDrag(40.0))
    assert with_usual_shape(best, 180.0, lambda point: usual) is (usual if chosen == "usual" else best)
