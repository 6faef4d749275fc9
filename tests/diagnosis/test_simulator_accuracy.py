"""How accurate the simulator of a diagnosis is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.setting import Setting, make_problem
from ddagr_gym.identification.fit_numerics import block_mean_numerics, far_off_numerics
from ddagr_gym.identification.problem import Problem
from ddagr_gym.parameters import Imu, Numerics, PoseReceiver, Sensors, WheelEncoder
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import simulate

RATE = 20.0
STEPS = ((6.0, 6.0), (8.0, 2.0), (-3.0, 5.0), (-9.0, -9.0), (4.0, -4.0), (10.0, 9.0))
"""Commands of a Warthog [rad/s], each held for 2 s: up to 3 m/s, with reversals."""

SENSITIVITIES = 0.04
"""Most error of those of a diagnosis that is far off, over their size (0.026; 0.014 with steps of 25 ms)."""


def test_a_simulator_for_what_is_far_off_is_as_accurate_for_a_fast_robot() -> None:
    robot, soil = get_robot("warthog"), get_soil("firm_ground")
    sensors = Sensors(Imu(sample_rate=RATE), WheelEncoder(), PoseReceiver(5.0))
    columns = simulate(robot, soil, np.repeat(np.array(STEPS), int(2 * RATE), axis=0), sensors=sensors, seed=1)
    drive = (Recording.from_columns(columns, robot),)
    exact, coarse = (make_problem(robot, soil, drive, Setting(far_off=far_off)) for far_off in (False, True))
    finest = replace(block_mean_numerics(), maximum_step=0.005, accepted_error=1e-6)
    point = exact.start()
    truth = Problem(robot, soil, exact.blocked, exact.nuisances, numerics=finest).predict(point)
    errors = [
        float(np.sqrt(np.mean(problem.blocked.change(problem.predict(point), truth) ** 2)))
        for problem in (exact, coarse)
    ]
    assert not np.array_equal(exact.predict(point), coarse.predict(point))
    assert max(errors) < 0.05, errors
    fine = Problem(robot, soil, exact.blocked, exact.nuisances, numerics=far_off_numerics())
    truth, *others = (p.parameter_columns(point, p.predict(point))[..., p.free] for p in (exact, fine, coarse))
    off = [float(np.sqrt(((columns - truth) ** 2).sum() / (truth**2).sum())) for columns in others]
    # their own steps of 50 ms cost sensitivities little beside those of 25 ms
    assert 0.0 < off[0] < off[1] < SENSITIVITIES, off


TURNS = ((0.6, 0.6), (0.9, 0.3), (0.2, 0.8), (-0.4, -0.4), (0.5, -0.5), (0.7, 0.6))
"""Commands of a DDAGR [m/s at the rim], each held for 2 s."""


def test_derivatives_that_are_kept_cost_no_sensitivity_its_accuracy() -> None:
    """Sensitivities are differences of two simulations: a jump of the simulator would be divided by a small step."""
    robot, soil = get_robot("ddagr"), get_soil("thesis_a1")
    commands = np.repeat(np.array(TURNS) / robot.outer_radius, 2 * 50, axis=0)
    columns = simulate(robot, soil, commands, sensors=Sensors(Imu(sample_rate=50.0), WheelEncoder()), seed=1)
    given = make_problem(robot, soil, (Recording.from_columns(columns, robot),), Setting())
    truth = _sensitivities(
        given, replace(block_mean_numerics(), maximum_step=0.005, accepted_error=1e-6, contact_nodes=9)
    )
    size = np.sqrt((truth**2).sum(axis=(0, 1)))
    errors = {}
    for refresh in (0.0, block_mean_numerics().jacobian_refresh):
        found = _sensitivities(given, replace(block_mean_numerics(), jacobian_refresh=refresh))
        errors[refresh] = np.sqrt(((found - truth) ** 2).sum(axis=(0, 1)))[size > 0.0] / size[size > 0.0]
    # renewed at every step: 0.021 in the median, 0.16 at most; kept up to 0.2: 0.018 and 0.28; up to 0.5: 0.032
    assert max(np.median(found) for found in errors.values()) < 0.03, errors
    assert max(found.max() for found in errors.values()) < 0.25, errors


def _sensitivities(given: Problem, numerics: Numerics) -> NDArray[np.float64]:
    """Weighted sensitivities to the free nuisances at the nominal model, (W, M, P)."""
    problem = Problem(given.robot, get_soil("thesis_a1"), given.blocked, given.nuisances, numerics=numerics)
    point = problem.start()
    return problem.parameter_columns(point, problem.predict(point))[..., problem.free]
