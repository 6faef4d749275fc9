"""A robot whose wheels sink unevenly leans, and the accelerometer of a real one reads that."""

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.gates.thresholds import Gate, Thresholds
from ddagr_gym.diagnosis.search import stepwise
from ddagr_gym.diagnosis.search.gains import gains
from ddagr_gym.diagnosis.search.lean import gravity_read, lean_column
from ddagr_gym.diagnosis.search.scan import scan
from ddagr_gym.diagnosis.setting import Setting, make_problem
from ddagr_gym.identification.gauss_newton import Fitted, fit
from ddagr_gym.identification.nuisances import TILT, NuisancePriors
from ddagr_gym.identification.problem import Problem
from ddagr_gym.parameters import STANDARD_GRAVITY, Imu, Sensors
from ddagr_gym.physics.effects import load_effects
from ddagr_gym.physics.effects.registry import effect_kind
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import simulate
from tests.diagnosis.conftest import RATE, commands

OFFSET = "centre_of_mass_offset=0.1,y=-0.05"
GATE = Gate(6.0, 0.0)
"""Less than the lean gains in one drive of 24 s, less than noise reaches in the library (8)."""

KINDS = {name: effect_kind(name) for name in ("accelerometer_bias", "encoder_scale")}


def lean_of(columns: dict[str, np.ndarray]) -> np.ndarray:
    """(N, 2) gravity along x and y [m/s^2] of a robot on wheels that sink as a simulation says."""
    robot = get_robot("ddagr")
    front_right, front_left, rear_right, rear_left = (columns[f"true_sinkage_{k}"] for k in (1, 2, 3, 4))
    nose_up = 0.5 * (rear_right + rear_left - front_right - front_left) / (2.0 * robot.half_wheelbase)
    left_up = 0.5 * (front_right + rear_right - front_left - rear_left) / (2.0 * robot.half_track)
    return STANDARD_GRAVITY * np.sin(np.stack([nose_up, left_up], axis=1))


def driven(leans: bool) -> Recording:
    """24 s with the mass off the middle, of a robot that leans or not."""
    robot = get_robot("ddagr")
    columns = dict(
        simulate(
            robot,
            get_soil("thesis_a1"),
            commands(24.0),
            sensors=Sensors(Imu(sample_rate=RATE)),
            effects=(OFFSET,),
            seed=1,
        )
    )
    if leans:
        for name, part in zip(("specific_force_x", "specific_force_y"), lean_of(columns).T, strict=True):
            columns[name] = columns[name] + part
    return Recording.from_columns(columns, robot)


LEVEL = NuisancePriors(sinkage_tilt=1e-6)
"""Of a simulator whose robot feels no lean."""


def offset_model(leans: bool, priors: NuisancePriors = LEVEL) -> tuple[Problem, Fitted]:
    recording = driven(leans)
    problem = make_problem(get_robot("ddagr"), get_soil("thesis_a1"), [recording], Setting(priors=priors))
    raw = fit(problem, iterations=0)
    return problem, fit(problem, replace(raw.point, effects=load_effects(OFFSET)), iterations=4, renewals=2)


@pytest.fixture(scope="module")
def leaning() -> tuple[Problem, Fitted]:
    """Model that has the offset, of a drive of a robot that leans by it."""
    return offset_model(leans=True)


def test_gravity_is_read_forwards_with_the_nose_up_and_to_the_left_with_the_left_side_up() -> None:
    robot = get_robot("ddagr")
    nose_up, left_up = 0.01 * 2.0 * robot.half_wheelbase, 0.02 * 2.0 * robot.half_track
    heights = np.array([nose_up, nose_up + left_up, 0.0, left_up])
    expected = STANDARD_GRAVITY * np.array([0.01, 0.02])
    np.testing.assert_allclose(gravity_read(robot, heights), expected, rtol=1e-12)


def test_only_effects_that_move_wheels_make_the_robot_lean(leaning: tuple[Problem, Fitted]) -> None:
    problem, fitted = leaning
    assert lean_column(problem, fitted) is not None
    for effects in ((), load_effects("gyro_scale=1.1")):
        other = fit(problem, replace(fitted.point, effects=effects), iterations=0)
        assert lean_column(problem, other) is None
        assert scan(problem, other, KINDS).imitated == {}


def test_a_lean_is_no_accelerometer_bias_beside_what_makes_the_robot_lean(leaning: tuple[Problem, Fitted]) -> None:
    """The bias explains what the lean reads, far beyond its gate in drives with nothing missing, and is none."""
    problem, fitted = leaning
    terms = scan(problem, fitted, KINDS)
    bias = next(item.gain for item in gains(terms) if item.name == "accelerometer_bias")
    gates = Thresholds(dict.fromkeys(KINDS, GATE), {}, 20, "a test")
    raised = stepwise.beyond_lean(gates, terms.imitated, 1.0)
    assert bias > 1.2 * gates.of("accelerometer_bias").gain
    assert bias < raised.of("accelerometer_bias").gain
    assert terms.imitated["accelerometer_bias"] == pytest.approx(bias, rel=0.5)
    assert raised.of("encoder_scale").gain < 1.2 * gates.of("encoder_scale").gain


def test_a_lean_that_the_simulator_feels_is_no_bias_and_raises_no_gate() -> None:
    problem, fitted = offset_model(True, NuisancePriors())
    share = fitted.point.values[[p.name for p in problem.nuisances.parameters].index(TILT)]
    assert share > 0.8
    terms = scan(problem, fitted, KINDS)
    assert next(item.gain for item in gains(terms) if item.name == "accelerometer_bias") < 0.5 * GATE.gain
    assert terms.imitated["accelerometer_bias"] < 0.1 * GATE.gain


def test_gates_rise_by_the_lean_as_sizes_over_their_errors_add_up() -> None:
    gates = Thresholds({"accelerometer_bias": Gate(16.0, 1.0), "gyro_scale": Gate(9.0, 1.0)}, {}, 20, "a test")
    raised = stepwise.beyond_lean(gates, {"accelerometer_bias": 50.0, "gyro_scale": 0.0}, 2.0)
    assert raised.of("accelerometer_bias").gain == pytest.approx((4.0 + 5.0) ** 2)
    assert raised.of("gyro_scale").gain == pytest.approx(9.0)
    assert stepwise.beyond_lean(gates, {}, 2.0) == gates


def test_a_bias_that_was_named_first_goes_with_what_makes_the_robot_lean(leaning: tuple[Problem, Fitted]) -> None:
    problem, fitted = leaning
    biased = load_effects("accelerometer_bias=-0.02,y=0.02")
    point = replace(fitted.point, effects=(*biased, *fitted.point.effects))
    both = fit(problem, point, iterations=4, renewals=2)
    gates = Thresholds({"accelerometer_bias": GATE}, {}, 20, "x")
    raised = stepwise._beside(problem, gates, fitted, "accelerometer_bias", 1.0)
    assert fitted.cost - both.cost > gates.of("accelerometer_bias").gain
    assert fitted.cost - both.cost < raised.of("accelerometer_bias").gain
