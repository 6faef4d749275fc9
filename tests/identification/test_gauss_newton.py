"""Fits to simulated drives of known physics: one drive, and many drives with shared and own parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_robots import stronger
from ddagr_gym.control.manoeuvres import MANOEUVRES
from ddagr_gym.errors import InputError
from ddagr_gym.identification import gauss_newton
from ddagr_gym.identification.block_means import sample_windows
from ddagr_gym.identification.fit_numerics import field_numerics, field_slope_numerics
from ddagr_gym.identification.gauss_newton import cost_of, fit, fit_states, linearised
from ddagr_gym.identification.least_squares import Linearised
from ddagr_gym.identification.nuisances import Nuisances
from ddagr_gym.identification.parameters import (
    ModelParameter,
    disjoint_scopes,
    per_group,
    robot_parameters,
    soil_parameters,
)
from ddagr_gym.identification.problem import Point, Problem
from ddagr_gym.identification.window_model import WindowModel
from ddagr_gym.identification.windows import CHANNELS, STATE, cut_windows
from ddagr_gym.parameters import Imu, PoseReceiver, Sensors
from ddagr_gym.recordings.schema import RobotGeometry
from ddagr_gym.simulator import simulate
from tests.replay_analysis.conftest import MOTOR_RATE, STRENGTH, as_recording

SENSORS = Sensors(imu=Imu(sample_rate=50.0, gyro_noise=0.002, accelerometer_noise=0.05), pose=PoseReceiver(5.0))
SIGMA = np.array([np.inf, np.inf, 0.002, 0.01, 0.01, 0.012, 0.012, 0.008])
ROBUST = np.full(len(CHANNELS), 2.0)
GROUNDS = {"firm": (1.2, (0, 1)), "loose": (0.75, (2, 3))}
"""Strength over the preset's, and the drives that were made there."""


def parameters_of(robot, soil) -> dict[str, ModelParameter]:
    return {p.name: p for p in (*soil_parameters(soil), *robot_parameters(robot))}


def windows_of(recordings, robot):
    geometry = RobotGeometry.of(robot)
    return cut_windows(recordings, 2.0, wheel_radius=geometry.wheel_radius, half_track=geometry.half_track)


@pytest.fixture(scope="module")
def one_drive(make_drive, robot, soil):
    """Soil and motor to be found from eight windows of arcs."""
    windows = windows_of([make_drive(("arcs",), SENSORS)], robot).subset(np.arange(1, 17, 2))
    known = parameters_of(robot, soil)
    chosen = Nuisances((known["soil_strength"], known["motor_rate"]))

    def make(sigma=SIGMA, robust=None, slopes=None, threads=1) -> Problem:
        return Problem(
            robot, soil, sample_windows(windows, sigma), chosen, robust=robust, threads=threads,
            numerics=field_numerics(), slopes=slopes,
        )  # fmt: skip

    return make


def test_the_known_soil_and_motor_are_found(one_drive):
    problem = one_drive(robust=ROBUST)
    fitted = fit(problem, iterations=25, renewals=25, tolerance=1e-4)
    assert fitted.converged
    _, spread = linearised(problem, fitted).deviations()
    errors = np.abs(fitted.point.values - np.log([STRENGTH, MOTOR_RATE]))
    assert (errors <= np.maximum(3.0 * spread, [0.02, 0.01])).all()
    start = problem.start()
    assert fitted.cost < cost_of(problem, start, problem.predict(start), fitted.elimination)[0]


def test_a_window_whose_state_would_be_spoilt_does_not_stop_the_others(one_drive):
    """A robot at rest shows nothing of a yaw rate that it begins with: its linear step may be any length."""
    problem = one_drive(robust=ROBUST)
    settled = fit(problem)
    before = settled.window_cost
    states = settled.point.states.copy()
    states[0, STATE.index("yaw_rate")] += 2.0
    states[1, STATE.index("yaw")] += 1e-4
    trial = replace(settled.point, states=states)
    spoilt = cost_of(problem, trial, problem.predict(trial), settled.elimination)[1]
    assert spoilt[0] > 1.2 * before[0]
    assert before[1] < spoilt[1] < 1.2 * before[1]
    taken, _, total = gauss_newton._best_by_window(problem, trial, settled.point, settled.elimination, before)
    np.testing.assert_array_equal(taken.states[0], settled.point.states[0])
    np.testing.assert_array_equal(taken.states[1:], states[1:])
    assert total == pytest.approx(settled.cost + spoilt[1] - before[1])


def test_coarse_sensitivities_find_the_same_values(one_drive):
    """They are differences of predictions by their own numerics: those of the fit's own give its bits."""
    fine, same, coarse = (
        fit(one_drive(robust=ROBUST, slopes=slopes), iterations=12, renewals=12, tolerance=1e-4)
        for slopes in (None, field_numerics(), field_slope_numerics())
    )
    np.testing.assert_array_equal(same.by_parameter, fine.by_parameter)
    np.testing.assert_array_equal(same.elimination.basis, fine.elimination.basis)
    assert not np.array_equal(coarse.by_parameter, fine.by_parameter)
    _, spread = linearised(one_drive(robust=ROBUST), fine).deviations()
    assert (np.abs(coarse.point.values - fine.point.values) <= 0.2 * spread).all()
    assert coarse.cost <= 1.001 * fine.cost


def test_coarse_sensitivities_simulate_the_unmoved_point_once(one_drive, monkeypatch):
    """Two parameters and the five initial speeds: all follow one record."""
    problem = one_drive(robust=ROBUST, slopes=field_slope_numerics())
    coarse, predict = [], WindowModel.predict

    def counted(model, *given, near=None):
        if near is not None and model._numerics == problem._slopes._numerics:
            coarse.append(id(near.forces.entries))
        return predict(model, *given, near=near)

    monkeypatch.setattr(WindowModel, "predict", counted)
    fit(problem, iterations=0)
    assert len(coarse) == 2 + 5
    assert len(set(coarse)) == 1


def test_a_step_that_rounds_over_a_bound_ends_on_it(one_drive, robot, soil, monkeypatch):
    """A robot at 1e-13 below nothing would be refused."""
    made = one_drive(robust=ROBUST)
    strength, motor = made.nuisances.parameters
    lowest = float(np.log(STRENGTH)) + 0.1
    problem = Problem(
        robot, soil, made.blocked, Nuisances((replace(strength, low=lowest), motor)), robust=ROBUST,
        numerics=field_numerics(),
    )  # fmt: skip
    exact = Linearised.step
    monkeypatch.setattr(Linearised, "step", lambda self, *given: exact(self, *given) - 1e-9)
    fitted = fit(problem, iterations=3, renewals=3, tolerance=1e-6)
    assert fitted.point.values[0] == lowest


def test_a_fit_ends_where_it_is_given_up_with_the_derivatives_of_that_point(one_drive):
    problem, seen = one_drive(), []

    def second(before: float, after: float) -> bool:
        seen.append((before, after))
        return len(seen) == 2

    ended = fit(problem, iterations=6, renewals=6, tolerance=1e-9, give_up=second)
    two = fit(problem, iterations=2, renewals=2, tolerance=1e-9)
    assert (ended.iterations, ended.converged) == (2, False)
    assert seen[0][1] == seen[1][0] > seen[1][1] == pytest.approx(ended.cost, rel=1e-9)
    np.testing.assert_array_equal(ended.by_parameter, two.by_parameter)


def test_a_fit_has_the_same_bits_on_one_thread_and_on_two(one_drive):
    alone, both = (fit(one_drive(threads=threads), iterations=2) for threads in (1, 2))
    np.testing.assert_array_equal(alone.by_parameter, both.by_parameter)
    np.testing.assert_array_equal(alone.point.values, both.point.values)


@pytest.fixture
def differentiated(monkeypatch) -> list[Point]:
    """Points at which sensitivities were computed, in that order."""
    points: list[Point] = []
    columns = Problem.parameter_columns

    def seen(self, point, *given):
        points.append(point)
        return columns(self, point, *given)

    monkeypatch.setattr(Problem, "parameter_columns", seen)
    return points


def test_repeated_steps_lower_the_cost_with_sensitivities_of_one_point(one_drive, differentiated):
    problem = one_drive()
    once, twice = (fit(problem, iterations=1, renewals=1, tolerance=1e-6, repeats=more) for more in (0, 1))
    assert len(differentiated) == 4
    assert twice.cost < 0.9 * once.cost
    np.testing.assert_array_equal(differentiated[-1].values, twice.point.values)
    settled, repeated = (fit(problem, iterations=40, renewals=40, tolerance=1e-5, repeats=more) for more in (0, 2))
    assert repeated.iterations < settled.iterations
    assert repeated.cost == pytest.approx(settled.cost, rel=5e-3)


def test_a_fit_ends_at_the_same_point_without_sensitivities_of_its_result(one_drive, differentiated):
    problem = one_drive()
    whole, short = (
        fit(problem, iterations=2, renewals=2, tolerance=1e-9, renewed=renewed) for renewed in (True, False)
    )
    assert len(differentiated) == 3 + 2
    np.testing.assert_array_equal(short.point.values, whole.point.values)
    np.testing.assert_array_equal(short.point.states, whole.point.states)
    np.testing.assert_array_equal(short.prediction, whole.prediction)
    assert not np.array_equal(short.by_parameter, whole.by_parameter)


def test_what_is_expected_of_a_parameter_may_be_changed_by_name(one_drive):
    problem = one_drive()
    strength, motor = (p.name for p in problem.nuisances.parameters)
    tight = problem.expecting({motor: 1e-4})
    assert problem.prior[1] > 1e-4
    assert tight.prior.tolist() == [problem.prior[0], 1e-4]
    assert [p.prior for p in tight.nuisances.parameters] == tight.prior.tolist()
    loose, held = (fit(item, iterations=6, renewals=6).point.values for item in (problem, tight))
    assert abs(held[1]) < 0.1 * abs(loose[1])
    # what is held stays so
    assert problem.holding(np.array([True, False])).expecting({strength: 1.0}).prior[0] == 0.0


def test_wrong_initial_states_are_found_again(one_drive):
    problem = one_drive()
    truth = np.log([STRENGTH, MOTOR_RATE])
    states, prediction = fit_states(problem, truth, iterations=4)
    initial = problem.blocked.windows.initial.copy()
    initial[:, 5] += 0.05
    blocked = replace(problem.blocked, windows=replace(problem.blocked.windows, initial=initial))
    again, other = fit_states(problem.on(blocked), truth, iterations=4)
    # a window whose linear step fails keeps its first guess
    assert np.median(np.abs(again[:, 5] - states[:, 5])) < 0.005
    gyro = CHANNELS.index("yaw_rate")
    assert np.median(np.abs(prediction - other)[..., gyro].max(axis=1)) < 0.005


def test_a_step_of_the_states_never_raises_the_cost_of_a_window(one_drive):
    problem = one_drive()
    nominal = problem.start()
    before = problem.losses(problem.residual(nominal, problem.predict(nominal)))
    states, prediction = fit_states(problem, nominal.values)
    after = problem.losses(problem.residual(Point(nominal.values, states), prediction))
    assert (after <= before + 1e-9).all()
    assert after.sum() < 0.9 * before.sum()


def test_losses_by_channel_are_those_of_the_windows(one_drive):
    problem = one_drive()
    nominal = problem.start()
    residual = problem.residual(nominal, problem.predict(nominal))
    found = problem.losses_by_channel(residual)
    assert set(found) == set(CHANNELS)
    assert found["yaw_rate"] > 0.0
    without_priors = residual.copy()
    without_priors[:, problem.blocked.mask.shape[1] :] = 0.0
    assert sum(found.values()) == pytest.approx(problem.losses(without_priors).sum())


@pytest.mark.parametrize(("delay", "begin", "end"), [(0.12, 0.07, 0.17), (0.0, 0.0, 0.05)])
def test_the_derivative_to_a_delay_spans_a_sample_to_both_sides_inside_its_bounds(
    one_drive, robot, soil, delay, begin, end
):
    late = replace(robot, standard_deviations={**robot.standard_deviations, "command_delay": 0.3})
    chosen = Nuisances((parameters_of(late, soil)["command_delay"],))
    problem = Problem(late, soil, one_drive().blocked, chosen, numerics=field_numerics())
    states = problem.start().states

    point = Point(np.array([delay]), states)
    reference = problem.reference(point)

    def change(at) -> np.ndarray:
        return problem.blocked.change(*(at(Point(np.array([value]), states)) for value in (end, begin))) / (end - begin)

    found = problem.parameter_columns(point, problem.predict(point), reference)[..., 0]
    expected = change(lambda there: problem.varied(there, reference))
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    assert np.abs(expected).max() > 1.0
    anew = change(problem.predict)
    assert np.linalg.norm(found - anew) < 0.05 * np.linalg.norm(anew)


def test_headings_are_compared_on_the_circle(one_drive):
    problem = one_drive(np.ones(8))
    prediction = problem.predict(problem.start())
    turned = prediction.copy()
    turned[..., CHANNELS.index("pose_yaw")] += 2.0 * np.pi
    np.testing.assert_allclose(problem.blocked.residual(turned), problem.blocked.residual(prediction), atol=1e-12)


def test_a_channel_without_weight_says_nothing(one_drive):
    problem = one_drive(np.where(np.arange(8) == CHANNELS.index("yaw_rate"), np.inf, SIGMA))
    prediction = problem.predict(problem.start())
    shape = problem.blocked.windows.measured.shape
    for name in ("yaw_rate", "specific_force_x"):
        assert not problem.blocked.residual(prediction).reshape(shape)[..., CHANNELS.index(name)].any()
        assert not problem.blocked.mask.reshape(shape)[..., CHANNELS.index(name)].any()


def test_the_robust_cost_grows_linearly(one_drive):
    gyro = CHANNELS.index("yaw_rate")
    ratios = []
    for problem in (one_drive(), one_drive(robust=ROBUST)):
        start = problem.start()
        prediction = problem.predict(start)
        costs = []
        for error in (0.0, 1.0, 2.0):
            wrong = prediction.copy()
            wrong[0, 0, gyro] += error
            costs.append(problem.losses(problem.residual(start, wrong))[0])
        ratios.append((costs[2] - costs[0]) / (costs[1] - costs[0]))
    assert ratios == pytest.approx([4.0, 2.0], rel=0.05)


@pytest.fixture(scope="module")
def four_drives(robot, soil):
    """Two drives on each of two grounds, one robot with slow motors."""
    manoeuvres = ("arcs", "spin", "arcs", "spin")
    made = []
    for strength, numbers in GROUNDS.values():
        ground = stronger(soil, strength)
        slow = replace(robot, motor_rate=MOTOR_RATE * robot.motor_rate)
        for number in numbers:
            commands = MANOEUVRES[manoeuvres[number]].commands(50.0)
            made.append(as_recording(simulate(slow, ground, commands, sensors=SENSORS, seed=number)))
    windows = windows_of(made, robot)
    return windows.subset(np.arange(0, windows.count, 2))


def test_a_joint_fit_finds_one_motor_and_a_strength_for_each_ground(four_drives, robot, soil):
    known = parameters_of(robot, soil)
    grounds = {label: numbers for label, (_, numbers) in GROUNDS.items()}
    uncertain = Nuisances((known["motor_rate"], *per_group(known["soil_strength"], grounds)))
    assert [p.name for p in uncertain.parameters] == ["motor_rate", "soil_strength_firm", "soil_strength_loose"]
    problem = Problem(robot, soil, sample_windows(four_drives, SIGMA), uncertain, numerics=field_numerics())
    fitted = fit(problem, iterations=12, renewals=12)
    plain, spread = linearised(problem, fitted).deviations()
    truth = np.log([MOTOR_RATE, *(strength for strength, _ in GROUNDS.values())])
    # sure enough to tell the grounds apart by far, and not surer than right
    deviations = np.maximum(plain, spread)
    assert (deviations < 0.02).all()
    assert (np.abs(fitted.point.values - truth) < 3.0 * deviations + 0.003).all()


def test_a_parameter_acts_in_its_scope_only_and_one_simulation_serves_all_grounds(
    four_drives, robot, soil, monkeypatch
):
    strength = parameters_of(robot, soil)["soil_strength"]
    own = per_group(strength, {label: numbers for label, (_, numbers) in GROUNDS.items()})
    blocked = sample_windows(four_drives.subset(np.arange(0, four_drives.count, 6)), SIGMA)
    together = Problem(robot, soil, blocked, Nuisances(own), numerics=field_numerics())
    shared = Problem(robot, soil, blocked, Nuisances((strength,)), numerics=field_numerics())
    point = together.start()
    base = together.predict(point)
    whole = shared.parameter_columns(shared.start(), base)[..., 0]
    simulated = []
    varied = Problem.varied
    monkeypatch.setattr(Problem, "varied", lambda self, *given: simulated.append(given) or varied(self, *given))
    columns = together.parameter_columns(point, base)
    assert len(simulated) == 1
    on_firm = np.isin(blocked.windows.recording, GROUNDS["firm"][1])
    assert on_firm.any()
    assert not on_firm.all()
    assert not columns[~on_firm, :, 0].any()
    np.testing.assert_allclose(columns.sum(axis=2), whole, rtol=1e-9, atol=1e-9)


def test_a_clock_of_its_own_delays_one_drive_alone(four_drives, robot, soil):
    shift = ModelParameter("late", "s", (), False, 0.1, 0.01, -0.3, 0.3, frozenset({1}), shift=True)
    problem = Problem(robot, soil, sample_windows(four_drives, SIGMA), Nuisances((shift,)), numerics=field_numerics())
    point = problem.start()
    late = problem.predict(replace(point, values=np.array([0.1])))
    differs = (late != problem.predict(point)).any(axis=(1, 2))
    assert differs.any()
    assert not differs[four_drives.recording != 1].any()


def test_scopes_that_overlap_are_not_simulated_together(robot, soil):
    strength = parameters_of(robot, soil)["soil_strength"]
    a, b = per_group(strength, {"a": (0, 1), "b": (2,)})
    (c,) = per_group(strength, {"c": (1, 2)})
    assert disjoint_scopes((strength, a, b, c), (0, 1, 2, 3)) == [[0], [1, 2], [3]]


@pytest.mark.parametrize(
    ("groups", "words"),
    [({"a": (0, 1), "b": (1,)}, "recording 1 is in two groups"), ({"a": ()}, "'a' has no recording")],
)
def test_groups_that_make_no_sense_are_refused(robot, soil, groups, words):
    with pytest.raises(InputError, match=words):
        per_group(parameters_of(robot, soil)["soil_strength"], groups)
