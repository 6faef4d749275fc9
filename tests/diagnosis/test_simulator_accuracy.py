"""How accurate the simulator of a diagnosis is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ddagr_gym.diagnosis.setting import Setting, make_problem
from ddagr_gym.identification.fit_numerics import block_mean_numerics
from ddagr_gym.identification.problem import Problem
from ddagr_gym.parameters import Imu, PoseReceiver, Sensors, WheelEncoder
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import simulate

RATE = 20.0
STEPS = ((6.0, 6.0), (8.0, 2.0), (-3.0, 5.0), (-9.0, -9.0), (4.0, -4.0), (10.0, 9.0))
"""Commands of a Warthog [rad/s], each held for 2 s: up to 3 m/s, with reversals."""


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
